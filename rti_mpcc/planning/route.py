"""The active part of the route, and the phases on it: pure functions (memory, situation) -> memory."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

from geometry import Pose2
from rti_mpcc.config import ControllerConfig, Method
from rti_mpcc.model.delay import QueuedCommand, queued
from rti_mpcc.model.layout import THETA, V
from rti_mpcc.ocp.bounds import RETREAT_REACH
from rti_mpcc.planning.arrival import FLOOR, time_to_go, within_reach
from rti_mpcc.planning.guess import BACK_TIME, PASS
from rti_mpcc.planning.memory import ControllerMemory, Phase, PlanningContext, SuspendedSearch, renewed
from rti_mpcc.types import Trajectory

STANDSTILL_SPEED = 0.02
"""Below this speed the vehicle stands [m/s]."""
MOVING_SPEED = 0.04
"""A vehicle that stands is taken to stand until it is measured faster than this [m/s]: noise is no motion."""
DOUBT_TIME = 0.3
"""So long a vehicle that holds has to be measured just outside the tolerance to be outside [s]."""
STANDSTILL_TIME = 1.0
"""A vehicle that has stood so long [s] will not get nearer by waiting."""
TURNING_TIME = 5.0
"""The same where it may change its direction of motion on its way."""
OVERDUE = 4.0
"""An arrival that is still driven so long [s] after its time to go reached the floor will not get nearer."""
CUSP_TOLERANCE = (0.1, 0.1, 0.05235987755982989)
"""What counts as being at a cusp: longitudinal, lateral [m], heading [rad] (3 deg)."""
SETTLE_SHARE = 0.5
"""Share of the goal tolerance inside which a braked stop ends the arrival."""
SETTLE_TIME = 0.75
"""A braked stop that ends the arrival takes no longer than this [s]; until then the plan is driven."""
STOP_TOLERANCE = (0.2, 1.0, 0.5)
"""The same for a stop before something that fills the way."""
LEAST_SHARE = 0.5
"""A search for an arrival keeps its time as long as this share of what the way takes is left."""
LOOK_AGAIN = 0.5
"""Time between two looks whether the way is free again [s]."""
PATIENCE = 5.0
"""A vehicle that stands so long without a first plan [s] says that it failed, and looks less often."""
RESTARTS = 3
"""So often a vehicle that stopped outside the tolerance tries again."""
RETRY_TIME = 10.0
"""A vehicle that tries again takes at least so long [s]: it may have to back off first."""
RETREAT_SPEED = 0.3
"""Speed of backing off, or up into the goal, against the direction of the part [m/s]."""
LOST_CYCLES = 2.5
"""After a gap of more cycles than this an arrival gets the time again that its way takes."""
MOVED = 0.1
"""A target that has moved by more than this is a new arrival [m]."""


def decide(
    memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig
) -> ControllerMemory:
    """The phase of this cycle."""
    decided = _phase(memory, situation, config)
    # A stalled vehicle remembers what it stalled before: a target that creeps away is noticed.
    stays = memory.phase is Phase.STALLED and decided.phase is Phase.STALLED
    return renewed(decided, target=memory.target if stays else situation.target)


def _phase(
    memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig
) -> ControllerMemory:
    if memory.phase is Phase.HOLDING:
        return _held(memory, situation)
    if memory.phase is Phase.STALLED:
        elsewhere = _elsewhere(memory, situation)
        return renewed(restart(memory), restarts=0, pulled_out=0) if elsewhere else memory
    if memory.phase is Phase.SETTLING:
        return _settled(memory, situation)
    if memory.phase is Phase.STARTING:
        there = situation.inside(situation.error) and is_stationary(memory, situation)
        return renewed(memory, phase=Phase.HOLDING, outside_since=None) if there else memory
    stopping = situation.speed <= SETTLE_TIME * config.comfort_acceleration
    overdue = memory.overdue_since is not None and situation.now - memory.overdue_since >= OVERDUE
    if stopping and situation.inside(situation.stop_error, 1.0 if overdue else SETTLE_SHARE):
        return renewed(memory, phase=Phase.SETTLING)
    if overdue or _stuck(memory, situation):
        return _stalled(memory, situation, config)
    return _timed(memory, situation, config)


def drives(memory: ControllerMemory) -> bool:
    """Whether a plan is being driven."""
    return memory.phase in (Phase.CONTOURING, Phase.ARRIVING)


def arrival_due(memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig) -> bool:
    """Whether a contouring vehicle should turn to its arrival now."""
    return memory.phase is Phase.CONTOURING and _arrives(memory, situation, config)


def cartesian_due(memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig) -> bool:
    """Whether from here on only the goal pose is to count (`Method.SWITCHED`): by the way along the path."""
    if (
        memory.cartesian
        or config.method is not Method.SWITCHED
        or not (situation.last_part and situation.free)
    ):
        return False
    left = situation.target.stop - float(situation.state[THETA])
    return left <= config.weights.transition_reach


def too_late(memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig) -> bool:
    """Whether a contouring vehicle must brake now for a target that it has no arrival for yet."""
    needed = situation.speed**2 / (2.0 * config.comfort_acceleration)
    contouring = memory.phase is Phase.CONTOURING and not memory.cartesian
    return contouring and situation.way <= needed


def begin_phase(
    memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig
) -> ControllerMemory:
    """Choose between contouring and a planned arrival, for a vehicle about to begin one.

    A search that ran out of time goes on with what it was for, unless the target has moved since. While the
    vehicle stands nothing is lost meanwhile: its plan just begins later. While it drives another one, what is
    left may take longer than was thought: one that is far too short gets the time that it takes.
    """
    begun = memory.unfinished
    if begun is not None and apart(begun.target.pose, situation.target.pose) <= MOVED:
        if is_stationary(memory, situation):
            begun = _later(begun, situation.begin - begun.begin)
        elif begun.arrive_at is not None:
            duration = _duration(situation, config)
            if begun.arrive_at - situation.begin < LEAST_SHARE * duration:
                begun = replace(begun, arrive_at=situation.begin + duration)
        return renewed(
            memory,
            unfinished=begun,
            arrive_at=begun.arrive_at,
            reverse_into_goal=begun.reverse_into_goal,
            timed_for=situation.target.pose,
            overdue_since=None,
        )
    memory = renewed(memory, unfinished=None, reverse_into_goal=False)
    if not _arrives(memory, situation, config):
        return renewed(memory, arrive_at=None, overdue_since=None)
    duration = _duration(situation, config)
    if _beside(memory, situation):
        memory = renewed(memory, restarts=max(memory.restarts, 1))
    if memory.restarts > 0:
        duration = max(duration, RETRY_TIME)
    return renewed(
        memory,
        arrive_at=situation.begin + duration,
        timed_for=situation.target.pose,
        overdue_since=None,
    )


def begin_reverse(
    memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig
) -> ControllerMemory | None:
    """The same for an arrival that passes the goal and backs up into it; None: there is none to begin."""
    if not (recovery_enabled(config) and situation.last_part and situation.free):
        return None
    begun = memory.unfinished
    if begun is not None and not begun.reverse_into_goal:
        # It was for an arrival onward, which was found meanwhile.
        memory = renewed(memory, unfinished=None)
    memory = begin_phase(memory, situation, config)
    if memory.arrive_at is None or memory.reverse_into_goal:
        return memory if memory.reverse_into_goal else None
    duration = _duration(situation, config, beyond=PASS) + BACK_TIME
    return renewed(memory, reverse_into_goal=True, arrive_at=situation.begin + duration)


def recovery_enabled(config: ControllerConfig) -> bool:
    """Whether a goal that is missed is made for by other ways: the paper's objectives stall as they did."""
    return config.arrival and config.method is Method.DYNAMIC


