"""What acts on the vehicle beside its commands, and where they take it."""

from __future__ import annotations

from estimation import DisturbanceEstimate
from estimation.actuators import ActuatorRecord, mean_rate
from estimation.disturbance import Motion, first_estimate, unseated, updated
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.delay import mean_rates, roll_forward
from rti_mpcc.model.layout import DELTA, PHI, V
from rti_mpcc.types import Array
from rti_mpcc.world.monitor import StateMonitor
from rti_mpcc.world.world import World

OFFSET_REPORTED = 0.02  # [rad]; an offset of the steering larger by two standard deviations is told


def predicted(s: World, at: float, config: ControllerConfig) -> Array:
    """The estimate predicted to `at` [s] by the commands, with the steering that acts."""
    estimate, known = s.vehicle.monitor.state, s.vehicle.disturbance
    assert estimate is not None
    unseen = s.vehicle.motion.unseen
    if unseen:
        estimate = estimate.copy()
        estimate[V] += unseen
    return known.effective(roll_forward(estimate, s.queue, s.clock.now, at, config, known))


def learnt(
    s: World, monitor: StateMonitor, drive: ActuatorRecord, holds: bool, config: ControllerConfig
) -> DisturbanceEstimate | None:
    """The disturbance after this cycle's measurement; nothing is learnt from one whose speed is doubted.

    A relocalised vehicle starts anew, as another disturbance may act there.
    `s`: of the last cycle, with the commands sent up to then; `monitor`, `drive`: with this measurement;
    `holds`: the vehicle is held at its dock.
    """
    if monitor.measured is None or not config.disturbance.enabled:
        return s.vehicle.offsets
    before = s.vehicle.offsets or first_estimate(config.disturbance)
    if monitor.relocalised or (monitor.doubt and not _moves_as_measured(monitor)):
        return unseated(before)
    if holds:
        return s.vehicle.offsets  # (H1) balances what acts
    state, now = monitor.measured, monitor.at
    if before.at is not None and now - before.at > config.longest_cycle:
        before = unseated(before)  # a watchdog may have driven
    asked = 0.0 if before.at is None else _acted(s, drive, before.at, now)
    motion = Motion(v=float(state[V]), phi=float(state[PHI]), delta=float(state[DELTA]))
    turns = not monitor.sensors.speed.problem and s.vehicle.motion.unseen == 0.0
    return updated(before, motion, now, asked, config.vehicle.wheelbase, config.disturbance, turns=turns)


def sensor_remarks(monitor: StateMonitor, known: DisturbanceEstimate | None) -> tuple[str, ...]:
    """What is said of sensors that the estimate does without, or corrects."""
    offset = 0.0 if known is None else known.steering
    told = known is not None and abs(offset) > OFFSET_REPORTED + 2.0 * known.stds[1]
    beside = f"steering sensor is {-offset:+.2f} rad off: it is corrected" if told else ""
    return (*monitor.sensors.remarks, beside)


def _acted(s: World, drive: ActuatorRecord, begin: float, end: float) -> float:
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
