"""A ride as one table, simulated or recorded: all pictures, pages, tables and logs of a ride read it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from estimation import CharucoDetection, CharucoGoalDetector, Judgement
from estimation.charuco import opencv
from geometry import Area, Corridor, Pose2, ReferencePath
from geometry.outline import outline_at
from rti_mpcc.clock import PlayedBack
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.mission import DockingMission
from rti_mpcc.mission.state import StepRecord
from rti_mpcc.model.footprint import clearances
from rti_mpcc.recording import read_recording
from rti_mpcc.recording.contents import core_of
from rti_mpcc.recording.moment import Moment, moment_of
from rti_mpcc.recording.recorder import run_cycle
from rti_mpcc.simulation import Controller, GoalSource, RunResult
from rti_mpcc.simulation.camera import Image
from rti_mpcc.simulation.metrics import detections_of
from rti_mpcc.simulation.result import Truth
from rti_mpcc.simulation.sections.goal import CameraSection
from rti_mpcc.types import Array, Command, VehicleState


@dataclass(frozen=True, slots=True, kw_only=True)
class Ride:
    """All that pictures show of a ride.

    Attributes:
        title: scenario or file; config: of the controller.
        motion: true at each step of the simulation; of a recording as measured in each cycle, acceleration
            and steering rate as commanded, and goals NaN.
        moments: of all cycles, in order of time; empty where no `Observer` kept them.
        path, corridor: that were given; None in an area, and `area` None along a given path.
        routes: (from time [s], route) in order of time, with the given path.
        obstacles: outlines (k, 2) [m] that were there at some time, one a second, beside those of the area.
        detections: of the goal; filtered: whether a filter estimated the goal.
        docked_object: outline (k, 2) [m] of the object at the dock, or None.
        planned_goal: (3,) the goal that the ride started from, where that was not the true one.
        steps: of its mission; frames: (stamp [s], JPEG file) of its camera's pictures.
    """

    title: str
    config: ControllerConfig
    motion: Truth
    moments: tuple[Moment, ...]
    path: ReferencePath | None
    corridor: Corridor | None
    area: Area | None
    routes: tuple[tuple[float, ReferencePath], ...]
    obstacles: tuple[Array, ...]
    detections: tuple[Judgement, ...]
    filtered: bool = False
    docked_object: Array | None = None
    planned_goal: Array | None = None
    steps: tuple[StepRecord, ...] = ()
    frames: tuple[tuple[float, bytes], ...] = ()

    @property
    def simulated(self) -> bool:
        """Whether the truth is known."""
        return bool(np.isfinite(self.motion.goals).any())

    @property
    def times(self) -> Array:
        """(n,) times of the moments [s]."""
        return np.array([moment.time for moment in self.moments])

    @property
    def end(self) -> float:
        """Time at which it ends [s]."""
        return float(self.motion.times[-1])

    def at(self, time: float) -> int:
        """Index of the moment at `time` [s]: the last one not after it, or the first one."""
        after = np.searchsorted(self.times, time + 1e-9, side="right")
        return max(0, int(after) - 1)


class Observer:
    """Steps a controller, a mission or a `Recorder` around one, and keeps its cycles as `moments`."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.moments: list[Moment] = []

    def step(self, state: VehicleState, *, now: float, **given: Any) -> Command:
        """One cycle. Arguments, result and errors are those of the controller's `step`."""
        command = self.controller.step(state, now=now, **given)
        self.moments.append(moment_of(self.controller, state, command, now))
        return command


class CameraFrames:
    """Keeps a run's pictures and detections as JPEG files 560 pixels wide: the `seen` of `simulate`."""

    def __init__(self, section: CameraSection) -> None:
        self.frames: list[tuple[float, bytes]] = []
        self._detector = CharucoGoalDetector(section.mount, section.board)

    def __call__(self, stamp: float, picture: Image, detection: CharucoDetection | None) -> None:
        """Keep a picture."""
        cv2: Any = opencv()
        annotated = self._detector.annotated(picture, detection)
        height, width = annotated.shape[:2]
        size = 560, round(560 * height / width)
        small = cv2.resize(annotated, size, interpolation=cv2.INTER_AREA)
        self.frames.append((stamp, cv2.imencode(".jpg", small)[1].tobytes()))


def ride_of_run(
    result: RunResult,
    moments: Sequence[Moment] = (),
    *,
    title: str | None = None,
    frames: Sequence[tuple[float, bytes]] = (),
) -> Ride:
    """The ride of a simulated run. Raises InputError if `moments` are not those of this run.

    Without `moments` of all its cycles by an `Observer` there are no strip charts of the control. `frames`:
    pictures of its camera.
    """
    truth, goal, times = result.truth, result.scenario.goal, result.cycles.times
    if moments and len(moments) != len(times):
        raise InputError(f"moments has {len(moments)} cycles: must be those of the run, {len(times)}")
    planned = None
    if goal.measurement is not None and result.goal_source is not GoalSource.KNOWN:
        planned = result.scenario.planned_goal()
    docked = None if goal.body is None else outline_at(goal.body, Pose2(*truth.goals[-1].tolist()))
    at = np.searchsorted([start for start, _ in result.obstacles], times + 1e-9, side="right") - 1
    # Of obstacles that move one place a second.
    shown = {int(start): outlines for start, outlines in reversed(result.obstacles)}.values()
    there = {id(each): each for outlines in shown for each in outlines}.values()
    return Ride(
        title=result.title if title is None else title,
        config=result.config,
        motion=truth,
        moments=tuple(
            replace(each, pose=truth.poses[row], goal=truth.goals[row], obstacles=result.obstacles[place][1])
            for each, row, place in zip(moments, truth.rows_at(times), at, strict=False)
        ),
        path=result.given_path,
        corridor=result.corridor,
        area=result.area,
        routes=result.paths,
        obstacles=tuple(each for each in there if docked is None or not np.array_equal(each, docked)),
        detections=tuple(detections_of(result.cycles)) if result.detector else (),
        filtered=result.detector and result.goal_source is GoalSource.DETECTED,
        docked_object=docked,
        planned_goal=None if planned is None else np.array([planned.x, planned.y, planned.phi]),
        steps=result.mission,
        frames=tuple(frames),
    )


