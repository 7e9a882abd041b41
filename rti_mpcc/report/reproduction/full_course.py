"""Constant against dynamic weights on the full course: errors at cusp and end, smoothness between them."""

from __future__ import annotations

from itertools import pairwise
from math import hypot
from typing import Any, NamedTuple

from rti_mpcc.report.numbers import number
from rti_mpcc.report.published import published, published_run, published_track
from rti_mpcc.report.reproduction import looks
from rti_mpcc.report.reproduction.content import Block, Picture, Section, Table, found, say
from rti_mpcc.report.reproduction.course_pictures import along_figure, plane_figure
from rti_mpcc.report.reproduction.exactness import (
    PoseError,
    Smoothness,
    cusp_error,
    end_error,
    smoothness,
    split_errors,
    track_smoothness,
)
from rti_mpcc.report.reproduction.runs import CONTOURING, DEFAULT, FULL_COURSE, Runs
from rti_mpcc.report.reproduction.verdicts import came_out, error_told, ratio
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.batch import Outcome

EXACT = 0.05
"""A method is as exact as another one if it errs by at most so much more [m]."""
SMOOTH = 1.25
"""And as smooth if a root mean square is at most so many times the other's."""
_SAYS = (
    "The paper drives the full course, forward to a cusp and then in reverse to the end of the path, with "
    "constant contouring weights and with the dynamic weight allocation of Eq. 7. A small constant weight "
    "cuts corners and is beside the path at the cusp and at the end; a large one is exact there but takes "
    "up the path's jumps of curvature; dynamic weights are to have both."
)
_CAUSE = (
    "Why it differs from the published code: its run with q_c = 1 gets to the end as well, so it goes on "
    "from a cusp that it is beside. Here a cusp is an arrival at rest at its pose, like a goal, and the "
    "next part begins only from a standstill near enough to it (docs/method.md); a method that comes to "
    "rest farther beside it ends there, STALLED, and has no error at the end of the course. Within β of a "
    "cusp `dynamic` has the large weight, so it is no smoother there than a constant one, and as a plan "
    "sees its whole horizon, the large weight acts on the way to the transition, too. Preset `default` "
    "plans its arrivals at rest instead, and cruises slower."
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
    rows = [measured(outcome, outcome.case.method) for outcome in outcomes]
    shown = [*rows, measured(beyond, looks.BEYOND), _published_row(beyond.result)]
    blocks: list[Block] = [say(_SAYS), *_pictures(outcomes), *_errors(shown), _constant_table(rows)]
    blocks += [found(sentence) for sentence in verdicts(rows)]
    return Section(
        name="full-course",
        title="Constant against dynamic weights on the full course",
        blocks=[*blocks, say(_CAUSE)],
        figures=[_as_json(row) for row in shown],
    )


def measured(outcome: Outcome, name: str) -> Measured:
    """Errors of a run, and its smoothness farther from cusp and end than beta."""
    result = outcome.result
    apart = result.config.weights.transition_reach
    return Measured(
        name=name,
        time=outcome.figures["time_to_tolerance_s"],
        cusp=cusp_error(result),
        end=end_error(result),
        smooth=tuple(smoothness(result, part, apart) for part in range(len(result.path.parts))),
    )


def _published_row(like: RunResult) -> Measured:
    """The published code's run on the course of a run of this project."""
    track, run = published_track(FULL_COURSE, "dynamic"), published_run(FULL_COURSE, "dynamic")
    assert track is not None
    assert run is not None
    cusp, end = split_errors(track.poses, like.path)
    apart, wheelbase = like.config.weights.transition_reach, like.config.vehicle.wheelbase
    parts = range(len(like.path.parts))
    smooth = tuple(track_smoothness(track, like.path, part, apart, wheelbase) for part in parts)
    return Measured(looks.PUBLISHED, run["time_to_tolerance_s"], cusp, end, smooth)


def _pictures(outcomes: list[Outcome]) -> list[Picture]:
    results = [outcome.result for outcome in outcomes]
    track = published_track(FULL_COURSE, "dynamic")
    assert track is not None
    return [
        Picture(
            name="full_course",
            png=looks.png(plane_figure(results, track)),
            caption="Driven path of the rear axle on the full course, preset `paper`; the cusp and the end "
            "(crosses) are shown larger, on scales of their own.",
            told="Driven paths by four methods and the published code, with cusp and end enlarged.",
        ),
        Picture(
            name="full_course_along",
            png=looks.png(along_figure(results)),
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
            caption="Errors at the cusp (nearest approach) and at the end: longitudinal, lateral, heading.",
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


def verdicts(rows: list[Measured]) -> list[str]:
    """Whether the published outcome comes out, each with the figures that say so."""
    by_name = {row.name: row for row in rows}
    constant = [by_name[name] for name in CONTOURING if name.startswith("constant")]
    dynamic, low, high = by_name["dynamic"], constant[0], constant[-1]
    cusps = [distance(row.cusp) for row in constant]
    ends = [distance(row.end) for row in constant if row.end is not None]
    sentences = [
        f"Distance to the cusp with q_c = 1, 50, 100: {_lengths(cusps)}; to the end: {_lengths(ends)} "
        f"({len(ends)} of {len(constant)} get there). "
        + came_out("Errors fall with q_c", _falls(cusps) and _falls(ends)),
        f"`dynamic` is {distance(dynamic.cusp):.3f} m from the cusp, "
        f"`constant_100` {distance(high.cusp):.3f} m. "
        + came_out(
            "As exact as q_c = 100 at the cusp", distance(dynamic.cusp) <= distance(high.cusp) + EXACT
        ),
    ]
    if dynamic.end is not None and high.end is not None:
        sentences.append(
            f"At the end it is {distance(dynamic.end):.3f} m off, `constant_100` {distance(high.end):.3f} m. "
            + came_out(
                "As exact as q_c = 100 at the end", distance(dynamic.end) <= distance(high.end) + EXACT
            )
        )
    return sentences + _smooth_told(dynamic.smooth[0], low.smooth[0], high.smooth[0])


def _smooth_told(dynamic: Smoothness | None, low: Smoothness | None, high: Smoothness | None) -> list[str]:
    """On the forward part, which all methods drive."""
    if dynamic is None or low is None or high is None:
        return []
    lines = []
    for place, name in enumerate(("rms steering rate", "rms lateral acceleration")):
        one, least, most = dynamic[place], low[place], high[place]
        told = (
            f"On the forward part, farther than β from the cusp, the {name} of `dynamic` is "
            f"{number(ratio(one, least), 2)} times that of `constant_1`, that of `constant_100` "
            f"{number(ratio(most, least), 2)} times."
        )
        claims = (
            came_out("Less smooth with a large q_c", most > least),
            came_out("`dynamic` as smooth as q_c = 1", one <= SMOOTH * least),
        )
        lines.append(" ".join([told, *claims]))
    return lines


def distance(error: PoseError) -> float:
    """To the wanted position [m]."""
    return hypot(error.longitudinal, error.lateral)


def _falls(values: list[float]) -> bool:
    return all(later <= earlier for earlier, later in pairwise(values))


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
