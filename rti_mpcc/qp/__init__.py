"""The quadratic program of a cycle: fixed sparsity pattern, filling its slots, the one door to OSQP."""
