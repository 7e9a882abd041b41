"""Functions that only kernels call, called from Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import numba

Function = TypeVar("Function", bound=Callable[..., Any])


def called(inner: Function) -> Function:
    """A function that Python can call: numba makes no door to those that only kernels call."""

    @numba.jit(nopython=True, error_model="numpy")
    def call(*given):  # type: ignore[no-untyped-def]
        return inner(*given)

    door: Function = call
    return door
