"""The quadratic program of a cycle: fixed sparsity pattern, filling its slots, and its solvers."""
