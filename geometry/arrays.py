"""Names of arrays, and arrays that nobody writes into."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, get_origin

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
Value = TypeVar("Value")
Record = TypeVar("Record", bound=tuple[Any, ...])


def is_array(hint: Any) -> bool:
    """Whether a type hint is one of an array. Since numpy 2.5 `NDArray` is no alias of `np.ndarray`."""
    return hint is np.ndarray or get_origin(hint) in (np.ndarray, NDArray)


def locked(value: Value) -> Value:
    """Lock an array, as kernels take it; a number is returned as it is."""
    if isinstance(value, np.ndarray):
        value.setflags(write=False)
    return value


def locked_record(kind: Callable[..., Record], *values: Any) -> Record:
    """Return a NamedTuple of this kind with locked arrays: kernels refuse open ones where it has others."""
    return kind(*map(locked, values))
