"""Differences between what was recorded and what came of the replay, field by field."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from struct import pack

import numpy as np
from numpy.typing import NDArray

from rti_mpcc.recording.codec import Data, array_from, is_array
from rti_mpcc.types import Array

TIMES = frozenset({"prepare_ms", "feedback_ms", "solve_ms", "step_ms"})
"""Diagnostics that tell how long something took: never the same twice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldDifference:
    """One field that is not as it was recorded.

    Attributes:
        field: its name, such as command.trajectory.states[3, 1]; of an array the first entry that differs.
        recorded, replayed: its values; None also where there is no such field.
        size: |replayed - recorded|; None if these are not two numbers.
    """

    field: str
    recorded: object
    replayed: object
    size: float | None


def differences(
    recorded: Data, replayed: Data, tolerance: float, field: str = ""
) -> Iterator[FieldDifference]:
    """Compare JSON data, in the order of their fields; times are left out.

    Args:
        tolerance: of numbers, absolute up to 1 and relative above; 0: they must be the same bit for bit.
            Numbers that are not finite must be the same.
    """
    if is_array(recorded) and is_array(replayed):
        yield from _of_arrays(array_from(recorded), array_from(replayed), tolerance, field)
    elif isinstance(recorded, dict) and isinstance(replayed, dict):
        for name in dict.fromkeys([*recorded, *replayed]):
            if name not in TIMES:
                place = f"{field}.{name}" if field else name
                yield from differences(recorded.get(name), replayed.get(name), tolerance, place)
    elif isinstance(recorded, list) and isinstance(replayed, list) and len(recorded) == len(replayed):
        for i, (one, other) in enumerate(zip(recorded, replayed, strict=True)):
            yield from differences(one, other, tolerance, f"{field}[{i}]")
    elif _is_number(recorded) and _is_number(replayed):
        if not _same_numbers(recorded, replayed, tolerance):
            size = abs(replayed - recorded)
            yield FieldDifference(field=field, recorded=recorded, replayed=replayed, size=size)
    elif type(recorded) is not type(replayed) or recorded != replayed:
        yield FieldDifference(field=field, recorded=recorded, replayed=replayed, size=None)


def _of_arrays(recorded: Array, replayed: Array, tolerance: float, field: str) -> Iterator[FieldDifference]:
    if recorded.shape != replayed.shape:
        yield FieldDifference(
            field=f"{field}.shape", recorded=recorded.shape, replayed=replayed.shape, size=None
        )
        return
    differing = np.argwhere(~_same_entries(recorded, replayed, tolerance))
    if len(differing):
        place = tuple(differing[0].tolist())
        one, other = float(recorded[place]), float(replayed[place])
        name = f"{field}[{', '.join(map(str, place))}]"
        yield FieldDifference(field=name, recorded=one, replayed=other, size=abs(other - one))


def _same_entries(one: Array, other: Array, tolerance: float) -> NDArray[np.bool_]:
    if tolerance == 0.0:
        same = one.view(np.int64) == other.view(np.int64)
    else:
        with np.errstate(invalid="ignore", over="ignore"):
            scale = np.maximum(1.0, np.maximum(np.abs(one), np.abs(other)))
            near = np.abs(other - one) <= tolerance * scale
        same = (one == other) | (near & np.isfinite(one) & np.isfinite(other))
    return np.asarray(same | (np.isnan(one) & np.isnan(other)))


def _same_numbers(one: float, other: float, tolerance: float) -> bool:
    if isinstance(one, int) and isinstance(other, int):
        return one == other
    if tolerance == 0.0:
        return pack("<d", one) == pack("<d", other) or (one != one and other != other)
    return bool(_same_entries(np.array(float(one)), np.array(float(other)), tolerance))


def _is_number(data: Data) -> bool:
    return type(data) in (int, float)
