"""Decisions between cycles as pure functions: which part, which objective, when to arrive, where to begin."""
