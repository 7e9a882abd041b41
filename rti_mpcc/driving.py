"""Driver: phases, search and ladder, from the situation of a cycle to what is driven in it."""

from __future__ import annotations

from dataclasses import replace
from math import inf

from geometry import Corridor, HalfPlanes, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig, Method
from rti_mpcc.controller import RtiMpcc
from rti_mpcc.model.layout import DELTA_DOT, THETA, V
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.planning import aim, legs, route, search, sensing, stops
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.cusp import cusp_pose
from rti_mpcc.planning.memory import ControllerMemory, Phase, PullOut, Situation, Unfinished, renewed
from rti_mpcc.planning.pace import pace_of
from rti_mpcc.planning.search import Attempt, Start
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.safety import contact, ladder
from rti_mpcc.safety.act import Act
from rti_mpcc.safety.stopping import stopping_motion
from rti_mpcc.types import Objective, Source, Status, Trajectory

TOO_LATE = "the plan came after the deadline"
BACKING = "driving past the goal, to back up into it"
MISSED = 1.5
"""A first plan that ends within so many times the goal tolerance is no reason to back up into the goal."""


class Driver:
    """Knows the route, what is around, and what was done in the last cycle; decides what is driven in this
    one.

    Args:
        path: the route; corridor: its boundaries and obstacles; config: settings.

    Raises:
        CorridorError: the corridor is narrower than the body.
    """

    def __init__(self, path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> None:
        self.path = path
        self.config = config
        self._surroundings = Surroundings.of(corridor, path, config)
        self._paces = tuple(pace_of(part, config) for part in path.parts)
        self._memory = ControllerMemory()
        self._cusp_of: tuple[int, int, Pose2] | None = None
        self._begin_leg()

    def _begin_leg(self) -> None:
        """The core and the pace for the active part, or for the way back along it."""
        index, back = self._memory.part, self._memory.pull_out
        part, self._pace = self.path.parts[index], self._paces[index]
        if back is not None:
            part = part.driven_back(back.begin, back.end)
            self._pace = pace_of(part, self.config)
        self._mpcc = RtiMpcc(part, self._surroundings.corridor, self.config, index=index)

    def _next_leg(self, situation: Situation) -> ControllerMemory | None:
        """The memory with which another part begins now, or a way back; None: this one goes on."""
        memory = self._memory
        if legs.has_pulled_out(memory, situation, self.config.dead_time):
            return legs.coming_again(memory, situation)
        if memory.pull_out is None and legs.may_change_direction(memory, situation, self.config.dead_time):
            return legs.next_leg(memory, staged=self._to_staging)
        way = self._way_back(situation)
        if way is not None and route.stands(memory, situation, self.config.dead_time):
            return legs.pulling_out(memory, situation, way)
        return None

    def _way_back(self, situation: Situation) -> PullOut | None:
        return legs.way_back(self._memory, situation, self._mpcc.part, self.config)

    def _aim(self) -> None:
        """Give the core what the active part is to end in: a stop, its own end, or the goal."""
        if self._may_be_free() and not route.drives(self._memory):
            self._memory = renewed(legs.released(self._memory), looks_past=True)
        if self._memory.stop is not None:
            self._mpcc.set_stop(self._memory.stop.at)
        elif self._to_staging:
            self._mpcc.set_stop(legs.staging_stop(self._mpcc.part, self._memory.goal, self.config))
        elif self._on_last_part:
            self._mpcc.set_goal(self._memory.goal)
        elif self._memory.pull_out is None and self.config.arrival:
            self._mpcc.set_end(self._cusp())
        else:
            self._mpcc.set_goal(None)

    def _cusp(self) -> Pose2:
        """Where the direction is to change, clear of what is known now."""
        index, changes = self._memory.part, self._surroundings.changes
        if self._cusp_of is None or self._cusp_of[:2] != (index, changes):
            pose = cusp_pose(self._mpcc.part.last, self._surroundings.corridor, index, self.config)
            self._cusp_of = index, changes, pose
        return self._cusp_of[2]

    def _may_be_free(self) -> bool:
        return stops.may_be_free(self._memory, self._memory.now, self._surroundings.changes)

    @property
    def _on_last_part(self) -> bool:
        return self._memory.part == len(self.path.parts) - 1 and self._memory.pull_out is None

    @property
    def _to_staging(self) -> bool:
        """Whether the vehicle is to stop on the path before the last leg, to the goal pose, begins."""
        separated = self.config.method is Method.SEPARATED
        return separated and self._on_last_part and not self._memory.cartesian

    def _assess(self) -> Situation:
        return sensing.situation_of(
            self._memory,
            self._mpcc.part,
            self._pace,
            self._mpcc.target,
            self.config,
            last_part=self._on_last_part and not self._to_staging,
        )

    # -- phases -------------------------------------------------------------------------------------

    def _driven(self, situation: Situation, clock: CycleClock) -> Act:
        """What is driven in this cycle: a plan that came too late is not."""
        before = self._memory
        act = self._act(situation, clock)
        if clock.late() and act.drive.source is Source.SOLUTION:
            last = self._go_on(before, situation, TOO_LATE, act.attempt, until_another=True)
            act = last or self._stop(situation, Status.STARTING, TOO_LATE, attempt=act.attempt)
        return act if before.pull_out is None else act.pulling_out(before.pulled_out + 1)

    def _act(self, situation: Situation, clock: CycleClock) -> Act:
        self._memory = renewed(route.noticed(self._memory, situation), touched=self._touched(situation))
        if situation.doubt:
            return self._doubt(situation, situation.doubt)
        self._memory = route.decide(self._memory, situation, self.config)
        phase = self._memory.phase
        if phase is Phase.HOLDING:
            return self._hold(situation)
        waiting = aim.must_wait(self._memory, situation, self.config)
        if waiting and route.stands(self._memory, situation):
            self._memory = route.restart(self._memory)
            return self._stop(situation, Status.GOAL_LOST, waiting)
        if phase is Phase.STALLED:
            stalled = self._stop(situation, Status.STALLED, "no plan from here ends inside the tolerance")
            stays = self._way_back(situation) is None
            return stalled if stays else stalled.pulling_out(self._memory.pulled_out + 1)
        if phase is Phase.SETTLING:
            wanted = ladder.landing(situation, self.config)
            return self._stop(situation, Status.SETTLING, "braking to rest at the target", wanted)
        if phase is Phase.STARTING:
            return self._start(situation, clock)
        cut = self._way_on_driven(situation)
        if cut < inf or self._wants_another_plan(situation):
            act = self._change_over(situation, clock, cut)
            if act is not None:
                return act
        if route.cartesian_due(self._memory, situation, self.config):
            self._memory = renewed(self._memory, cartesian=True, solution=None)
        return self._iterate(situation, clock)

    def _doubt(self, situation: Situation, doubt: str) -> Act:
        """Drive on along the last plan for a moment, by what is believed; then brake."""
        memory, trust = self._memory, self._memory.trust
        driving = route.drives(memory) and not memory.latched
        short = situation.now - trust.since <= self.config.plausibility.blind
        if driving and short and not trust.obstinate:
            act = self._go_on(memory, situation, doubt)
            if act is not None:
                return replace(act, status=Status.FAILED)
        return self._give_up(situation, doubt)

    def _start(self, situation: Situation, clock: CycleClock) -> Act:
        """Look for a first plan."""
        stands, latched = route.stands(self._memory, situation), self._memory.latched
        if stands and not route.looks_again(self._memory, situation):
            status = Status.FAILED if latched else Status.BLOCKED
            return self._stop(situation, status, f"standing, looks again soon: {latched or 'contact ahead'}")
        attempt, situation = self._begin(situation, clock)
        if self._memory.phase is Phase.HOLDING:
            return self._hold(situation)
        if not attempt.problem:
            return self._accept(attempt, situation)
        looks_past = self._memory.looks_past
        going_on = looks_past and attempt.cut
        if not (latched or going_on) and route.stands(self._memory, situation, route.PATIENCE):
            latched = attempt.problem
            self._memory = renewed(self._memory, latched=latched)
        if latched and stands:
            self._memory = renewed(self._memory, looked_at=situation.now)
        searching = Status.BLOCKED if looks_past else Status.STARTING
        status = Status.FAILED if latched else searching
        return self._stop(situation, status, attempt.problem, ladder.braking(self.config), attempt)

    def _change_over(self, situation: Situation, clock: CycleClock, cut: float) -> Act | None:
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
            wanted = ladder.braking(self.config)
            return self._stop(situation, Status.FAILED, attempt.problem, wanted, attempt)
        return None

    def _sought(self, situation: Situation, cut: float) -> Situation:
        """The situation by what another plan is to end in.

        A search for another end than the present plan's is first for a way past what is in the way. Where the
        plan is cut and there was no time for that, a stop comes first: it is found soon, and a way past can
        be looked for while it is made for.
        """
        memory, begun = self._memory, self._memory.unfinished
        left = inf
        if begun is not None and begun.stop is None and cut < inf:
            guess = search.first_guess(
                self._mpcc, renewed(memory, arrive_at=begun.arrive_at, backs=begun.backs), situation
            )
            way = self._way_to_contact(guess, inf)
            left = (way if way < inf else cut) - contact.stop_clearance(self.config)
        if stops.NEAR_STOP < left < inf:
            self._memory = stops.stop_before(memory, situation, left, None)
        elif begun is not None and begun.stop != memory.stop:
            self._memory = stops.seeking(memory, begun.stop)
        elif begun is None and memory.stop is not None and (cut < inf or self._may_be_free()):
            self._memory = stops.seeking(memory, None)
        else:
            return situation
        self._aim()
        return self._assess()

    def _iterate(self, situation: Situation, clock: CycleClock) -> Act:
        """One real-time iteration, and the ladder if it gives no plan."""
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
        act = self._go_on(self._memory, situation, attempt.problem, attempt, until_another=searching)
        return act or self._give_up(situation, attempt.problem, attempt)

    def _search(self, situation: Situation, start: Start, clock: CycleClock) -> Attempt:
        """Iterate, and keep the last iterate that was solved to go on from."""
        attempt = search.converge(self._mpcc, self._memory, situation, start, clock)
        if attempt.solved is not None:
            self._memory = renewed(self._memory, solution=attempt.solved)
        return attempt

    def _begin(self, situation: Situation, clock: CycleClock) -> tuple[Attempt, Situation]:
        """Search from a first guess; where that misses the goal, for an arrival that backs up into it.

        Where there is none either, what was found first is driven.
        """
        before, begun = self._memory, self._memory.unfinished
        backing = route.begin_backing(before, situation, self.config)
        if begun is not None and begun.backs:
            return self._begin_backing(backing, situation, clock) or self._begin_last(
                before, situation, clock
            )
        first, onward = self._begin_onward(situation, clock)
        sought = begun is not None and begun.in_vain
        if backing is None or sought or first.cut:
            return first, onward
        attempt = self._iterated_on(first, onward, begun, clock)
        if attempt.cut:  # nothing is begun yet
            self._memory = renewed(before, unfinished=self._memory.unfinished)
            return attempt, situation
        if onward.free and search.reaches(attempt, onward, MISSED):
            return attempt, onward
        found = self._memory
        backed = self._begin_backing(backing, situation, clock)
        if backed is None:
            self._memory = found
            self._aim()
        return backed or (first, onward)

    def _begin_last(
        self, before: ControllerMemory, situation: Situation, clock: CycleClock
    ) -> tuple[Attempt, Situation]:
        """Once more onward, where a search of several cycles for an arrival that backs up was in vain."""
        self._memory = renewed(before, unfinished=None)
        found = self._begin_onward(situation, clock)
        self._memory = search.sought_in_vain(self._memory)
        return found

    def _iterated_on(
        self, attempt: Attempt, situation: Situation, begun: Unfinished | None, clock: CycleClock
    ) -> Attempt:
        """A first plan to the goal that misses it is iterated on.

        What is left of the error then is worth less than the effort to mend it from there, and it goes on the
        way; or something stands in the way of it.
        """
        done = len(attempt.solutions) + (0 if begun is None else begun.iterations)
        missed = not (attempt.problem or attempt.squeezed or search.reaches(attempt, situation))
        if not (situation.free and missed) or done >= 2 * search.ITERATIONS:
            return attempt
        more = self._search(situation, search.further(attempt), clock)
        self._memory = search.left_unfinished(self._memory, situation, more, done)
        return attempt.then(more) if more.solutions else replace(attempt, problem=more.problem, cut=True)

    def _begin_backing(
        self, memory: ControllerMemory | None, situation: Situation, clock: CycleClock
    ) -> tuple[Attempt, Situation] | None:
        """Search for an arrival that passes the goal and backs up into it, clear of everything; None: there
        is none.

        `memory`: with which that is begun; None: there is nothing to begin.
        """
        if memory is None:
            return None
        self._memory = memory
        self._aim()
        attempt, _ = self._search_first(situation, clock)
        if attempt.cut:
            return attempt, situation
        if not (attempt.problem or search.reaches(attempt, situation)):
            attempt = self._further(attempt, situation, clock)
        if not search.reaches(attempt, situation):
            return None
        if self._way_to_contact(attempt.solutions[-1].trajectory, inf) < inf:
            return None
        self._memory = route.begun(self._memory, situation)
        return attempt, situation

    def _further(self, attempt: Attempt, situation: Situation, clock: CycleClock) -> Attempt:
        """As many iterations more, if there is time for them."""
        more = self._search(situation, search.further(attempt), clock)
        return attempt if more.cut else attempt.then(more)

    def _search_first(self, situation: Situation, clock: CycleClock) -> tuple[Attempt, Trajectory]:
        """Iterate from a first guess, returned, too, or go on where an earlier cycle had no time to."""
        guess = search.first_guess(self._mpcc, self._memory, situation)
        unfinished = self._memory.unfinished
        start = search.from_guess(guess) if unfinished is None else search.resumed(unfinished, guess)
        attempt = self._search(situation, start, clock)
        self._memory = search.left_unfinished(self._memory, situation, attempt)
        return attempt, guess

    def _begin_onward(self, situation: Situation, clock: CycleClock) -> tuple[Attempt, Situation]:
        """Search from a first guess; where something fills the way, for a stop before it."""
        self._memory = route.begin_phase(self._memory, situation, self.config)
        attempt, guess = self._search_first(situation, clock)
        if not attempt.cut and situation.free and self._surroundings.corridor.obstacles:
            way = self._way_in(attempt, guess)
            if way < inf and not (attempt.problem or attempt.squeezed):
                # Not squeezed and yet not clear: it has not come to its end that far ahead.
                attempt = self._further(attempt, situation, clock)
                way = self._decided(attempt, self._way_in(attempt, guess))
            if way < inf:
                return self._begin_stop(attempt, situation, way, clock)
        attempt = self._unless_into_a_wall(attempt, situation)
        if not attempt.problem:
            self._memory = route.begun(self._memory, situation)
        return attempt, situation

    def _unless_into_a_wall(self, attempt: Attempt, situation: Situation) -> Attempt:
        """From rest no plan is begun that gives way to a boundary: it would only come to a stop before it."""
        if attempt.problem or not attempt.squeezed or not route.stands(self._memory, situation):
            return attempt
        way = self._way_to_contact(attempt.solutions[-1].trajectory, inf)
        if way == inf:
            return attempt
        return replace(attempt, problem=f"no plan from here stays clear: contact in {way:.2f} m")

    def _way_in(self, attempt: Attempt, guess: Trajectory) -> float:
        """Way to what fills the way of the plan that was sought [m]; inf if nothing does."""
        if attempt.problem or attempt.squeezed:
            return self._way_to_contact(guess, inf)
        return self._way_to_contact(attempt.solutions[-1].trajectory, inf)

    def _decided(self, attempt: Attempt, way: float) -> float:
        """The way [m], or inf in the far half of a cruise, which ends in mid-way: it has not seen enough."""
        if attempt.problem or attempt.squeezed or self._memory.arrive_at is not None:
            return way
        return inf if way > 0.5 * contact.length(attempt.solutions[-1].trajectory) else way

    def _begin_stop(
        self, attempt: Attempt, situation: Situation, way: float, clock: CycleClock
    ) -> tuple[Attempt, Situation]:
        left = way - contact.stop_clearance(self.config)
        self._memory = stops.stop_before(self._memory, situation, left, self._surroundings.changes)
        self._aim()
        situation = self._assess()
        if self._memory.phase is Phase.HOLDING:
            return attempt, situation
        return self._begin(situation, clock)

    def _way_on_driven(self, situation: Situation) -> float:
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

    def _wants_another_plan(self, situation: Situation) -> bool:
        """Whether the way may be free that the plan being driven stops in, or its arrival should begin."""
        if stops.is_old(self._memory, situation):
            return False
        return self._may_be_free() or route.arrival_due(self._memory, situation, self.config)

    def _way_to_contact(self, plan: Trajectory, reach: float, planes: HalfPlanes | None = None) -> float:
        """Way along a plan to a contact [m], or inf. Args: planes of its solution, if it is one's."""
        corridor, part, touched = self._surroundings.corridor, self._memory.part, self._memory.touched
        if touched is None and contact.surely_clear(plan, planes, corridor, part, self.config, reach):
            return inf
        begins_free = touched is None and planes is not None
        return contact.way_to_contact(
            plan, corridor, part, self.config, reach, touched, begins_free=begins_free
        )

    def _touched(self, situation: Situation) -> float | None:
        memory, corridor = self._memory, self._surroundings.corridor
        planes = None if memory.solution is None else memory.solution.planes
        if memory.touched is None and contact.body_surely_clear(
            situation.state, planes, corridor, memory.part, self.config
        ):
            return None
        return contact.touched(memory.touched, situation.state, corridor, memory.part, self.config)

    # -- the rungs of the ladder --------------------------------------------------------------------

    def _accept(self, attempt: Attempt, situation: Situation) -> Act:
        """Drive the plan of this cycle, unless it must not be."""
        plan = attempt.solutions[-1].trajectory
        act = self._drive(plan, Source.SOLUTION, situation, "", attempt)
        driven, memory = act.drive.source is Source.SOLUTION, self._memory
        self._memory = route.accepted(memory, plan, situation) if driven else renewed(memory, fit=plan)
        return act

    def _go_on(
        self,
        memory: ControllerMemory,
        situation: Situation,
        problem: str,
        attempt: Attempt | None = None,
        *,
        until_another: bool = False,
    ) -> Act | None:
        """Drive the last accepted plan in this memory on; None if there is none that may be.

        It must be clear to its end, unless it is driven only until another one, that is on its way, is there.
        """
        plan = ladder.driven_on(memory.driven, memory.accepted_at, situation, self.config)
        if plan is None:
            return None
        return self._drive(plan, Source.SHIFTED_PLAN, situation, problem, attempt, anywhere=not until_another)

    def _give_up(self, situation: Situation, problem: str, attempt: Attempt | None = None) -> Act:
        """Brake to a standstill; what moved begins afresh once there is a reason to."""
        if self._memory.phase not in (Phase.HOLDING, Phase.STALLED):
            self._memory = renewed(route.restart(self._memory), latched=problem)
        return self._stop(situation, Status.FAILED, problem, ladder.braking(self.config), attempt)

    def _drive(
        self,
        plan: Trajectory,
        source: Source,
        situation: Situation,
        problem: str,
        attempt: Attempt | None,
        *,
        anywhere: bool = False,
    ) -> Act:
        """Drive a plan, unless its body meets something or the goal is not known well enough.

        `anywhere`: however far ahead that is.
        """
        config, memory, rate = self.config, self._memory, float(plan.controls[0, DELTA_DOT])
        planes = attempt.solutions[-1].planes if attempt and source is Source.SOLUTION else None
        way = self._way_to_stop_in(plan, situation, planes, anywhere=anywhere)
        self._memory = renewed(memory, blocked=way is not None)
        if way is not None:
            wanted = ladder.before_contact(float(situation.state[V]), way, config)
            return self._stop(situation, Status.BLOCKED, f"contact in {way:.2f} m", wanted, attempt, rate)
        waiting = aim.must_wait(memory, situation, config)
        if waiting:
            return self._stop(situation, Status.GOAL_LOST, waiting, attempt=attempt, steering_rate=rate)
        return Act(
            drive=ladder.follow(plan.controls[0], source),
            status=Status.FOLLOWING if memory.objective is Objective.CONTOURING else Status.ARRIVING,
            reason=problem
            or ("" if situation.free else "making for a stop before something in the way")
            or aim.remark(memory)
            or (BACKING if memory.backs else ""),
            trajectory=plan,
            attempt=attempt,
        )

    def _way_to_stop_in(
        self, plan: Trajectory, situation: Situation, planes: HalfPlanes | None, *, anywhere: bool
    ) -> float | None:
        """Way to a contact that the vehicle must brake for now [m], or None.

        Braking, or touching something, it does so for one that is farther than it needs to stop, too.
        """
        need = contact.stopping_distance(float(situation.state[V]), self.config)
        reach = inf if anywhere else need + contact.CHECKED
        way = self._way_to_contact(plan, reach, planes)
        wary = anywhere or self._memory.blocked or self._memory.touched is not None
        must_stop = way < inf if wary else way <= need
        return way if must_stop else None

    def _hold(self, situation: Situation) -> Act:
        if not situation.free:
            return self._stop(situation, Status.BLOCKED, "standing before something that fills the way")
        if not situation.last_part:
            back = self._memory.pull_out is not None
            where = "staging pose" if self._to_staging else "end of the way back" if back else "cusp"
            return self._stop(situation, Status.CHANGING_DIRECTION, f"standing at the {where}")
        if aim.never_seen(self._memory, self.config):
            return self._stop(situation, Status.SEARCHING, "standing at the planned goal, not detected yet")
        return self._stop(situation, Status.DOCKED, "standing inside the tolerance")

    def _braking_needed(self, motion: Trajectory) -> float:
        """Deceleration [m/s²] to stand before what a stopping motion meets, or to go no deeper into it."""
        memory, config = self._memory, self.config
        corridor = self._surroundings.corridor
        if memory.touched is not None and contact.deepens(motion, corridor, memory.part, config):
            return config.limits.acceleration
        way = self._way_to_contact(motion, inf)
        return ladder.before_contact(float(motion.states[0, V]), way, config) if way < inf else 0.0

    def _stop(
        self,
        situation: Situation,
        status: Status,
        reason: str,
        deceleration: float | None = None,
        attempt: Attempt | None = None,
        steering_rate: float = 0.0,
    ) -> Act:
        """Brake at `deceleration` [m/s²], by default the comfort acceleration, and stand.

        Where that is not enough to stand before what the vehicle meets on its way, it brakes harder.
        """
        config, state = self.config, situation.state
        wanted = config.comfort_acceleration if deceleration is None else deceleration
        times = stage_times(
            situation.begin, stage_lengths(config.cruise_horizon, config.cycle, config.stages)
        )
        stands = route.stands(self._memory, situation)
        motion = stopping_motion(state, times, wanted, config.vehicle.wheelbase)
        harder = 0.0 if stands else self._braking_needed(motion)
        if harder > wanted:
            wanted = harder
            motion = stopping_motion(state, times, wanted, config.vehicle.wheelbase)
        drive = ladder.hold(state, config) if stands else ladder.brake(state, wanted, config, steering_rate)
        return Act(drive=drive, status=status, reason=reason, trajectory=motion, attempt=attempt)
