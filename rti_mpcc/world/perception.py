"""What is known after the inputs of one more cycle: of the vehicle, its surroundings, and its goal.

No input makes it raise: unusable ones are ignored, with a remark.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from estimation import Frame, GoalMeasurement, GoalPoseFilter, Judgement
from estimation.goal_filter import CLOCK_SKEW
from estimation.measurement import LATEST
from geometry import PathPart, Pose2, ReferencePath
from geometry.pose import degrees_hint
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import BAD_INPUT, RtiMpccError
from rti_mpcc.model.actuators import UNDISTURBED, Disturbance
from rti_mpcc.model.layout import PHI
from rti_mpcc.types import Array, GoalOrigin, Obstacle, VehicleState
from rti_mpcc.world import goal_setpoint, goals, vehicle
from rti_mpcc.world.monitor import FARTHEST, LARGEST_HEADING, StateMonitor, validate_measurement
from rti_mpcc.world.surroundings import Surroundings
from rti_mpcc.world.world import ClockState, GoalState, W, World


class StepInputs(NamedTuple):
    """What the controller's `step` is given, as it is given: see there."""

    measured: VehicleState
    now: float
    goal: Pose2 | None
    measurements: Sequence[GoalMeasurement]
    obstacles: Sequence[ArrayLike] | None


class Perception:
    """Turns what `step` is given into what is known, with the filter of the goal's detections."""

    def __init__(self, config: ControllerConfig) -> None:
        self._config = config
        # Made in any case: a first detection while driving must not wait for what the filter loads.
        self._filter = GoalPoseFilter(config.goal_tracking.filter)
        self._filtering = config.goal_tracking.required

    def forget_goal(self) -> None:
        """Of another goal nothing was detected yet."""
        self._filter.reset()

    def updated(
        self, s: W, given: StepInputs, *, path: ReferencePath, part: PathPart, holds: bool
    ) -> tuple[W, tuple[str, ...]]:
        """With the usable inputs, and remarks on the others.

        `path`: that is driven, and its `part`; `holds`: the vehicle is held at its dock.
        """
        config, last = self._config, s.vehicle
        clock, clock_remark = timed(s.clock, given.now, config)
        area = surroundings_in(s.area, given.obstacles, clock.now)
        monitor = validate_measurement(
            last.monitor, given.measured, s.queue, clock.now, config, last.disturbance
        )
        if clock_remark:  # how long ago the last measurement was is not known
            monitor = replace(monitor, disputed=True)
        moved, corrected = last.motion.noted(monitor, config), ""
        records, answer = vehicle.compare_actuators(s, monitor, moved, holds, config)
        if answer != last.actuators:
            s, monitor, corrected = vehicle.correct_actuators(s, monitor, records, answer, config)
            moved = s.vehicle.motion.noted(monitor, config)
        known = vehicle.learnt(s, monitor, moved, records[0], holds, config)
        if area.unreadable and not monitor.doubt:
            since = last.monitor.since if last.monitor.doubt else clock.now
            monitor = replace(monitor, doubt=area.unreadable, since=since)
        hint = last.heading_hint
        if hint or last.monitor.state is None:
            hint = _heading_hint(s, monitor, part)
        poses = last.poses
        if monitor.state is not None and not monitor.doubt:  # for detections that may still arrive
            length = config.goal_tracking.filter.history
            poses = poses.noted(clock.now, Pose2(*monitor.state[:3].tolist()), length=length)
        disturbance = last.disturbance  # what a hold has found stays until something else is learnt
        if known is not last.offsets and not holds:
            disturbance = UNDISTURBED
            if known is not None:
                disturbance = Disturbance(known.acceleration, known.steering, known.gain, known.turn)
        estimate = replace(
            s.vehicle,
            monitor=monitor,
            offsets=known,
            disturbance=disturbance,
            poses=poses,
            heading_hint=hint,
            records=records,
            motion=moved,
        )
        goal = self._goal_in(given.goal, s.goal, path, area, clock.now)
        s = replace(s, clock=clock, area=area, vehicle=estimate, goal=goal)
        return s, (clock_remark, hint, corrected, *vehicle.sensor_remarks(monitor, moved, known))

    def _goal_in(
        self, given: Pose2 | None, known: GoalState, path: ReferencePath, area: Surroundings, now: float
    ) -> GoalState:
        """What is known of the goal. An accepted goal stays, even if an obstacle comes there; a rejected one
        has to be given again. One that was averaged, and after which no other came, is taken as it is."""
        taken, came, refusal, its_fit = None, known.given, known.refusal, known.given_fit
        averaged, config = known.averaged_at, self._config
        if given is None and averaged is not None and now - averaged >= goal_setpoint.NOISE_TIME:
            given = known.given
        if given is not None:
            came, refusal = usable_goal(given)
            goal = came and goal_setpoint.steadied(came, known.given, known.planned, config.cycle)
            averaged = None if goal == came else now
            if goal is not None and goal != known.planned:
                its_fit = goals.checked_again(its_fit, goal, path, area, config)
                if its_fit.problem:
                    refusal = f"goal {_text(goal)} rejected: {its_fit.problem}"
                else:
                    taken = goal
        fit = known.fit if taken is None else its_fit
        if fit is None and area.corridor.area is None:
            fit = goals.end_checked(path, area, config)
        same = (came, averaged, refusal) == (known.given, known.averaged_at, known.refusal)
        if not (same and fit is known.fit and its_fit is known.given_fit):
            known = replace(
                known, given=came, averaged_at=averaged, given_fit=its_fit, fit=fit, refusal=refusal
            )
        return known if taken is None else self.with_goal(known, taken)

    def with_goal(self, known: GoalState, goal: Pose2 | None) -> GoalState:
        """With another planned goal; detections of the same dock are kept, those of another start anew."""
        dock = known.dock
        if goal and dock and goal.relative_to(dock).within(self._config.goal_tolerance):
            pose = goal if known.detected is None else known.pose
            return replace(known, planned=goal, pose=pose, origin=GoalOrigin.GIVEN)
        self.forget_goal()
        return replace(
            known,
            dock=goal,
            planned=goal,
            pose=goal,
            estimate=None,
            estimated_at=None,
            estimate_fit=None,
            detected=None,
            undetected="",
            origin=GoalOrigin.PATH_END if goal is None else GoalOrigin.GIVEN,
        )

    def located(
        self, s: W, given: Sequence[GoalMeasurement], path: ReferencePath
    ) -> tuple[W, tuple[Judgement, ...], str]:
        """With the detections filtered and the setpoint moved; judgements, and what is unfit."""
        measurements, unfit = measurements_in(given)
        self._filtering = self._filtering or bool(measurements)
        if not self._filtering:
            if unfit or s.goal.undetected:
                refused = goal_setpoint.undetected(s.goal, (), unfit)
                s = replace(s, goal=replace(s.goal, undetected=refused))
            return s, (), unfit
        end = None if s.area.corridor.area is not None else path.end
        self._filter.expect(goal_setpoint.prior(s.goal, end))
        self._filter.predict(s.clock.now)
        judgements = []
        for measurement in measurements:
            # With its stamp on the controller's own clock, and the vehicle's pose then.
            stamp = measurement.stamp + s.clock.offset
            at = measurement.vehicle or s.vehicle.poses.at(stamp, ahead=CLOCK_SKEW)
            judgement = self._filter.update(replace(measurement, stamp=stamp, vehicle=at))
            judgements.append(replace(judgement, stamp=measurement.stamp))
        estimate = self._filter.estimate(s.clock.now)
        fit = None
        if estimate.pose is not None:
            fit = goals.checked_again(s.goal.estimate_fit, estimate.pose, path, s.area, self._config)
        goal = goal_setpoint.rate_limited_goal(s, estimate, fit, end, self._config.cycle)
        goal = replace(goal, undetected=goal_setpoint.undetected(goal, judgements, unfit))
        return replace(s, goal=goal), tuple(judgements), unfit


