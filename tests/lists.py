"""Lists of cases, of which some run with each commit, and the others with `make acceptance` only."""

from __future__ import annotations

from collections.abc import Container, Iterable
from typing import Any

import pytest


def some_of(cases: Iterable[Any], every: int = 2) -> list[Any]:
    """Cases, values or tuples of them: of `every` in a row only the first one is in the fast suite."""
    tuples = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [acceptance(*case) if place % every else pytest.param(*case) for place, case in enumerate(tuples)]


def in_fast_suite(fast: Container[Any], cases: Iterable[Any]) -> list[Any]:
    """Cases, values or tuples of them, of which only those of `fast` are in the fast suite."""
    tuples = [(case, case if isinstance(case, tuple) else (case,)) for case in cases]
    return [pytest.param(*each) if case in fast else acceptance(*each) for case, each in tuples]


def acceptance(*case: Any) -> Any:
    """A case that is not in the fast suite."""
    return pytest.param(*case, marks=pytest.mark.acceptance)
