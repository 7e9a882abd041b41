"""What a campaign keeps of a case: one line of JSON, the same whatever drove it, where and when.

No computing times and nothing of the machine: a row follows from what is drawn, level, seed, index, method,
preset and the versions that campaign.json names. What was timed is a line of its own, for another file.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from itertools import pairwise
from math import hypot, tan
from typing import Any, NamedTuple

import numpy as np

from benchmarks.problems.scene_scenario import kind_of
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.batch import Outcome
from rti_mpcc.simulation.metrics import untimed
from rti_mpcc.simulation.result import Cycles, RunResult
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.solid import SolidThings
from rti_mpcc.types import Source, Status

DIGITS = 6
"""Of what is reckoned from the rounded numbers of a course."""


class CaseOutcome(Enum):
    """How a case ended."""

    DOCKED = "docked"
    """Inside tolerance of the true goal and standing, and so at the end; and the controller says so."""
    UNCONFIRMED = "unconfirmed"
    """The same, but the controller does not say so."""
    STALLED = "stalled"
    """The controller said so, and stood."""
    FAILED = "failed"
    """The controller had no plan, and stood."""
    UNFINISHED = "unfinished"
    """The time ran out."""
    RAISED = "raised"
    """An exception: a mistake of the program."""
    WORKER_DIED = "worker_died"
    """The process that drove it ended, with no other case under way."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CourseFigures:
    """How difficult a course is.

    Attributes:
        direction: of the last part: 1 forward, -1 reverse.
        pieces: number of arcs; cusps: number of changes of direction; length_m: of the route [m].
        curvature: largest |kappa| of the route [1/m].
        room_m: from the body on the route to the nearest boundary beside it, narrowings included [m].
        narrowings, obstacles: how many.
        goal_behind_m: behind the end of the route along the travel, negative inside [m].
        goal_beside_m, goal_turned_rad: to the left of the vehicle's heading there [m], [rad].
    """

    direction: int
    pieces: int
    cusps: int
    length_m: float
    curvature: float
    room_m: float
    narrowings: int
    obstacles: int
    goal_behind_m: float
    goal_beside_m: float
    goal_turned_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneFigures:
    """How difficult a scene is.

    Attributes:
        kind: of scene.
        wheelbase_m, radius_m: of the vehicle, and of its sharpest bend [m].
        apart_m, turned_rad: from the start to the goal [m], [rad], without the sign.
        room_at_start_m, room_at_goal_m: from the body there to all that is solid [m].
        obstacles: how many; bounded: 1 where there is a boundary, else 0.
        comfort_acceleration: [m/s²].
    """

    kind: str
    wheelbase_m: float
    radius_m: float
    apart_m: float
    turned_rad: float
    room_at_start_m: float
    room_at_goal_m: float
    obstacles: int
    bounded: int
    comfort_acceleration: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DisturbanceFigures:
    """What a case is disturbed by: zeros, and a gain of 1, where by nothing.

    Attributes:
        position_std_m, heading_std_rad: of a detection from 10 m away; dropout, outlier: probabilities;
            delay_s: of detections.
        initial_offset: of the planned goal in the true one's frame [m], [m], [rad].
        state_noise: standard deviations of the measured x, y [m], phi [rad], v [m/s], delta [rad].
        wheelbase_error: relative; steering_offset_rad; acceleration_gain; dead_time_s: of the plant.
    """

    position_std_m: float
    heading_std_rad: float
    dropout: float
    outlier: float
    delay_s: float
    initial_offset: tuple[float, float, float]
    state_noise: tuple[float, float, float, float, float]
    wheelbase_error: float
    steering_offset_rad: float
    acceleration_gain: float
    dead_time_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignRow:
    """One case.

    Attributes:
        index: of the case; scenario: its name.
        outcome: how it ended; detail: of what did not dock, the controller's last reason, or the exception.
        course, disturbances: what it was; None where it could not be drawn.
        figures: of `metrics.summary` but those that are timed, with cycles_by_status (counts) and
            failures_driven (cycles whose QP was refused and whose command is its solution all the same); None
            where nothing was driven to its end.
        timed: what is not the same the next time, see `timed_figures`; no part of the line.
    """

    index: int
    scenario: str
    outcome: CaseOutcome
    detail: str
    course: CourseFigures | SceneFigures | None
    disturbances: DisturbanceFigures | None
    figures: Mapping[str, Any] | None
    timed: Mapping[str, Any] | None = None

    def line(self) -> str:
        """The row as JSON, with its line end. Raises ValueError for figures that are not finite."""
        table = asdict(self) | {"outcome": self.outcome.value}
        del table["timed"]
        return _line(table)

    def lines(self) -> Lines:
        """Both. Raises ValueError likewise."""
        timed = None if self.timed is None else _line({"index": self.index, **self.timed})
        return Lines(self.line(), timed)


class Lines(NamedTuple):
    """What is kept of a case: its row, and what was timed, None where nothing was."""

    row: str
    timed: str | None = None


def _line(table: Mapping[str, Any]) -> str:
    return json.dumps(table, allow_nan=False, separators=(",", ":"), ensure_ascii=False) + "\n"


