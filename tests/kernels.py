"""Functions that only kernels call, called from Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba


def called(inner: Callable[..., Any]) -> Callable[..., Any]:
    """A function that Python can call: numba makes no door to those that only kernels call."""
    door: Callable[..., Any] = numba.jit(nopython=True, error_model="numpy")(lambda *given: inner(*given))
    return door