def is_stationary(memory: ControllerMemory, situation: PlanningContext, seconds: float = 0.0) -> bool:
    """Whether the vehicle has been standing for `seconds`."""
    since = memory.standing_since
    return since is not None and situation.now - since >= seconds


def restart(memory: ControllerMemory) -> ControllerMemory:
    """Begin the active part again from where the vehicle is."""
    return renewed(
        memory,
        phase=Phase.STARTING,
        unfinished=None,
        solution=None,
        fit=None,
        driven=None,
        accepted_at=None,
        arrive_at=None,
        reverse_into_goal=False,
        overdue_since=None,
        outside_since=None,
    )


def found(memory: ControllerMemory) -> ControllerMemory:
    """The vehicle is not where it was believed to be, or was not heard of for long: a plan begins afresh.

    One that holds or brakes to rest at its target goes on with that while it is inside the tolerance.
    """
    if memory.phase in (Phase.HOLDING, Phase.SETTLING):
        return renewed(memory, reached=None)
    return renewed(restart(memory), reached=None)


def replan_due(memory: ControllerMemory, situation: PlanningContext) -> bool:
    """Whether a vehicle that stands blocked should look for a plan in this cycle, or goes on looking."""
    if memory.unfinished is not None:
        return True
    return memory.looked_at is None or not 0.0 <= situation.now - memory.looked_at < LOOK_AGAIN


