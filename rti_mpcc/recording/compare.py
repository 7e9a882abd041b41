"""Differences between what was recorded and what came of the replay, field by field."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isclose

from rti_mpcc.recording.lines import Data, to_text

TIMES = frozenset({"prepare_ms", "feedback_ms", "solve_ms", "step_ms"})
"""Diagnostics that tell how long something took: never the same twice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldDifference:
    """One field that is not as it was recorded.

    Attributes:
        field: its name, such as command.trajectory.states[3][1]; of a list the first entry that differs.
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
    if isinstance(recorded, dict) and isinstance(replayed, dict):
        for name in dict.fromkeys([*recorded, *replayed]):
            if name not in TIMES:
                place = f"{field}.{name}" if field else name
                yield from differences(recorded.get(name), replayed.get(name), tolerance, place)
    elif to_text(recorded) == to_text(replayed):  # of numbers: the same bits, or both are NaN
        return
    elif isinstance(recorded, list) and isinstance(replayed, list) and len(recorded) == len(replayed):
        for i, (one, other) in enumerate(zip(recorded, replayed, strict=True)):
            found = list(differences(one, other, tolerance, f"{field}[{i}]"))
            if found:
                yield from found
                break
    elif not _near(recorded, replayed, tolerance):
        numbers = isinstance(recorded, int | float) and isinstance(replayed, int | float)
        size = abs(replayed - recorded) if numbers else None
        yield FieldDifference(field=field, recorded=recorded, replayed=replayed, size=size)


def _near(one: Data, other: Data, tolerance: float) -> bool:
    floats = isinstance(one, float) and isinstance(other, float)
    return tolerance > 0.0 and floats and isclose(one, other, rel_tol=tolerance, abs_tol=tolerance)
