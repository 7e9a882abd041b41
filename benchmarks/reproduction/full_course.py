"""Constant against dynamic weights on the full course: errors at cusp and end, smoothness between them."""

from __future__ import annotations

from itertools import pairwise
from math import hypot
from typing import Any, NamedTuple

from benchmarks.reproduction import looks
from benchmarks.reproduction.content import Block, Picture, Section, Table, found, say
from benchmarks.reproduction.course_pictures import along_figure, plane_figure
from benchmarks.reproduction.exactness import (
    PoseError,
    Smoothness,
    end_error,
    error_at,
    nearest_error,
    smoothness,
    track_smoothness,
)
from benchmarks.reproduction.published import published, published_run, published_track
from benchmarks.reproduction.runs import CONTOURING, DEFAULT, FULL_COURSE, Runs
from benchmarks.reproduction.verdicts import came_out, error_told, ratio
from rti_mpcc.report import draw
from rti_mpcc.report.text import number
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.batch import DrivenCase

EXACT = 0.05
"""A method is as exact as another one if it errs by at most so much more [m]."""
SMOOTH = 1.25
"""And as smooth if a root mean square is at most so many times the other's."""
SAME = 0.001
"""Distances that differ by no more are the same [m]."""
_SAYS = (
    "The paper drives the full course, forward to a cusp and then in reverse to the end of the path, with "
    "constant contouring weights and with the dynamic weight allocation of Eq. 7. A small constant weight "
    "cuts corners and is beside the path at the cusp and at the end; a large one is exact there but takes "
    "up the path's jumps of curvature; dynamic weights are to have both."
)
_CAUSE = (
    "Why q_c = 1 differs from the published code: there its run goes on from beside the cusp and gets to "
    "the end as well. Here a cusp is an arrival at rest at its pose, like a goal, and the next part begins "
    "only from a standstill near enough to it (docs/decisions); a method that comes to rest farther beside "
    "it ends there, STALLED, and has no error at the end of the course. Why `dynamic` is not as smooth as "
    "q_c = 1 in every respect (of the published code's runs with constant weights only the distance at the "
    "end is known here, so it cannot be said whether it is there): within β of a cusp it has the large "
    "weight, so it is no smoother there than a constant one, and as a plan sees its whole horizon, the "
    "large weight acts on the way to the transition, too. Preset `default` plans its arrivals at rest "
    "instead, and cruises slower."
)


class Measured(NamedTuple):
    """One row of the tables; None is what was not reached. `smooth` has an entry a part."""

    name: str
    time: float | None
    cusp: PoseError
    end: PoseError | None
    smooth: tuple[Smoothness | None, ...]


def course_section(runs: Runs) -> Section:
    """The section, its tables and two figures."""
    outcomes = [runs.of(FULL_COURSE, method) for method in CONTOURING]
    beyond = runs.of(FULL_COURSE, preset=DEFAULT)
    rows = [measured(outcome, outcome.result.method) for outcome in outcomes]
    shown = [*rows, measured(beyond, looks.BEYOND), _published_row(beyond.result)]
    blocks: list[Block] = [say(_SAYS), *_pictures(outcomes), *_errors(shown), _constant_table(rows)]
    blocks += [found(sentence) for sentence in verdicts(rows, shown[-1])]
    return Section(
        name="full-course",
        title="Constant against dynamic weights on the full course",
        blocks=[*blocks, say(_CAUSE)],
        figures=[_as_json(row) for row in shown],
    )


def measured(outcome: DrivenCase, name: str) -> Measured:
    """Errors of a run, and its smoothness farther from cusp and end than beta."""
    result = outcome.result
    apart = result.config.weights.transition_reach
    return Measured(
        name=name,
        time=outcome.figures["time_to_tolerance_s"],
        cusp=nearest_error(result.truth.poses, result.path.parts[0].last),
        end=end_error(result),
        smooth=tuple(smoothness(result, part, apart) for part in range(len(result.path.parts))),
    )


def _published_row(like: RunResult) -> Measured:
    """The published code's run on the course of a run of this project."""
    track, run = published_track(FULL_COURSE, "dynamic"), published_run(FULL_COURSE, "dynamic")
    cusp = nearest_error(track.poses, like.path.parts[0].last)
    end = error_at(track.poses[-1], like.path.end)
    apart, wheelbase = like.config.weights.transition_reach, like.config.vehicle.wheelbase
    parts = range(len(like.path.parts))
    smooth = tuple(track_smoothness(track, like.path, part, apart, wheelbase) for part in parts)
    return Measured(looks.PUBLISHED, run["time_to_tolerance_s"], cusp, end, smooth)


def _pictures(outcomes: list[DrivenCase]) -> list[Picture]:
    results = [outcome.result for outcome in outcomes]
    track = published_track(FULL_COURSE, "dynamic")
    return [
        Picture(
            name="full_course",
            png=draw.png(plane_figure(results, track)),
            caption="Driven path of the rear axle on the full course, preset `paper`; the cusp and the end "
            "(crosses) are shown larger, on scales of their own.",
            told="Driven paths by four methods and the published code, with cusp and end enlarged.",
        ),
        Picture(
            name="full_course_along",
            png=draw.png(along_figure(results)),
            caption="Distance beside the path, steering and speed over the progress, preset `paper`.",
            told="Three panels over the progress; a line for each of four methods.",
        ),
    ]