def begun(memory: ControllerMemory, situation: PlanningContext) -> ControllerMemory:
    """A first plan was found: drive it."""
    phase = Phase.CONTOURING if memory.arrive_at is None else Phase.ARRIVING
    return renewed(memory, phase=phase, driving_since=situation.now, unfinished=None)


def accepted(memory: ControllerMemory, plan: Trajectory, situation: PlanningContext) -> ControllerMemory:
    """A plan was accepted for driving: nothing holds the vehicle any more."""
    return renewed(
        memory,
        fit=plan,
        driven=plan,
        accepted_at=situation.now,
        latched="",
        looked_at=None,
        looks_past=False,
    )


def braked(
    memory: ControllerMemory, acceleration: float, reason: str, config: ControllerConfig
) -> ControllerMemory:
    """Nothing is kept of a cycle that went wrong but that the vehicle was braked in it."""
    sent = QueuedCommand(memory.now + config.dead_time, acceleration, 0.0)
    queue = queued(memory.queue, sent, memory.now)
    return renewed(restart(memory), queue=queue, latched=reason, reached=None)


def noticed(memory: ControllerMemory, situation: PlanningContext) -> ControllerMemory:
    """Keep since when the vehicle stands."""
    speed = max(abs(situation.measured_speed), abs(float(situation.state[V])))
    stood = memory.standing_since
    standing = speed <= (STANDSTILL_SPEED if stood is None else MOVING_SPEED)
    since = situation.now if stood is None else stood
    return renewed(memory, standing_since=since if standing else None)


def _held(memory: ControllerMemory, situation: PlanningContext) -> ControllerMemory:
    """Hold on unless the target is clearly elsewhere."""
    if not situation.free or situation.inside(situation.error):
        return renewed(memory, outside_since=None)
    return _outside(memory, situation)


def _outside(memory: ControllerMemory, situation: PlanningContext) -> ControllerMemory:
    """A vehicle that stands outside the tolerance begins again: noise may show it just there for a moment."""
    since = situation.now if memory.outside_since is None else memory.outside_since
    just_now = situation.now - since < DOUBT_TIME
    if just_now and situation.inside(situation.error, 2.0):
        return renewed(memory, outside_since=since)
    return restart(memory)


def _settled(memory: ControllerMemory, situation: PlanningContext) -> ControllerMemory:
    if not is_stationary(memory, situation):
        # It will stop outside: the target has moved away while braking.
        return memory if situation.inside(situation.stop_error) else restart(memory)
    if situation.free and not situation.inside(situation.error):
        return _outside(memory, situation)
    return renewed(memory, phase=Phase.HOLDING, restarts=0, outside_since=None)


def _arrives(memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig) -> bool:
    """Whether one planned arrival is to bring the vehicle to its target from here."""
    if not config.arrival or memory.cartesian or (config.method is Method.SWITCHED and situation.last_part):
        return False
    theta = float(situation.state[THETA])
    return within_reach(situation.way, situation.speed, config, situation.pace, theta)


