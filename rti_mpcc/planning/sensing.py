"""From a measurement to the situation that a cycle plans in, and to what acts beside the commands."""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign, hypot, pi

import numpy as np

from estimation import DisturbanceEstimate
from estimation.actuators import ActuatorRecord, mean_rate
from estimation.disturbance import Motion, first_estimate, unseated, updated
from geometry import PathPart, Pose2, lift
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import SegmentEnd
from rti_mpcc.model.bicycle import step_one
from rti_mpcc.model.delay import mean_rates
from rti_mpcc.model.layout import DELTA, PHI, THETA, V, X, Y
from rti_mpcc.ocp.bounds import PASSED_DISTANCE
from rti_mpcc.ocp.targets import Target
from rti_mpcc.planning import route_start
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.plausibility import StateMonitor, by_commands
from rti_mpcc.planning.speed_profile import ComfortSpeeds
from rti_mpcc.planning.state import ControllerState
from rti_mpcc.types import Array

OFF_PATH = 100.0  # [m]; a vehicle farther from its path is taken to be on another one
MEAN_TIME = 1.0  # [s] over which the pose of a docked vehicle is averaged
OFFSET_REPORTED = 0.02  # [rad]; an offset of the steering larger by two standard deviations is told
PROGRESS_STEP = 2.0  # [m] by which the progress may move in a cycle


def start_of(s: ControllerState, part: PathPart, config: ControllerConfig) -> Array:
    """The predicted state (6,) when a command given now starts to act, on the part; before the first
    measurement the start of the part."""
    if s.vehicle.monitor.state is None:
        first = part.first
        return np.array([first.x, first.y, first.phi, 0.0, 0.0, part.start])
    start = predicted(s, s.now + s.vehicle.dead_time, config)
    _place_on_route(start, s.start_state, part)
    return start


def predicted(s: ControllerState, at: float, config: ControllerConfig) -> Array:
    """The estimate predicted to `at` [s] by the commands, with the steering that acts."""
    estimate, known = s.vehicle.monitor.state, s.vehicle.disturbance
    assert estimate is not None
    unseen = s.vehicle.motion.unseen(config)
    if unseen:
        estimate = estimate.copy()
        estimate[V] += unseen
    return known.effective(by_commands(estimate, s.queue, s.now, at, config, known))


def context_of(
    s: ControllerState, reached: Array, profile: ComfortSpeeds, target: Target, config: ControllerConfig
) -> PlanningContext:
    """The state `reached` (6,), in which the command of this cycle begins to act, against path and target."""
    monitor, now, task = s.vehicle.monitor, s.now, s.task
    state, part = reached.tolist(), task.segment.part
    x, y, phi, v, _, theta = state
    here, on_path = Pose2(x, y, phi), part.pose(theta)
    along, distance = distance_left(here, theta, on_path, part, target)
    error, off = here.relative_to(target.pose), hypot(here.x - on_path.x, here.y - on_path.y)
    start = now + s.vehicle.dead_time
    acting = s.sent[-1].acting(start, s.vehicle.actuators)[0] if s.sent else None
    stands = route_start.here(s, config) if s.is_stationary and monitor.state is not None else here
    if s.task.hold is not None and s.task.hold.docked is not None:
        stands = s.vehicle.poses.mean(max(s.task.hold.since, now - MEAN_TIME)) or here
    return PlanningContext(
        now=now,
        start_time=start,
        state=reached,
        acceleration=0.0 if acting is None else s.vehicle.disturbance.acting(acting),
        measured_speed=0.0 if monitor.state is None else float(monitor.state[V]),
        doubt=monitor.doubt or (f"{off:.4g} m off the path" if off > OFF_PATH else ""),
        target=target,
        direction=part.direction,
        ends_at_goal=task.end is SegmentEnd.GOAL,
        free=task.end is not SegmentEnd.STOP,
        along=along,
        distance=distance,
        speed=max(part.direction * v, 0.0),
        profile=profile,
        error=error,
        standing_error=error if stands is here else stands.relative_to(target.pose),
        stop_error=_stopped(state, config).relative_to(target.pose),
        tolerance=task.tolerance,
        half_turn=pi / config.max_curvature,
    )