def row_of(index: int, outcome: Outcome) -> CampaignRow:
    """The row of a case that was driven."""
    result = outcome.result
    figures = untimed(outcome.figures)
    figures["cycles_by_status"] = dict(
        sorted(Counter(status.value for status in result.cycles.status).items())
    )
    figures["failures_driven"] = failures_driven(result.cycles)
    ended = outcome_of(result, docked=figures["docked"])
    reasons = [] if ended is CaseOutcome.DOCKED else [reason for reason in result.cycles.reason if reason]
    return CampaignRow(
        index=index,
        scenario=result.scenario.name,
        outcome=ended,
        detail=reasons[-1] if reasons else "",
        course=course_figures(result.scenario),
        disturbances=disturbance_figures(result.scenario),
        figures=figures,
        timed=timed_figures(outcome),
    )


def timed_figures(outcome: Outcome) -> dict[str, Any]:
    """What differs from run to run.

    That all searches took (planning_s), cycle_ms and deadline_misses as in summary.json, and by status the
    slowest cycle (slowest_ms) and how many missed the deadline (misses). Times leave the first cycle out.
    """
    result, figures = outcome.result, outcome.figures
    cycles = result.cycles
    slowest: dict[str, float] = {}
    for status, time in zip(cycles.status[1:], cycles.step_ms[1:].tolist(), strict=True):
        slowest[status.value] = max(slowest.get(status.value, 0.0), time)
    missed = (
        status.value for status, late in zip(cycles.status, cycles.deadline_missed, strict=True) if late
    )
    return {
        "planning_s": None if result.planning is None else result.planning.seconds,
        "cycle_ms": figures["cycle_ms"],
        "deadline_misses": figures["deadline_misses"],
        "slowest_ms": dict(sorted(slowest.items())),
        "misses": dict(sorted(Counter(missed).items())),
    }


def outcome_of(result: RunResult, *, docked: bool) -> CaseOutcome:
    """How a run ended, by its figures and the controller's last word."""
    if docked:
        said = result.cycles.status[-1] is Status.DOCKED
        return CaseOutcome.DOCKED if said else CaseOutcome.UNCONFIRMED
    if result.ended != "stopped":
        return CaseOutcome.UNFINISHED
    failed = result.cycles.status[-1] is Status.FAILED
    return CaseOutcome.FAILED if failed else CaseOutcome.STALLED


def failures_driven(cycles: Cycles) -> int:
    """Cycles whose QP was refused and whose command is its solution all the same: there must be none."""
    driven = np.array([source is Source.SOLUTION for source in cycles.source])
    return int(np.count_nonzero(cycles.failed & driven))


def course_figures(scenario: Scenario) -> CourseFigures | SceneFigures:
    """Of a scene, or of a scenario with arcs for a route and offsets for corridor and goal.

    Raises InputError for others.
    """
    if scenario.in_area:
        return scene_figures(scenario)
    route, corridor, offset = scenario.path.segments, scenario.corridor, scenario.goal.offset
    if route is None or corridor.left is None or corridor.right is None or offset is None:
        raise InputError(f"{scenario.name}: needs path.segments, corridor.left and .right and goal.offset")
    sides = [(corridor.left, corridor.right), *((one.left, one.right) for one in corridor.narrowings)]
    nearest = min(abs(side) for pair in sides for side in pair if side is not None)
    directions = [piece.direction for piece in route]
    along, beside, turned = offset
    return CourseFigures(
        direction=directions[-1],
        pieces=len(route),
        cusps=sum(one != other for one, other in pairwise(directions)),
        length_m=round(sum(piece.length for piece in route), DIGITS),
        curvature=max(abs(piece.curvature) for piece in route),
        room_m=round(nearest - 0.5 * scenario.vehicle.width, DIGITS),
        narrowings=len(corridor.narrowings),
        obstacles=len(corridor.obstacles),
        goal_behind_m=directions[-1] * along,
        goal_beside_m=beside,
        goal_turned_rad=turned,
    )


def scene_figures(scenario: Scenario) -> SceneFigures:
    """Of a scenario in an area."""
    vehicle, area = scenario.build_vehicle(), scenario.area
    assert area is not None
    start, goal = scenario.start_pose(), scenario.goal_pose()
    poses = np.array([(pose.x, pose.y, pose.phi) for pose in (start, goal)])
    room = SolidThings.of(scenario.build_area()).clearance(poses, vehicle)
    return SceneFigures(
        kind=kind_of(scenario),
        wheelbase_m=vehicle.wheelbase,
        radius_m=round(vehicle.wheelbase / tan(scenario.limits.steering), DIGITS),
        apart_m=round(hypot(goal.x - start.x, goal.y - start.y), DIGITS),
        turned_rad=round(abs(goal.relative_to(start).phi), DIGITS),
        room_at_start_m=round(float(room[0]), DIGITS),
        room_at_goal_m=round(float(room[1]), DIGITS),
        obstacles=len(area.obstacles),
        bounded=int(area.boundary is not None),
        comfort_acceleration=scenario.controller_config().comfort_acceleration,
    )


def disturbance_figures(scenario: Scenario) -> DisturbanceFigures:
    """What a scenario has of errors and noise."""
    seen, simulation = scenario.goal.measurement, scenario.simulation
    return DisturbanceFigures(
        position_std_m=seen.position_std if seen else 0.0,
        heading_std_rad=seen.heading_std if seen else 0.0,
        dropout=seen.dropout if seen else 0.0,
        outlier=seen.outlier if seen else 0.0,
        delay_s=seen.delay if seen else 0.0,
        initial_offset=seen.initial_offset if seen else (0.0, 0.0, 0.0),
        state_noise=simulation.state_noise,
        wheelbase_error=simulation.wheelbase_error,
        steering_offset_rad=simulation.steering_offset,
        acceleration_gain=simulation.acceleration_gain,
        dead_time_s=simulation.dead_time,
    )