def _duration(situation: PlanningContext, config: ControllerConfig, beyond: float = 0.0) -> float:
    """What the arrival, or one so much beyond the target [m], takes from here [s]."""
    way = situation.way + beyond
    highest = situation.pace.ahead(float(situation.state[THETA]), way)
    return time_to_go(way, situation.speed, config.arrival_acceleration, highest)


def _beside(memory: ControllerMemory, situation: PlanningContext) -> bool:
    """Whether the vehicle stands so near its target, and beside it, that it has to back off to get there."""
    error, (_, across, heading) = situation.error, situation.tolerance
    near = hypot(error.x, error.y) <= RETREAT_REACH
    return near and is_stationary(memory, situation) and (abs(error.y) > across or abs(error.phi) > heading)


def _stuck(memory: ControllerMemory, situation: PlanningContext) -> bool:
    """Whether the vehicle stands for good: an arrival with time to go may begin slowly, or turn about."""
    standing = is_stationary(memory, situation, TURNING_TIME if memory.cartesian else STANDSTILL_TIME)
    on_its_way = memory.arrive_at is not None and memory.overdue_since is None
    return standing and not on_its_way and situation.now - memory.driving_since > STANDSTILL_TIME


def _stalled(
    memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig
) -> ControllerMemory:
    if not situation.free or situation.inside(situation.error):
        return renewed(memory, phase=Phase.HOLDING, restarts=0)
    # Without a planned arrival another try is the same again: only an arrival backs off and comes back.
    if memory.restarts >= (RESTARTS if config.arrival else 0):
        return renewed(memory, phase=Phase.STALLED)
    return renewed(restart(memory), restarts=memory.restarts + 1)


def retreat(memory: ControllerMemory, situation: PlanningContext) -> float:
    """Speed allowed near the target against the part's direction [m/s]: to back up into it, or try again."""
    near = hypot(situation.error.x, situation.error.y) <= RETREAT_REACH
    return RETREAT_SPEED if memory.reverse_into_goal or (memory.restarts > 0 and near) else 0.0


def _timed(
    memory: ControllerMemory, situation: PlanningContext, config: ControllerConfig
) -> ControllerMemory:
    """Let the time to the arrival fall, but not below the floor; a target that moves is a new arrival.

    A vehicle that halts, or lost cycles, gets the time again that its way takes.
    """
    if memory.phase is Phase.CONTOURING:
        return memory
    assert memory.arrive_at is not None
    begin = situation.begin
    moved = memory.timed_for is None or apart(memory.timed_for, situation.target.pose) > MOVED
    lost = bool(memory.queue) and begin - memory.queue[-1].begins > LOST_CYCLES * config.cycle
    if moved or lost or memory.halt is not None:
        due = begin + _duration(situation, config)
        # One that backs up may be past its goal, and has no way left but time to take.
        arrive_at = due if moved and not memory.reverse_into_goal else max(due, memory.arrive_at)
        timed_for = situation.target.pose if moved else memory.timed_for
        return renewed(memory, arrive_at=arrive_at, timed_for=timed_for, overdue_since=None)
    if memory.arrive_at >= begin + FLOOR:
        return renewed(memory, overdue_since=None)
    since = situation.now if memory.overdue_since is None else memory.overdue_since
    return renewed(memory, arrive_at=begin + FLOOR, overdue_since=since)


def _elsewhere(memory: ControllerMemory, situation: PlanningContext) -> bool:
    """Whether the target is no longer where the vehicle stalled before it."""
    if memory.target is None:
        return True
    return not situation.inside(situation.target.pose.relative_to(memory.target.pose), SETTLE_SHARE)


def _later(begun: SuspendedSearch, seconds: float) -> SuspendedSearch:
    """The same search for a plan that begins so much later [s]."""
    solution, arrive_at = begun.solution, begun.arrive_at
    if solution is not None:
        plan = replace(solution.trajectory, times=solution.trajectory.times + seconds)
        solution = replace(solution, trajectory=plan)
    return replace(
        begun,
        solution=solution,
        arrive_at=None if arrive_at is None else arrive_at + seconds,
        begin=begun.begin + seconds,
    )


def apart(one: Pose2, other: Pose2) -> float:
    """Distance [m]."""
    return hypot(one.x - other.x, one.y - other.y)
