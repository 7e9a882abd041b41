"""A vehicle that is held where it docked: a position loop along the body's axis, with the wheels still.

(H1)  u = -k_p e - k_d v + i,   di/dt = -k_i e - k_b b

u is what is commanded, e [m] how far the vehicle is ahead of its anchor, v its speed, both when the command
starts to act. i balances what acts besides: a slope, or the creep torque of a drive. For as long as the
vehicle is held, i takes the place of the estimated disturbance: if the drive lags, that estimate follows the
loop's own motion. Among noisy poses, where the speed is not measured, e, v and b are those of (W4), see
`standstill.SlowMotion`; else b is 0. The gains are those of a triple pole for a drive that lags by
`DESIGN_LAG`. They are stable up to a lag of more than twice that.
"""

from __future__ import annotations

import logging
from dataclasses import replace
from math import degrees, hypot, inf
from typing import Final

from estimation.odometry import AT
from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import conditions
from rti_mpcc.course.context import PlanningContext
from rti_mpcc.drive.fallback import SETTLING_TIME, ControlInput
from rti_mpcc.model.layout import POSE, V
from rti_mpcc.state import ControllerState, Hold, Phase
from rti_mpcc.types import Source
from rti_mpcc.world import standstill
from rti_mpcc.world.standstill import UNKNOWN_LAG

_log = logging.getLogger(__name__)

DESIGN_LAG: Final = 0.2  # [s]
K_D: Final = 1.0 / (3.0 * DESIGN_LAG)  # [1/s]
K_P: Final = DESIGN_LAG * K_D**3  # [1/s²]
K_I: Final = 0.5 * K_P * K_D / 3.0  # [1/s³]
K_B: Final = 0.5  # [1/s]: b is corrected more slowly than it is found
LEVEL = 0.03  # [m/s²]; a smaller disturbance is no slope: then the gain of the drive is known
USUAL_GAIN = 0.2  # by which the drive may answer too strongly or weakly, to be docked at once
STOOD_SHARE = 0.35  # of what a docked vehicle may move, that it may still move by what has not come to rest
ANCHOR_SHARE = 0.5  # of the tolerance, within which the vehicle is held
STEADY_LAG = 0.01  # [s]; of a vehicle that stood by steady commands none has to be reckoned with
LARGEST_INTEGRAL = 1.5  # [m/s²], a slope of 15 %
STAYING = (Phase.HOLDING, Phase.STALLED, Phase.PLANNING, Phase.WAITING)
"""Phases in which a vehicle that stands does not drive off in the next cycle."""
PROOF_TIMES = (1.0, 1.5, 2.0, 2.3)  # [s]; longer ones are not in a track
KNOWN_ACCELERATION = 0.03  # [m/s²], standard deviation up to which an acceleration by poses is heeded
FASTEST = 0.3  # [m/s]; a faster vehicle is braked, not held


def start_hold(s: ControllerState, context: PlanningContext) -> ControllerState:
    """With the hold of a vehicle that stands at its goal, started in this cycle or earlier."""
    hold = _kept(s) or _begun(s, context, ANCHOR_SHARE * context.tolerance[0])
    if hold.docked is None and context.inside(context.standing_error):
        if _stays_at_once(hold, s, context):
            hold = replace(hold, docked=context.standing_error)
        elif _has_stood(hold, s, context):  # it is held right there
            here = hold.anchor.compose(Pose2(_ahead(hold, s, context), 0.0, 0.0))
            integral = _balancing(s, lag=STEADY_LAG)
            hold = replace(hold, docked=context.standing_error, anchor=here, integral=integral)
    if hold.docked is None and s.clock.now - hold.balanced >= standstill.WINDOW - 1e-9:
        # By half, so that it does not swing with a drive that lags.
        beside, std = s.vehicle.motion.beside()
        told = std <= KNOWN_ACCELERATION and not _may_be_noise(hold, s, beside, std)
        integral = 0.5 * (hold.integral - beside) if told else hold.integral
        hold = replace(hold, integral=integral, balanced=s.clock.now)
    return s if hold is s.task.hold else replace(s, task=replace(s.task, hold=hold))


def hold_here(s: ControllerState, context: PlanningContext) -> ControllerState:
    """With the hold of a vehicle that is commanded to stand: where it is held already, or has come to rest.

    One that is elsewhere, as it was moved or relocalised, stays there.
    """
    hold, here = _kept(s), Pose2(*context.state[:POSE].tolist())
    if hold is None:
        config, stands = context.config, s.vehicle.is_stationary(s.clock.now, standstill.PROOF_TIME)
        rests = stands and abs(context.acceleration) <= config.comfort.jerk * config.cycle
        hold = _begun(s, context) if rests else None
    elif hypot(here.x - hold.anchor.x, here.y - hold.anchor.y) > conditions.swing(context):
        hold = replace(hold, anchor=_anchor(context), docked=None)
    return s if hold is s.task.hold else replace(s, task=replace(s.task, hold=hold))


