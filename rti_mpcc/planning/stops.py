"""Stops before what fills the way: pure functions (memory, situation) -> memory."""

from __future__ import annotations

from dataclasses import replace

from rti_mpcc.config import Caution
from rti_mpcc.model.layout import THETA
from rti_mpcc.planning.memory import ControllerMemory, Halt, Phase, PlannedStop, PlanningContext, renewed
from rti_mpcc.planning.route import LOOK_AGAIN, MOVED, apart, is_stationary, restart

NEAR_STOP = 0.2
"""A vehicle that stands this near to such a stop stays [m]."""
NEEDS_IT = 0.2
"""A plan that is driven while another one is sought is iterated itself when it is older than this [s]."""


def halted(halt: Halt | None, way: float, needed: float, now: float, caution: Caution) -> Halt | None:
    """Whether the vehicle brakes, or stands, for what its plan meets after `way` [m] (inf: nothing).

    It does so from when that is within what is `needed` to stop [m], until its way was clear of that, and
    `clear_distance` more, for `clear_time`.
    """
    if way <= needed:
        return Halt()
    if halt is None:
        return None
    if way <= needed + caution.clear_distance:
        return Halt()
    since = now if halt.clear_since is None else halt.clear_since
    return None if now - since >= caution.clear_time else Halt(clear_since=since)


def stop_before(
    memory: ControllerMemory, situation: PlanningContext, way: float, obstacle_changes: int | None
) -> ControllerMemory:
    """Something fills the way: make for a stop `way` [m] ahead, or stay where that is near.

    `obstacle_changes`: after which no way past was found; None: there was no time to find one.
    """
    stays = way <= NEAR_STOP
    stop = PlannedStop(
        at=float(situation.state[THETA]) + max(way, 0.0),
        goal=memory.goal,
        obstacles=obstacle_changes,
        since=situation.now,
        from_there=stays and is_stationary(memory, situation),
    )
    memory = renewed(restart(memory), stop=stop, looks_past=memory.looks_past and not stays)
    return renewed(memory, phase=Phase.HOLDING) if stays else memory


def is_old(memory: ControllerMemory, situation: PlanningContext) -> bool:
    """Whether the plan being driven has to be iterated before the search for another one goes on."""
    accepted = memory.accepted_at
    if memory.unfinished is None or memory.halt is not None or accepted is None:
        return False
    return situation.now - accepted > NEEDS_IT


def seeking(memory: ControllerMemory, stop: PlannedStop | None) -> ControllerMemory:
    """Look for a first plan to another stop, or to the part's own target; a search for it goes on."""
    return renewed(restart(memory), stop=stop, unfinished=memory.unfinished)


def unconfirmed(memory: ControllerMemory) -> bool:
    """Whether a stop is made for past which no way was sought yet."""
    return memory.stop is not None and memory.stop.obstacles is None


def confirmed(
    memory: ControllerMemory, situation: PlanningContext, obstacle_changes: int
) -> ControllerMemory:
    """There is no way past the stop that is made for."""
    assert memory.stop is not None
    stop = replace(memory.stop, goal=memory.goal, obstacles=obstacle_changes, since=situation.now)
    return renewed(memory, stop=stop, unfinished=None)


def still_filled(memory: ControllerMemory, situation: PlanningContext) -> ControllerMemory:
    """Another plan than the one to the stop was looked for in vain: not again at once."""
    stop = memory.stop
    return memory if stop is None else renewed(memory, stop=replace(stop, since=situation.now))


def found_clear(memory: ControllerMemory, obstacle_changes: int) -> ControllerMemory:
    """The driven plan is clear of what has changed: no way round that, or stop before it, is looked for."""
    begun = memory.unfinished
    for_arrival = begun is not None and begun.stop == memory.stop and memory.phase is Phase.CONTOURING
    return renewed(memory, clear_of=obstacle_changes, unfinished=begun if for_arrival else None)


def way_may_be_free(memory: ControllerMemory, now: float, obstacle_changes: int) -> bool:
    """Whether it is worth looking again if something still fills the way.

    From the stop itself it is once: what could not be passed in one go from far away may be from rest there.
    """
    stop, goal = memory.stop, memory.goal
    if stop is None or now - stop.since < LOOK_AGAIN:
        return False
    before = stop.goal
    elsewhere = before is not goal if before is None or goal is None else apart(before, goal) > MOVED
    there_now = memory.phase is Phase.HOLDING and not stop.from_there
    return elsewhere or there_now or stop.obstacles != obstacle_changes
