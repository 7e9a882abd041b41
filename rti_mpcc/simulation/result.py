"""What a simulated run leaves behind: the truth, what the controller did, and what it was run with."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimation import GoalStatus, Judgement
from geometry import Area, Corridor, PathPart, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.planning.agenda import StepRecord
from rti_mpcc.simulation.goal_feed import GoalSource
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.types import Array, MissionResult, Objective, Reason, Source, Status


def cusps_of(parts: Iterable[PathPart]) -> int:
    """How often the direction changes; the vehicle may also stop between parts to turn its wheels."""
    return sum(before.direction != after.direction for before, after in pairwise(parts))


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """The truth at every plant step. All arrays are read-only.

    Attributes:
        times: (n,) [s].
        poses: (n, 3) x [m], y [m], phi [rad] of the rear axle; phi is continuous.
        v, delta: (n,) speed [m/s], steering angle as measured [rad].
        theta: (n,) progress along the route [m]; anew from 0 along each one that is planned, 0 before.
        part: (n,) index of the active one-direction part of it.
        acceleration, steering_rate: (n,) what the actuators did [m/s²], [rad/s], mean from this step to the
            next; the last entry repeats the one before.
        lateral_acceleration: (n,) v times the yaw rate [m/s²].
        goals: (n, 3) the true goal x [m], y [m], phi [rad].
    """

    times: Array
    poses: Array
    v: Array
    delta: Array
    theta: Array
    part: NDArray[np.int64]
    acceleration: Array
    steering_rate: Array
    lateral_acceleration: Array
    goals: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycles:
    """What the controller did in each of its m cycles. All arrays are read-only.

    Attributes:
        times: (m,) when the state was measured [s].
        acceleration, steering_rate: (m,) commands [m/s²], [rad/s].
        speed, steering: (m,) planned values for interfaces that take those [m/s], [rad].
        status, source, objective, cause, reason: m of each.
        weights: (m, 4) lag, contouring, progress reward, goal position, as they act on the first stage.
        iterations: (m,) of OSQP.
        solved: (m,) whether a QP was given to the solver.
        failed: (m,) whether its result was refused; iteration_limit: (m,) whether a QP used up its
            iterations.
        feedback_ms, solve_ms: (m,) as the controller took them.
        step_ms: (m,) wall time of all of step(), as the caller sees it.
        deadline_missed: (m,).
    """

    times: Array
    acceleration: Array
    steering_rate: Array
    speed: Array
    steering: Array
    status: tuple[Status, ...]
    source: tuple[Source, ...]
    objective: tuple[Objective, ...]
    cause: tuple[Reason, ...]
    reason: tuple[str, ...]
    weights: Array
    iterations: NDArray[np.int64]
    solved: NDArray[np.bool_]
    failed: NDArray[np.bool_]
    iteration_limit: NDArray[np.bool_]
    feedback_ms: Array
    solve_ms: Array
    step_ms: Array
    deadline_missed: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tracking:
    """What the controller made of the goal's detections, in each of its m cycles. Arrays are read-only.

    Attributes:
        aims: (m, 3) the pose that the active part was to end in x [m], y [m], phi [rad].
        estimates: (m, 3) the goal by the filter; NaN without one.
        covariances: (m, 3, 3) of the estimates; NaN without one.
        status: m of the filter; None without a filter.
        detections: all that were told, in order of arrival; arrivals: (k,) the cycle's time of each [s].
    """

    aims: Array
    estimates: Array
    covariances: Array
    status: tuple[GoalStatus | None, ...]
    detections: tuple[Judgement, ...]
    arrivals: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Planning:
    """How ways were planned in a run in an area.

    Attributes:
        seconds: that all searches took [s].
        replans: how often another way was planned than the first one.
    """

    seconds: float = 0.0
    replans: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class RunResult:
    """A whole run.

    Attributes:
        scenario, preset, method, seed: what was asked for.
        goal_source: how the controller knew the goal.
        config: the controller's settings.
        paths: (from time [s], route) in order of time: the one that was given, then those that were planned.
        corridors: (from time [s], corridor) in order of time; more than one where obstacles came and went;
            none in an area.
        area: where the vehicle was; None along a path.
        besides: (from time [s], obstacles (k, 2) [m] that were there besides those of the area) likewise.
        planning: of the ways in an area; None along a path, but where the vehicle left it for planned ones.
        truth, cycles: what happened; tracking: of the goal, None in a run without a detector.
        mission: all steps of the mission that were begun; mission_result: what all of it came to. None of
            either without one.
        ended: why the run ended: "docked", "mission over", "stopped" or "duration".
    """

    scenario: Scenario
    preset: str
    method: str
    seed: int
    goal_source: GoalSource
    config: ControllerConfig
    paths: tuple[tuple[float, ReferencePath], ...]
    corridors: tuple[tuple[float, Corridor], ...]
    area: Area | None
    besides: tuple[tuple[float, tuple[Array, ...]], ...]
    planning: Planning | None
    truth: Truth
    cycles: Cycles
    tracking: Tracking | None
    ended: str
    mission: tuple[StepRecord, ...] = ()
    mission_result: MissionResult | None = None

    @property
    def path(self) -> ReferencePath:
        """The route, of several the last one. Raises InputError where none was found."""
        if not self.paths:
            raise InputError(f"{self.scenario.name}: no way was found")
        return self.paths[-1][1]

    @property
    def given_path(self) -> ReferencePath | None:
        """The path of the scenario; None in an area."""
        return self.paths[0][1] if self.area is None else None

    def on_last_part(self, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        """(k,) whether the vehicle was on the last part of its route at samples `rows` (k,) of the truth."""
        begins = np.array([begin for begin, _ in self.paths])
        lasts = np.array([-1, *(len(path.parts) - 1 for _, path in self.paths)])
        place = np.searchsorted(begins, self.truth.times[rows] + SAME_TIME, side="right")
        found: NDArray[np.bool_] = self.truth.part[rows] == lasts[place]
        return found

    @property
    def title(self) -> str:
        """What was run, in short: the scenario, its preset, and the method where it is another than usual."""
        methods = "" if self.method == "dynamic" else f"{self.method}, "
        return f"{self.scenario.name} ({methods}{self.preset})"
