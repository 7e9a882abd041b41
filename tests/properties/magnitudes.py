"""Numbers to try a formula at: 0, and all orders of magnitude around it."""

from __future__ import annotations

from math import log10

from hypothesis import settings
from hypothesis import strategies as st

examples = settings(derandomize=True, deadline=None, max_examples=150)
"""The same examples in every run."""
few_examples = settings(derandomize=True, deadline=None, max_examples=40)
"""The same, for what takes milliseconds."""


def positive(least: float, most: float) -> st.SearchStrategy[float]:
    """Numbers from `least` > 0 to `most`, every order of magnitude as likely as the next."""
    return st.floats(log10(least), log10(most)).map(lambda power: min(max(10.0**power, least), most))


def from_zero(least: float, most: float) -> st.SearchStrategy[float]:
    """Exactly 0, or a positive number between these."""
    return st.one_of(st.just(0.0), positive(least, most))


def signed(least: float, most: float) -> st.SearchStrategy[float]:
    """Exactly 0, or a number of either sign with a magnitude between these."""
    return st.one_of(st.just(0.0), positive(least, most), positive(least, most).map(lambda value: -value))