def _kept(s: ControllerState) -> Hold | None:
    """The hold of the last cycle, or None. Where the pose has jumped, the vehicle stands as it stood."""
    hold, off = s.task.hold, s.vehicle.motion.jump()
    if hold is None or off == 0.0:
        return hold
    return replace(hold, anchor=hold.anchor.compose(Pose2(off, 0.0, 0.0)))


def _begun(s: ControllerState, context: PlanningContext, most: float = inf) -> Hold:
    """A hold that starts in this cycle, at most so far from the target [m], see `_anchor`."""
    integral, now = _balancing(s), s.clock.now
    off = abs(s.vehicle.disturbance.commanded(0.0) - integral)
    anchor = _anchor(context, most)
    return Hold(anchor=anchor, since=now, integral=integral, balanced=now, corrected_by=off)


def _stays_at_once(hold: Hold, s: ControllerState, context: PlanningContext) -> bool:
    """Whether a vehicle that has just come to rest moves as commanded, and stays near its anchor even if its
    drive lags by `UNKNOWN_LAG`."""
    motion, most = s.vehicle.motion, standstill.rest_distance(context.tolerance, context.config)
    surprise = max(motion.unexplained() * UNKNOWN_LAG, motion.surprise() * UNKNOWN_LAG**2)
    if s.clock.now - hold.since > standstill.SLIP_TIME or surprise > most:
        return False
    # An error of the estimated disturbance moves the vehicle by less than half of that.
    if hold.corrected_by > 0.5 * K_P * most or s.vehicle.monitor.sensors.speed.problem:
        return False
    beside, std = motion.beside()
    if std <= KNOWN_ACCELERATION and abs(beside + hold.integral) > 0.5 * K_P * most + standstill.NOISE * std:
        return False
    if s.vehicle.records[0].corrected and motion.seconds < standstill.WINDOW - 1e-9:
        return False  # how it moves by the corrected drive is not known yet
    if abs(s.vehicle.disturbance.gain - 1.0) > USUAL_GAIN:
        return False  # it does not drive as it was told to: at rest, neither
    speed = max(abs(context.measured_speed), abs(float(context.state[V])))
    rolls = speed * (context.start_time - context.now + UNKNOWN_LAG)
    return s.vehicle.motion.unseen == 0.0 and abs(_ahead(hold, s, context)) + rolls <= most


def _has_stood(hold: Hold, s: ControllerState, context: PlanningContext) -> bool:
    """Whether the vehicle has stood for `PROOF_TIME`, well inside the tolerance, and its commands have hardly
    changed: what a drive that lags still makes of them moves the vehicle against `K_P`."""
    motion, most = s.vehicle.motion, STOOD_SHARE * standstill.rest_distance(context.tolerance, context.config)
    if min(s.clock.now - hold.since, motion.seconds) < standstill.PROOF_TIME - 1e-9:
        return False
    if motion.slow is not None and not _stands_by_poses(hold, s, most):
        return False
    noise, now = standstill.NOISE * motion.noise.along, _speed(s, context)
    # Where a swing begins, the mean speed is still small.
    swings = abs(now) - (standstill.NOISE * motion.noise.speed if motion.slow is None else 0.0)
    speed = max(motion.speed_beyond_noise(standstill.SLIP_TIME), swings)
    slow = speed * (context.start_time - context.now + UNKNOWN_LAG) <= most
    steady = abs(motion.still_coming()) <= K_P * (most + noise)
    still = motion.spread(standstill.PROOF_TIME) <= most + 2.0 * noise
    off = max(abs(context.error.x), abs(context.standing_error.x))
    return slow and steady and still and off <= standstill.DOCK_SHARE * context.tolerance[0]


def _stands_by_poses(hold: Hold, s: ControllerState, most: float) -> bool:
    """Whether the noisy poses of a time that is long enough to tell show no motion by which the vehicle would
    move by `most` [m] within `UNKNOWN_LAG`."""
    track, noise = s.vehicle.monitor.sensors.track, s.vehicle.motion.noise.along
    assert track is not None
    stood = min(s.clock.now - hold.since, float(track[-1, AT] - track[0, AT]))
    for seconds in PROOF_TIMES:
        speed, std = standstill.drift(track, seconds, noise)
        uncertain = standstill.NOISE * std
        if uncertain * UNKNOWN_LAG <= most:
            break
    return stood >= seconds - 1e-9 and (abs(speed) - uncertain) * UNKNOWN_LAG <= most


def stays_put(s: ControllerState) -> bool:
    """Whether the vehicle is to stay where it stands, so that a brake may be set."""
    hold = s.task.hold
    if hold is not None and hold.docked is not None:
        return True
    settles = hold is not None and s.task.phase is Phase.HOLDING and not s.vehicle.monitor.doubt
    stands = s.vehicle.is_stationary(s.clock.now, standstill.PROOF_TIME)
    return s.task.phase in STAYING and stands and not settles