def _place_on_route(reached: Array, last: Array | None, part: PathPart) -> None:
    """Set the progress and the branch of the heading, both nearest to the last ones; before the start of the
    part the progress counts along the path extrapolated straight."""
    x, y, phi, *_ = reached.tolist()
    if last is None:
        theta = part.project(x, y, heading=phi)
        heading = part.pose(theta).phi
    else:
        near = max(float(last[THETA]), part.start)
        theta = part.project(x, y, near=near, reach=PROGRESS_STEP)
        heading = float(last[PHI])
    if theta <= part.start:
        theta += min(part.direction * Pose2(x, y, phi).relative_to(part.first).x, 0.0)
    reached[THETA] = theta
    reached[PHI] = lift(phi, heading)


def distance_left(
    here: Pose2, theta: float, on_path: Pose2, part: PathPart, target: Target
) -> tuple[float, float]:
    """Distance left [m] from a pose at `theta` [m], where the path is `on_path`: along the path, negative if
    the target was passed; and with that across, 0 if it was passed by more than `PASSED_DISTANCE`."""
    at_target, offset = part.pose(target.theta), here.relative_to(on_path)
    along = target.theta - theta - part.direction * offset.x
    across = target.pose.relative_to(at_target).y - offset.y
    distance = hypot(along, across)
    return along, distance if along > 0.0 or distance < PASSED_DISTANCE else 0.0


def _stopped(state: Sequence[float], config: ControllerConfig) -> Pose2:
    """Where the vehicle stops from `state` (6,) at the comfort acceleration, steering held."""
    most, speed = config.comfort_acceleration, state[V]
    braking, seconds = -copysign(most, speed), abs(speed) / most
    stopped = step_one(braking, 0.0, 0.0, seconds, config.vehicle.wheelbase, *state)
    return Pose2(stopped[X], stopped[Y], stopped[PHI])


def learnt(
    s: ControllerState, monitor: StateMonitor, drive: ActuatorRecord, config: ControllerConfig
) -> DisturbanceEstimate | None:
    """The disturbance after this cycle's measurement; nothing is learnt from one whose speed is doubted.

    A relocalised vehicle starts anew, as another disturbance may act there.
    `s`: of the last cycle, with the commands sent up to then; `monitor`, `drive`: with this measurement.
    """
    if monitor.measured is None or not config.disturbance.enabled:
        return s.vehicle.offsets
    before = s.vehicle.offsets or first_estimate(config.disturbance)
    if monitor.relocalised or (monitor.doubt and not _moves_as_measured(monitor)):
        return unseated(before)
    if s.task.hold is not None:
        return s.vehicle.offsets  # (H1) balances what acts
    state, now = monitor.measured, monitor.at
    if before.at is not None and now - before.at > config.longest_cycle:
        before = unseated(before)  # a watchdog may have driven
    asked = 0.0 if before.at is None else _acted(s, drive, before.at, now)
    motion = Motion(v=float(state[V]), phi=float(state[PHI]), delta=float(state[DELTA]))
    turns = not monitor.sensors.speed.problem and s.vehicle.motion.unseen(config) == 0.0
    return updated(before, motion, now, asked, config.vehicle.wheelbase, config.disturbance, turns=turns)


def sensor_remarks(monitor: StateMonitor, known: DisturbanceEstimate | None) -> tuple[str, ...]:
    """What is said of sensors that the estimate does without, or corrects."""
    offset = 0.0 if known is None else known.steering
    told = known is not None and abs(offset) > OFFSET_REPORTED + 2.0 * known.stds[1]
    beside = f"steering sensor is {-offset:+.2f} rad off: it is corrected" if told else ""
    return (*monitor.sensors.remarks, beside)


def _acted(s: ControllerState, drive: ActuatorRecord, begin: float, end: float) -> float:
    """Mean of the acceleration that the commands made [m/s²], with a lag that is suspected."""
    suspected = None if drive.suspected is None else mean_rate(drive, drive.suspected, begin, end)
    return mean_rates(s.queue, begin, end)[0] if suspected is None else suspected


def _moves_as_measured(monitor: StateMonitor) -> bool:
    """Whether only the place of a doubted measurement is doubted."""
    measured, state = monitor.measured, monitor.state
    if measured is None or state is None or monitor.steering_fault or monitor.odd_since is not None:
        return False
    if monitor.sensors.pose:
        return False
    return monitor.dead_reckoned is measured and bool((state[[V, DELTA]] == measured[[V, DELTA]]).all())