def _heading_hint(s: World, monitor: StateMonitor, part: PathPart) -> str:
    """The remark on the first measured heading, as long as one as large is measured."""
    state, measured = monitor.state, monitor.measured
    hint = "" if measured is None else degrees_hint("heading", float(measured[PHI]))
    if state is None or not hint:
        return ""
    if s.vehicle.monitor.state is not None:
        return s.vehicle.heading_hint
    if s.area.corridor.area is not None:
        return hint
    return goals.degrees_beside("heading", Pose2(*state[:3].tolist()), part)


# -- the inputs of a cycle, checked ---------------------------------------------------------------------

STOOD_CYCLES = 3  # after which a clock that has not moved stands still
LEAP = 3600.0  # [s]; a clock that leaps ahead by more was set anew


def usable_goal(given: Pose2) -> tuple[Pose2 | None, str]:
    """A goal as a pose that a route can be planned to, or None, and why it is none."""
    try:
        x, y, phi = given.x, given.y, given.phi
    except AttributeError:
        return None, f"goal rejected: expected Pose2, got {type(given).__name__}"
    if not _all_finite(x, y, phi):
        return None, f"goal ({x}, {y}, {phi}) rejected: not finite"
    goal = given if isinstance(given, Pose2) else Pose2(float(x), float(y), float(phi))
    if max(abs(x), abs(y)) > FARTHEST:
        return None, f"goal {_text(goal)} rejected: coordinates at most {FARTHEST:g} m"
    if abs(phi) > LARGEST_HEADING:
        return None, f"goal {_text(goal)} rejected: heading at most {LARGEST_HEADING:g} rad"
    return goal, ""


