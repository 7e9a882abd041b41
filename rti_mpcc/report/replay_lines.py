"""What a replay came to, in lines for a terminal."""

from __future__ import annotations

from textwrap import shorten

from rti_mpcc.recording import FieldDifference, Mismatch, ReplayReport

SHOWN = 12
"""Fields of the first differing cycle that are shown, at most."""
LONGEST = 200
"""Characters of a value that are shown, at most."""


def replay_lines(report: ReplayReport) -> list[str]:
    """One line if all is as it was recorded; otherwise where it first is not, and what differs there."""
    how = "bit for bit" if report.tolerance == 0.0 else f"within {report.tolerance:g}"
    there = "the machine and with the versions" if report.same_machine else "another machine or versions"
    than = "of the recording" if report.same_machine else "than the recording's"
    compared = f"{report.cycles} cycles compared {how}, on {there} {than}"
    if not report.complete:
        compared += ", which is truncated"
    if report.mismatch is None:
        return [f"identical: {compared}"]
    return [*_mismatch_lines(report.mismatch), compared]


def _mismatch_lines(mismatch: Mismatch) -> list[str]:
    place = f"cycle {mismatch.cycle} at {mismatch.time:.3f} s"
    lines = [f"different: {place}" + (f": {mismatch.changed}" if mismatch.changed else "")]
    fields = mismatch.fields
    if not fields:
        lines.append("  what comes of it is the same")
    lines += [_field_line(field) for field in fields[:SHOWN]]
    if len(fields) > SHOWN:
        lines.append(f"  and {len(fields) - SHOWN} fields more")
    return lines


def _field_line(field: FieldDifference) -> str:
    one, other = field.recorded, field.replayed
    size = ""
    if isinstance(one, int | float) and isinstance(other, int | float):
        size = f", difference {abs(other - one):.3g}"
    recorded, replayed = (shorten(repr(value), LONGEST) for value in (one, other))
    return f"  {field.field}: recorded {recorded}, replayed {replayed}{size}"