def undocked(context: PlanningContext) -> str:
    """The remark in the cycle in which a docked vehicle is no longer docked."""
    far, turned = hypot(context.error.x, context.error.y), degrees(abs(context.error.phi))
    said = f"no longer docked: the vehicle is {far:.3f} m and {turned:.1f} deg from the goal"
    _log.info("%s", said)
    return said


def not_dead_reckoned(s: ControllerState) -> ControllerState:
    """A docked vehicle that a brake holds is not reckoned to move, whatever it is commanded."""
    if s.vehicle.motion.spread() > 0.0:
        return s
    monitor = replace(s.vehicle.monitor, dead_reckoned=s.vehicle.monitor.measured)
    return replace(s, vehicle=replace(s.vehicle, monitor=monitor))


def _anchor(context: PlanningContext, most: float = inf) -> Pose2:
    """Where the vehicle comes to rest, drawn along its axis to `most` [m] from the target."""
    ahead = context.error.x
    rest = ahead + float(context.state[V]) * SETTLING_TIME
    here = Pose2(*context.state[:POSE].tolist())
    return here.compose(Pose2(min(max(rest, -most), most) - ahead, 0.0, 0.0))


def _ahead(hold: Hold, s: ControllerState, context: PlanningContext) -> float:
    """How far the vehicle is ahead of its anchor along its axis [m]."""
    ahead, motion = Pose2(*context.state[:POSE].tolist()).relative_to(hold.anchor).x, s.vehicle.motion
    if motion.slow is None:
        return ahead
    faster = motion.slow.faster - motion.unseen  # than what the state was predicted with
    return ahead + motion.slow.ahead + faster * (context.start_time - context.now)


def _balancing(s: ControllerState, lag: float = UNKNOWN_LAG) -> float:
    """Acceleration to be commanded [m/s²] at which the vehicle stays as it is.

    By the last moments, or, if they are too noisy, by how the estimate answers the last command.

    A vehicle that brakes evenly on a slope does not tell the slope from the drive's gain; for a small step
    from the last command the gain hardly matters.
    """
    disturbance = s.vehicle.disturbance
    if abs(disturbance.acceleration) <= LEVEL and s.task.hold is None:
        return disturbance.commanded(0.0)
    beside, std = s.vehicle.motion.beside(lag)
    hold = s.task.hold
    if hold is not None and _may_be_noise(hold, s, beside, std):
        return hold.integral
    if std <= KNOWN_ACCELERATION:
        return -beside
    lately = s.queue[-1].acceleration if s.queue else 0.0
    return lately - disturbance.acting(lately)


def _may_be_noise(hold: Hold, s: ControllerState, beside: float, std: float) -> bool:
    """Whether noisy poses explain that an acceleration [m/s²] is not the one that is balanced."""
    return s.vehicle.motion.slow is not None and abs(beside + hold.integral) <= standstill.NOISE * std


def balanced(s: ControllerState, hold: Hold, config: ControllerConfig) -> ControllerState:
    """Held: what acts besides is what the hold balances."""
    known = s.vehicle.disturbance
    if config.disturbance.enabled:
        known = known._replace(acceleration=-known.gain * hold.integral)
    return replace(s, task=replace(s.task, hold=hold), vehicle=replace(s.vehicle, disturbance=known))


def _speed(s: ControllerState, context: PlanningContext) -> float:
    """Speed [m/s], also a slow one that is not measured, if the poses are good enough to tell."""
    motion, speed = s.vehicle.motion, float(context.state[V])
    if motion.slow is not None:
        return speed - motion.unseen + motion.slow.faster
    beside, std = motion.by_poses(context.config)
    known = standstill.NOISE * std <= standstill.least_unseen(context.config)
    return speed - s.vehicle.motion.unseen + beside if known else speed


def control(hold: Hold, s: ControllerState, context: PlanningContext) -> tuple[ControlInput, Hold]:
    """(H1): the control that holds the vehicle at its anchor, and the hold with its integral."""
    config, e, v = context.config, _ahead(hold, s, context), _speed(s, context)
    stays = hold.docked is not None or s.task.phase is Phase.WAITING
    if stays and s.vehicle.motion.spread() == 0.0:
        # Not even by noise: a brake holds it. What it is commanded is not to look like a motion.
        hold = replace(hold, integral=s.vehicle.disturbance.commanded(0.0))
        return ControlInput(0.0, 0.0, Source.STANDSTILL), hold
    slow = s.vehicle.motion.slow
    integral = hold.integral - (K_I * e + (0.0 if slow is None else K_B * slow.beside)) * config.cycle
    integral = min(max(integral, -LARGEST_INTEGRAL), LARGEST_INTEGRAL)
    most = config.limits.acceleration
    commanded = min(max(integral - K_P * e - K_D * v, -most), most)
    # The brakes are released evenly.
    before, step = context.acceleration, config.comfort.jerk * config.cycle
    acting = min(max(s.vehicle.disturbance.acting(commanded), before - step), before + step)
    return ControlInput(acting, 0.0, Source.STANDSTILL), replace(hold, integral=integral)