def _text(goal: Pose2) -> str:
    return f"({goal.x:.6g}, {goal.y:.6g}, {goal.phi:.6g})"


def surroundings_in(known: Surroundings, obstacles: Sequence[ArrayLike] | None, now: float) -> Surroundings:
    """The surroundings with these obstacles at `now` [s], or as known, and why they are not usable."""
    if obstacles is None:
        return known
    try:
        if known.tracked.are_given_again(obstacles, now):
            return known.given_again(now)
        outlines, problem = _outlines(obstacles)
        if not problem:
            return known.updated(outlines, now)
    except (RtiMpccError, *BAD_INPUT) as error:
        problem = f"obstacles not readable: {_line(error)}"
    return replace(known, unreadable=problem)


def _outlines(obstacles: Sequence[ArrayLike]) -> tuple[list[Array | Obstacle], str]:
    """The obstacles, bare ones as arrays, none farther than `FARTHEST`, and why they are unusable, or ""."""
    outlines: list[Array | Obstacle] = []
    try:
        given = list(obstacles)
    except TypeError:
        return outlines, f"obstacles: expected a sequence, got {type(obstacles).__name__}"
    for k, outline in enumerate(given):
        try:
            corners = np.asarray(outline, dtype=np.float64)
        except BAD_INPUT as error:
            return outlines, f"obstacles[{k}] not readable: {_line(error)}"
        outlines.append(outline if isinstance(outline, Obstacle) else corners)
        problem = _far_outline(corners)
        if problem:
            return outlines, f"obstacles[{k}] {problem}"
    return outlines, ""


def _far_outline(outline: Array) -> str:
    """Why the numbers of an outline cannot be used, or ""; whether it is one is for geometry to say."""
    odd = ~(np.abs(outline) <= FARTHEST)
    if outline.ndim == 0 or not odd.any():
        return ""
    value, corner = float(outline[odd][0]), int(np.argwhere(odd)[0, 0])
    why = f"not near, at most {FARTHEST:g} m" if isfinite(value) else "not finite"
    return f"{why}: {value:.6g} in corner {corner}"


def _line(error: Exception) -> str:
    return " ".join(str(error).split())


def measurements_in(measurements: Sequence[GoalMeasurement]) -> tuple[tuple[GoalMeasurement, ...], str]:
    """Those that are detections, and a remark on the first one that is not, or ""."""
    try:
        given = () if measurements is None else tuple(measurements)
    except TypeError:
        return (), f"measurements ignored: expected a sequence, got {type(measurements).__name__}"
    usable, remark = [], ""
    for k, each in enumerate(given):
        problem = _no_detection(each)
        if not problem:
            usable.append(each)
        elif not remark:
            remark = f"measurements[{k}] ignored: {problem}"
    return tuple(usable), remark


def _no_detection(given: object) -> str:
    """Why an input is no detection, or ""."""
    if not isinstance(given, GoalMeasurement):
        return f"expected GoalMeasurement, got {type(given).__name__}"
    v = given.vehicle
    try:
        pose = () if v is None else (v.x, v.y, v.phi)
        for number in (given.stamp, given.x, given.y, given.phi, *pose):
            isfinite(number)
        usable = isinstance(given.frame, Frame)
    except (AttributeError, *BAD_INPUT):
        usable = False
    return "" if usable else "not all of its values are numbers, poses or frames"


def timed(clock: ClockState, now: float, config: ControllerConfig) -> tuple[ClockState, str]:
    """The controller's clock at the user's `now` [s], and what is wrong with that, or "".

    It never runs back: if the user's clock does, or leaps ahead, or shows no number, one cycle counts as
    passed, and the two are `offset` apart from then on.
    """
    last, cycle = clock.now if clock.started else None, config.cycle
    if not _all_finite(now) or abs(now) > LATEST:
        own = 0.0 if last is None else last + cycle
        return replace(clock, now=own, started=True), f"the clock shows {now}"
    stood = clock.stood + 1 if now == clock.shown else 0
    own, offset, word = now + clock.offset, clock.offset, ""
    if stood >= STOOD_CYCLES:
        word = "the clock stands still"
    elif last is not None and not last <= own <= last + LEAP:
        word = f"the clock went {'back' if own < last else 'ahead'} by {abs(own - last):.3f} s"
    if word:
        own = cycle if last is None else last + cycle
        offset = own - now
    return ClockState(now=own, started=True, offset=offset, shown=float(now), stood=stood), word


def _all_finite(*values: float) -> bool:
    try:
        return all(map(isfinite, values))
    except BAD_INPUT:
        return False
