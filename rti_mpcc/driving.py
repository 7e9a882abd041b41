"""Driver: phases and fallback, from the situation of a cycle to what is driven in it."""

from __future__ import annotations

from dataclasses import replace
from math import inf

from geometry import HalfPlanes
from rti_mpcc.model.layout import DELTA_DOT, THETA, V
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.planning import aim, route, search, stops
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.memory import ControllerMemory, Halt, Phase, PlanningContext, renewed
from rti_mpcc.planning.search import SqpResult
from rti_mpcc.safety import authority, contact, escape, fallback
from rti_mpcc.safety.contact import Overlap
from rti_mpcc.safety.decision import ControlDecision
from rti_mpcc.safety.stopping import stopping_along, stopping_motion
from rti_mpcc.scouting import Scout
from rti_mpcc.types import Objective, Source, Status, Trajectory

TOO_LATE = "the plan came after the deadline"
SLOWEST = 1e-3
"""Least deceleration of a motion that is looked at [m/s²]."""
BACKING = "driving past the goal, to back up into it"


class Driver(Scout):
    """Decides what is driven in a cycle: what its phase asks for, or the next rung of the fallback."""

    def _driven(self, situation: PlanningContext, clock: CycleClock) -> ControlDecision:
        """What is driven in this cycle: a plan that came too late is not."""
        before = self._memory
        decision = self._decide(situation, clock)
        if clock.late() and decision.control.source is Source.SOLUTION:
            last = self._go_on(before, situation, TOO_LATE, decision.attempt, until_another=True)
            decision = last or self._stop(situation, Status.STARTING, TOO_LATE, attempt=decision.attempt)
        return decision if before.pull_out is None else decision.pulling_out(before.pulled_out + 1)

    def _decide(self, situation: PlanningContext, clock: CycleClock) -> ControlDecision:
        self._memory = route.noticed(self._memory, situation)
        overlap = self._overlap(situation)
        if overlap is not None:
            return self._in_contact(situation, overlap)
        if situation.doubt:
            return self._doubt(situation, situation.doubt)
        beyond = authority.exceeded(self._memory.disturbance, self.config)
        if beyond:
            return self._give_up(situation, beyond)
        self._watch(situation)
        self._memory = route.decide(self._memory, situation, self.config)
        phase = self._memory.phase
        if phase is Phase.HOLDING:
            return self._hold(situation)
        waiting = aim.must_wait(self._memory, situation, self.config)
        if waiting and route.is_stationary(self._memory, situation):
            self._memory = route.restart(self._memory)
            return self._stop(situation, Status.GOAL_LOST, waiting)
        if phase is Phase.STALLED:
            stalled = self._stop(situation, Status.STALLED, "no plan from here ends inside the tolerance")
            stays = self._way_back(situation) is None
            return stalled if stays else stalled.pulling_out(self._memory.pulled_out + 1)
        if phase is Phase.SETTLING:
            wanted = fallback.settling_deceleration(situation, self.config)
            return self._stop(situation, Status.SETTLING, "braking to rest at the target", wanted)
        if phase is Phase.STARTING:
            return self._start(situation, clock)
        cut = self._way_on_driven(situation)
        if cut < inf or self._wants_another_plan(situation):
            decision = self._change_over(situation, clock, cut)
            if decision is not None:
                return decision
        if route.cartesian_due(self._memory, situation, self.config):
            self._memory = renewed(self._memory, cartesian=True, solution=None)
        return self._iterate(situation, clock)

    def _doubt(self, situation: PlanningContext, doubt: str) -> ControlDecision:
        """Drive on along the last plan for a moment, by what is believed; then brake."""
        memory, monitor = self._memory, self._memory.monitor
        driving = route.drives(memory) and not memory.latched
        short = situation.now - monitor.since <= self.config.plausibility.blind
        if driving and short and not monitor.steering_fault:
            decision = self._go_on(memory, situation, doubt)
            if decision is not None:
                return replace(decision, status=Status.FAILED)
        return self._give_up(situation, doubt)

    def _start(self, situation: PlanningContext, clock: CycleClock) -> ControlDecision:
        """Look for a first plan."""
        is_stationary, latched = route.is_stationary(self._memory, situation), self._memory.latched
        if is_stationary and not route.replan_due(self._memory, situation):
            status = Status.FAILED if latched else Status.BLOCKED
            return self._stop(situation, status, f"standing, looks again soon: {latched or 'contact ahead'}")
        attempt, situation = self._begin(situation, clock)
        if self._memory.phase is Phase.HOLDING:
            return self._hold(situation)
        if not attempt.problem:
            return self._accept(attempt, situation)
        looks_past = self._memory.looks_past
        going_on = looks_past and attempt.cut
        if not (latched or going_on) and route.is_stationary(self._memory, situation, route.PATIENCE):
            latched = attempt.problem
            self._memory = renewed(self._memory, latched=latched)
        if latched and is_stationary:
            self._memory = renewed(self._memory, looked_at=situation.now)
        searching = Status.BLOCKED if looks_past else Status.STARTING
        status = Status.FAILED if latched else searching
        return self._stop(situation, status, attempt.problem, fallback.braking(self.config), attempt)

    def _change_over(
        self, situation: PlanningContext, clock: CycleClock, cut: float
    ) -> ControlDecision | None:
        """Turn from the present plan to the first one of another objective; None: not yet.

        `cut`: way [m] to what cuts the present plan, inf if nothing does.
        """
        driving = self._memory
        attempt, other = self._begin(self._sought(situation, cut), clock)
        if cut == inf and stops.unconfirmed(driving) and self._memory.stop not in (None, driving.stop):
            # No way past: the stop is needed, and the plan to it is as good as another one.
            self._memory = stops.confirmed(driving, situation, self._surroundings.changes)
            self._aim()
            return None
        if not attempt.problem and self._memory.phase is not Phase.HOLDING:
            return self._accept(attempt, other)
        self._memory = renewed(driving, unfinished=self._memory.unfinished)
        if not attempt.cut:
            self._memory = stops.still_filled(self._memory, situation)
        self._aim()
        if route.too_late(driving, situation, self.config):
            wanted = fallback.braking(self.config)
            return self._stop(situation, Status.FAILED, attempt.problem, wanted, attempt)
        return None

    def _iterate(self, situation: PlanningContext, clock: CycleClock) -> ControlDecision:
        """One real-time iteration, and the fallback if it gives no plan."""
        memory = self._memory
        start = search.going_on(memory.solution)
        if memory.solution is None and memory.fit is not None:  # another objective from here on
            start = search.clean(memory.fit)
        attempt = self._search(situation, start, clock)
        if attempt.problem and not attempt.cut and memory.fit is not None:
            attempt = attempt.then(self._search(situation, search.clean(memory.fit), clock))
        if not attempt.problem:
            return self._accept(attempt, situation)
        searching = memory.unfinished is not None
        decision = self._go_on(self._memory, situation, attempt.problem, attempt, until_another=searching)
        return decision or self._give_up(situation, attempt.problem, attempt)

    def _way_on_driven(self, situation: PlanningContext) -> float:
        """Way [m] to where a change of the obstacles cuts the plan being driven, however far along, or inf.

        Looked for in every cycle until a plan is driven that they do not cut.
        """
        memory, changes = self._memory, self._surroundings.changes
        plan = memory.driven
        if plan is None or memory.clear_of == changes:
            return inf
        way = self._way_to_contact(plan, inf)
        if way == inf:
            self._memory = stops.found_clear(memory, changes)
        return way - max(float(situation.state[THETA] - plan.states[0, THETA]), 0.0)

    def _wants_another_plan(self, situation: PlanningContext) -> bool:
        """Whether the way may be free that the plan being driven stops in, or its arrival should begin."""
        if stops.is_old(self._memory, situation):
            return False
        return self._way_may_be_free() or route.arrival_due(self._memory, situation, self.config)

    # -- the rungs of the fallback --------------------------------------------------------------------

    def _accept(self, attempt: SqpResult, situation: PlanningContext) -> ControlDecision:
        """Drive the plan of this cycle, unless it must not be."""
        plan = attempt.plan
        decision = self._follow_plan(plan, Source.SOLUTION, situation, "", attempt)
        driven, memory = decision.control.source is Source.SOLUTION, self._memory
        self._memory = route.accepted(memory, plan, situation) if driven else renewed(memory, fit=plan)
        return decision

    def _go_on(
        self,
        memory: ControllerMemory,
        situation: PlanningContext,
        problem: str,
        attempt: SqpResult | None = None,
        *,
        until_another: bool = False,
    ) -> ControlDecision | None:
        """Drive the last accepted plan in this memory on; None if there is none that may be.

        It must be clear to its end, unless it is driven only until another one, that is on its way, is there.
        """
        plan = fallback.shifted_plan(memory.driven, memory.accepted_at, situation, self.config)
        if plan is None:
            return None
        return self._follow_plan(
            plan, Source.SHIFTED_PLAN, situation, problem, attempt, anywhere=not until_another
        )

    def _give_up(
        self, situation: PlanningContext, problem: str, attempt: SqpResult | None = None
    ) -> ControlDecision:
        """Brake to a standstill; what moved begins afresh once there is a reason to."""
        if self._memory.phase not in (Phase.HOLDING, Phase.STALLED):
            self._memory = renewed(route.restart(self._memory), latched=problem)
        return self._stop(situation, Status.FAILED, problem, fallback.braking(self.config), attempt)

    def _follow_plan(
        self,
        plan: Trajectory,
        source: Source,
        situation: PlanningContext,
        problem: str,
        attempt: SqpResult | None,
        *,
        anywhere: bool = False,
    ) -> ControlDecision:
        """Drive a plan, unless its body is not clear over the way to a stop or the goal is not known well
        enough.

        `anywhere`: however far ahead that is.
        """
        config, memory = self.config, self._memory
        planes = attempt.solutions[-1].planes if attempt and source is Source.SOLUTION else None
        need = inf if anywhere else contact.stopping_way(float(situation.state[V]), config)
        later = 0.0 if memory.halt is None else config.caution.clear_time
        way = self._way_clear(plan, need + config.caution.clear_distance, planes, later)
        if self._surroundings.moving:
            way = min(way, self._way_moving(self._slowing(situation, plan), inf, later))
        self._halt(way, need if way < inf else 0.0, situation)
        if self._memory.halt is not None:
            reason = "waits until its way has been clear for a while"
            if way < inf:
                reason = f"contact in {way:.2f} m"
            return self._stop(situation, Status.BLOCKED, reason, attempt=attempt, along=memory.driven)
        waiting = aim.must_wait(memory, situation, config)
        if waiting:
            return self._stop(situation, Status.GOAL_LOST, waiting, attempt=attempt, along=plan)
        return ControlDecision(
            control=fallback.follow(plan.controls[0], source),
            status=Status.FOLLOWING if memory.objective is Objective.CONTOURING else Status.ARRIVING,
            reason=problem
            or ("" if situation.free else "making for a stop before something in the way")
            or aim.remark(memory)
            or (BACKING if memory.reverse_into_goal else ""),
            trajectory=plan,
            attempt=attempt,
        )

    # -- what is in the way --------------------------------------------------------------------------

    def _in_contact(self, situation: PlanningContext, overlap: Overlap) -> ControlDecision:
        """Brake and stand; or creep out of it, where the settings allow that."""
        self._memory = renewed(route.restart(self._memory), halt=Halt())
        motion = escape.way_out(
            situation.state, situation.begin, self._surroundings, self._memory.part, self.config
        )
        if motion is not None:
            control = fallback.follow(motion.controls[0], Source.ESCAPE)
            return ControlDecision(
                control=control,
                status=Status.BLOCKED,
                reason=f"{overlap}: creeps out of it",
                trajectory=motion,
            )
        # Noise of a centimetre beside an obstacle is no reason to brake as hard as can be.
        shallow = overlap.depth <= self.config.caution.contact_tolerance
        wanted = self.config.comfort_acceleration if shallow else self.config.limits.acceleration
        return self._stop(situation, Status.BLOCKED, str(overlap), wanted)

    def _watch(self, situation: PlanningContext) -> None:
        """Halt where the way of the plan that is being driven is no longer clear."""
        memory, around = self._memory, self._surroundings
        if memory.driven is None or route.is_stationary(memory, situation):
            return
        if memory.clear_of == around.changes and not around.moving:
            return
        way = self._way_clear(self._slowing(situation, memory.driven), inf)
        if way < inf:
            self._halt(way, inf, situation)

    def _slowing(self, situation: PlanningContext, plan: Trajectory) -> Trajectory:
        """The motion that stands after all of the way that is looked at for a stop, along a plan."""
        speed = float(situation.state[V])
        need = contact.stopping_way(speed, self.config)
        return self._braking(situation, max(speed**2 / (2.0 * need), SLOWEST), plan)

    def _halt(self, way: float, need: float, situation: PlanningContext) -> None:
        halt = stops.halted(self._memory.halt, way, need, situation.now, self.config.caution)
        self._memory = renewed(self._memory, halt=halt)

    def _way_clear(
        self, plan: Trajectory, reach: float, planes: HalfPlanes | None = None, later: float = 0.0
    ) -> float:
        """Way along a plan to where it is not clear of what stands or moves [m], or inf."""
        least = self.config.caution.hard_minimum
        return min(self._way_moving(plan, reach, later), self._way_to_contact(plan, reach, planes, least))

    def _way_moving(self, plan: Trajectory, reach: float, later: float = 0.0) -> float:
        """Way along a plan, begun `later` [s], to what may be met of what moves [m], or inf."""
        around = self._surroundings
        ahead = self._memory.now - around.given_at + later
        return contact.way_to_moving(plan, around.moving, ahead, self.config, reach)

    def _hold(self, situation: PlanningContext) -> ControlDecision:
        if not situation.free:
            return self._stop(situation, Status.BLOCKED, "standing before something that fills the way")
        if not situation.last_part:
            back = self._memory.pull_out is not None
            where = "staging pose" if self._to_staging else "end of the way back" if back else "cusp"
            return self._stop(situation, Status.CHANGING_DIRECTION, f"standing at the {where}")
        if aim.never_seen(self._memory, self.config):
            return self._stop(situation, Status.SEARCHING, "standing at the planned goal, not detected yet")
        return self._stop(situation, Status.DOCKED, "standing inside the tolerance")

    def _stop(
        self,
        situation: PlanningContext,
        status: Status,
        reason: str,
        deceleration: float | None = None,
        attempt: SqpResult | None = None,
        along: Trajectory | None = None,
    ) -> ControlDecision:
        """Brake at `deceleration` [m/s²], by default the comfort acceleration, and stand.

        Where that is not enough to stand before what the vehicle meets on its way, it brakes harder.

        `along`: a plan to brake along, where that is as gentle as with the steering held.
        """
        config, state = self.config, situation.state
        wanted = config.comfort_acceleration if deceleration is None else deceleration
        if route.is_stationary(self._memory, situation):
            motion, control = self._braking(situation, wanted), fallback.hold(state, config)
        else:
            motion, needed = self._braking_in_time(situation, wanted, along)
            control = fallback.brake(state, needed, config, float(motion.controls[0, DELTA_DOT]))
        return ControlDecision(
            control=control, status=status, reason=reason, trajectory=motion, attempt=attempt
        )

    def _braking_in_time(
        self, situation: PlanningContext, wanted: float, along: Trajectory | None
    ) -> tuple[Trajectory, float]:
        """The gentlest braking to stand in time, and its deceleration [m/s²], `wanted` at least."""
        speed, found = float(situation.state[V]), []
        for plan in (None,) if along is None else (along, None):
            motion = self._braking(situation, wanted, plan)
            way = self._way_clear(motion, inf)
            needed = wanted if way == inf else max(wanted, fallback.before_contact(speed, way, self.config))
            found.append((motion, needed, plan))
        motion, needed, plan = min(found, key=lambda each: each[1])
        return (motion if needed == wanted else self._braking(situation, needed, plan)), needed

    def _braking(
        self, situation: PlanningContext, deceleration: float, along: Trajectory | None = None
    ) -> Trajectory:
        """The motion of a vehicle that brakes at `deceleration` [m/s²], along a plan where it is near it."""
        config, state = self.config, situation.state
        lengths = stage_lengths(config.cruise_horizon, config.cycle, config.stages)
        times = stage_times(situation.begin, lengths)
        motion = None if along is None else stopping_along(along, state, times, deceleration)
        return motion or stopping_motion(state, times, deceleration, config.vehicle.wheelbase)
