"""The optimal control problem as values: horizon, Frenet errors, weights, bounds, stage costs, corridor rows."""