def _errors(rows: list[Measured]) -> list[Table]:
    exact = [[row.name, number(row.time, 2), error_told(row.cusp), error_told(row.end)] for row in rows]
    smooth = [
        [
            row.name,
            *(number(part and part.steering_rate, 3) for part in row.smooth),
            *(number(part and part.lateral_acceleration, 3) for part in row.smooth),
        ]
        for row in rows
    ]
    return [
        Table(
            caption="Errors at the cusp (nearest approach) and at the end: longitudinal, lateral, heading. "
            "T: first time within 0.05 m, 0.05 m, 2° of the end, a dash where it never is; of the "
            "published code the time at which its run counts as arrived, which is not within that. Not "
            "reached: the run ends at the cusp.",
            heads=["method", "T [s]", "at the cusp", "at the end"],
            rows=exact,
            worded=[2, 3],
        ),
        Table(
            caption="Smoothness farther than β from the cusp (forward part) and from the end (reverse part).",
            heads=[
                "method",
                "rms δ̇ forward [rad/s]",
                "rms δ̇ reverse [rad/s]",
                "rms a_lat forward [m/s²]",
                "rms a_lat reverse [m/s²]",
            ],
            rows=smooth,
        ),
    ]


def _constant_table(rows: list[Measured]) -> Table:
    """The published code's distances beside the end for constant weights, and those measured."""
    mine = {row.name: row.end for row in rows}
    known = {f"constant_{one['contouring']:g}": one["beside_end_m"] for one in published()["constant"]}
    names = sorted({*known, *(name for name in mine if name.startswith("constant"))}, key=_weight)
    cells = []
    for name in names:
        end = mine.get(name)
        here = "not driven" if name not in mine else number(abs(end.lateral), 3) if end else "not reached"
        cells.append([f"q_c = {_weight(name)}", number(known.get(name), 3), here])
    return Table(
        caption="Distance beside the end of the course with constant weights [m].",
        heads=["weight", "published code", "here, preset `paper`"],
        rows=cells,
    )


def _weight(name: str) -> int:
    return int(name.rpartition("_")[2])


def verdicts(rows: list[Measured], there: Measured) -> list[str]:
    """Whether the published outcome comes out, each with the figures that say so.

    `there`: `dynamic` by the published code.
    """
    by_name = {row.name: row for row in rows}
    constant = [by_name[name] for name in CONTOURING if name.startswith("constant")]
    dynamic, low, high = by_name["dynamic"], constant[0], constant[-1]
    cusps = [distance(row.cusp) for row in constant]
    ends = [distance(row.end) for row in constant if row.end is not None]
    sentences = [
        came_out(
            "Errors at the cusp fall with q_c, or stay the same within 1 mm",
            _falls(cusps),
            f"q_c = 1, 50, 100: {_lengths(cusps)}",
        ),
        came_out(
            "Errors at the end fall with q_c",
            _falls(ends) if len(ends) > 1 else None,
            f"{_lengths(ends)}; {len(ends)} of {len(constant)} get there",
        ),
        came_out(
            "`dynamic` is as exact as q_c = 100 at the cusp",
            distance(dynamic.cusp) <= distance(high.cusp) + EXACT,
            f"{distance(dynamic.cusp):.3f} m and {distance(high.cusp):.3f} m",
        ),
    ]
    if dynamic.end is not None and high.end is not None:
        one, other = distance(dynamic.end), distance(high.end)
        exact = came_out(
            "`dynamic` is as exact as q_c = 100 at the end",
            one <= other + EXACT,
            f"{one:.3f} m and {other:.3f} m",
        )
        sentences.append(exact)
    smooth = (row.smooth[0] for row in (dynamic, low, high, there))
    return sentences + _smooth_told(*smooth)


def _smooth_told(
    dynamic: Smoothness | None, low: Smoothness | None, high: Smoothness | None, there: Smoothness | None
) -> list[str]:
    """On the forward part, which all methods drive, farther than beta from the cusp."""
    if dynamic is None or low is None or high is None or there is None:
        return []
    lines = []
    for place, (name, unit) in enumerate((("steering rate", "rad/s"), ("lateral acceleration", "m/s²"))):
        one, least, most = dynamic[place], low[place], high[place]
        where = f"by the rms {name} on the forward part farther than β from the cusp"
        base, published_code = (f"{number(value, 3)} {unit}" for value in (least, there[place]))
        lines += [
            came_out(
                f"The path is less smooth with a large q_c, {where}",
                most > least,
                f"q_c = 100: {number(ratio(most, least), 2)} times q_c = 1",
            ),
            came_out(
                f"`dynamic` is as smooth as q_c = 1, {where}",
                one <= SMOOTH * least,
                f"{number(ratio(one, least), 2)} times: {number(one, 3)} {unit}, q_c = 1: {base}; "
                f"the published code's `dynamic`: {published_code}",
            ),
        ]
    return lines


def distance(error: PoseError) -> float:
    """To the wanted position [m]."""
    return hypot(error.longitudinal, error.lateral)


def _falls(values: list[float]) -> bool:
    return all(later <= earlier + SAME for earlier, later in pairwise(values))


def _lengths(values: list[float]) -> str:
    return ", ".join(f"{value:.3f} m" for value in values) or "none"


def _as_json(row: Measured) -> dict[str, Any]:
    return {
        "method": row.name,
        "time_to_tolerance_s": row.time,
        "cusp": row.cusp._asdict(),
        "end": row.end and row.end._asdict(),
        "smoothness": [part and part._asdict() for part in row.smooth],
    }
