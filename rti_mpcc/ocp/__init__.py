"""The optimal control problem as values: horizon, Frenet errors, weights, bounds, costs, corridor rows."""