def ride_of_recording(
    file: str | PathLike[str], *, progress: Callable[[int, int], None] | None = None
) -> Ride:
    """The ride of a recording, or of the whole cycles of a truncated one.

    Commands, plans and times are the recorded ones. A controller is driven along for the routes, which a
    recording does not hold. Cycles that raised are left out. `progress` is called with (cycles done, all).

    Raises RecordingError for a file that is no recording, InputError where it holds no cycle.
    """
    recording = read_recording(file, allow_truncated=True)
    driver, now, moments = recording.header.driver(), 0.0, list[Moment]()
    first = core_of(driver).corridor
    for done, cycle in enumerate(recording.cycles, start=1):
        run_cycle(driver, cycle.number, cycle.inputs, PlayedBack(cycle.decisions))
        if cycle.command is not None:
            # Recorded clocks may go back or fail.
            given = cycle.inputs.now if isfinite(cycle.inputs.now) else now
            now = max(now, given) if moments else given
            moments.append(moment_of(driver, cycle.inputs.state, cycle.command, now))
        if progress is not None:
            progress(done, len(recording.cycles))
    title = Path(file).name if recording.complete else f"{Path(file).name} (truncated)"
    if not moments:
        raise InputError(f"{title}: has no cycle to show")
    changes = [moments[0], *(after for before, after in pairwise(moments) if after.route is not before.route)]
    commands = [moment.command for moment in moments]
    v, delta = np.array([(moment.state.v, moment.state.delta) for moment in moments]).T
    motion = Truth(
        times=np.array([moment.time for moment in moments]),
        poses=np.array([moment.pose for moment in moments]),
        v=v,
        delta=delta,
        theta=np.array([command.diagnostics.theta for command in commands]),
        part=np.array([command.diagnostics.part for command in commands]),
        acceleration=np.array([command.acceleration for command in commands]),
        steering_rate=np.array([command.steering_rate for command in commands]),
        lateral_acceleration=v**2 * np.tan(delta) / recording.header.config.vehicle.wheelbase,
        goals=np.full((len(moments), 3), np.nan),
    )
    return Ride(
        title=title,
        config=recording.header.config,
        motion=motion,
        moments=tuple(moments),
        path=recording.header.path if first.area is None else None,
        corridor=first if first.area is None else None,
        area=first.area,
        routes=tuple((each.time, each.route) for each in changes if each.route is not None),
        obstacles=tuple({id(each): each for moment in moments for each in moment.obstacles}.values()),
        detections=tuple(each for command in commands for each in command.diagnostics.detections),
        steps=driver.log if isinstance(driver, DockingMission) else (),
    )


class Strip(NamedTuple):
    """A quantity of a strip chart, values (n,) at the times of `Ride.motion` or of its moments.

    `label`: with the unit; `comfort`, `limit`: largest absolute values, or None.
    """

    label: str
    values: Array
    comfort: float | None = None
    limit: float | None = None


def motion_strips(ride: Ride) -> list[Strip]:
    """The strips at the times of `Ride.motion`."""
    motion, comfort, limits = ride.motion, ride.config.comfort, ride.config.limits
    return [
        Strip("speed [m/s]", motion.v, limit=limits.speed),
        Strip("steering [rad]", motion.delta, limit=limits.steering),
        Strip("acceleration [m/s²]", motion.acceleration, comfort.acceleration, limits.acceleration),
        Strip("lateral acceleration [m/s²]", motion.lateral_acceleration, comfort.lateral_acceleration),
        Strip("steering rate [rad/s]", motion.steering_rate, comfort.steering_rate, limits.steering_rate),
        Strip("progress [m]", motion.theta),
    ]


def commanded_jerk(ride: Ride) -> Strip:
    """Change of the commanded acceleration from cycle to cycle over the time between, a value a moment."""
    commanded = np.array([moment.command.acceleration for moment in ride.moments])
    spans = np.diff(ride.times, prepend=ride.times[0] - ride.config.cycle)
    jerk = np.diff(commanded, prepend=0.0) / np.where(spans > 0.0, spans, np.nan)
    return Strip("jerk, commanded [m/s³]", jerk, ride.config.comfort.jerk)


def clearance(ride: Ride) -> Strip:
    """Signed distance of the measured body to what the controller knew, a value a moment; NaN: not known."""
    values = np.full(len(ride.moments), np.nan)
    for k, moment in enumerate(ride.moments):
        if moment.corridor is not None and np.isfinite(moment.pose).all():
            part = moment.command.diagnostics.part
            values[k] = clearances(moment.pose[None], moment.corridor, part, ride.config.vehicle).min()
    return Strip("clearance [m]", values, limit=ride.config.clearance.least)
