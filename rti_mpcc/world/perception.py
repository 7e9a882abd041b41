"""What is known after the inputs of one more cycle: of the vehicle, its surroundings, and its goal.

No input makes it raise: unusable ones are ignored, with a remark.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalPoseFilter, Judgement
from estimation.goal_filter import CLOCK_SKEW
from geometry import PathPart, Pose2, ReferencePath
from geometry.angles import degrees_hint
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.disturbance import UNDISTURBED, Disturbance
from rti_mpcc.model.layout import PHI
from rti_mpcc.types import GoalOrigin, VehicleState
from rti_mpcc.world import goal_setpoint, goals, inputs, vehicle
from rti_mpcc.world.monitor import StateMonitor, validate_measurement
from rti_mpcc.world.world import GoalState, W, World


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
        clock, clock_remark = inputs.timed(s.clock, given.now, config)
        area = inputs.surroundings_in(s.area, given.obstacles, clock.now)
        monitor = validate_measurement(
            last.monitor, given.measured, s.queue, clock.now, config, last.disturbance
        )
        records, answer = vehicle.compare_actuators(s, monitor, config)
        corrected = ""
        if answer != last.actuators:
            s, monitor, corrected = vehicle.correct_actuators(s, monitor, records, answer, config)
        known = vehicle.learnt(s, monitor, records[0], holds, config)
        if area.unreadable:
            monitor = monitor.doubting(area.unreadable, last.monitor)
        hint = last.heading_hint
        if hint or last.monitor.state is None:
            hint = _heading_hint(s, monitor, part)
        poses = last.poses
        if monitor.state is not None and not monitor.doubt:  # for detections that may still arrive
            length = config.goal_tracking.filter.history
            poses = poses.noted(clock.now, Pose2(*monitor.state[:3].tolist()), length=length)
        disturbance = last.disturbance  # what a hold has found stays until something else is learnt
        if known is not last.offsets:
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
            motion=s.vehicle.motion.noted(monitor, config),
        )
        known_goal, another = inputs.goal_in(given.goal, s.goal, path, area, config)
        if another is not None:
            known_goal = self.with_goal(known_goal, another)
        s = replace(s, clock=clock, area=area, vehicle=estimate, goal=known_goal)
        return s, (clock_remark, hint, corrected, *vehicle.sensor_remarks(monitor, known))

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
        """With the detections filtered and the setpoint moved; judgements, and a remark on other inputs."""
        measurements, unfit = inputs.measurements_in(given)
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
        goal = goal_setpoint.rate_limited_goal(s.goal, estimate, end, s.clock.now, self._config, fit)
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
