"""Scout: the search for the first plan of an objective, over several cycles where there is no time in one."""

from __future__ import annotations

from dataclasses import replace
from math import inf

from rti_mpcc.model.layout import THETA
from rti_mpcc.navigating import Navigator
from rti_mpcc.planning import route, search, stops
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.detour import Detour, detours
from rti_mpcc.planning.memory import ControllerMemory, Past, Phase, PlanningContext, SuspendedSearch, renewed
from rti_mpcc.planning.search import InitialIterate, SqpResult
from rti_mpcc.safety import contact
from rti_mpcc.types import Trajectory

MISSED = 1.5
"""A first plan that ends within so many times the goal tolerance is no reason to back up into the goal."""


class Scout(Navigator):
    """Looks for a first plan: onward to the target, to a stop before what fills the way, or past the goal and
    back up into it."""

    def _begin(self, situation: PlanningContext, clock: CycleClock) -> tuple[SqpResult, PlanningContext]:
        """Search from a first guess; where that misses the goal, for an arrival that backs up into it.

        Where there is none either, what was found first is driven.
        """
        before, begun = self._memory, self._memory.unfinished
        backing = route.begin_reverse(before, situation, self.config)
        if begun is not None and begun.reverse_into_goal:
            return self._begin_reverse(backing, situation, clock) or self._begin_last(
                before, situation, clock
            )
        first, onward = self._begin_onward(situation, clock)
        sought = begun is not None and begun.reverse_failed
        if backing is None or sought or first.cut:
            return first, onward
        attempt = self._iterated_on(first, onward, begun, clock)
        if attempt.cut:  # nothing is begun yet
            self._memory = renewed(before, unfinished=self._memory.unfinished)
            return attempt, situation
        if onward.free and search.reaches(attempt, onward, MISSED):
            return attempt, onward
        found = self._memory
        backed = self._begin_reverse(backing, situation, clock)
        if backed is None:
            self._memory = found
            self._aim()
        return backed or (first, onward)

    def _begin_last(
        self, before: ControllerMemory, situation: PlanningContext, clock: CycleClock
    ) -> tuple[SqpResult, PlanningContext]:
        """Once more onward, where a search of several cycles for an arrival that backs up was in vain."""
        self._memory = renewed(before, unfinished=None)
        found = self._begin_onward(situation, clock)
        self._memory = search.reverse_search_failed(self._memory)
        return found

    def _iterated_on(
        self, attempt: SqpResult, situation: PlanningContext, begun: SuspendedSearch | None, clock: CycleClock
    ) -> SqpResult:
        """A first plan to the goal that misses it is iterated on.

        What is left of the error then is worth less than the effort to mend it from there, and it goes on the
        way; or something stands in the way of it.
        """
        done = len(attempt.solutions) + (0 if begun is None else begun.iterations)
        missed = attempt.fits and not search.reaches(attempt, situation)
        if not (situation.free and missed) or done >= 2 * search.ITERATIONS:
            return attempt
        more = self._search(situation, search.further(attempt), clock)
        self._memory = search.left_unfinished(self._memory, situation, more, done)
        return attempt.then(more) if more.solutions else replace(attempt, problem=more.problem, cut=True)

    def _begin_reverse(
        self, memory: ControllerMemory | None, situation: PlanningContext, clock: CycleClock
    ) -> tuple[SqpResult, PlanningContext] | None:
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
        if self._way_to_contact(attempt.plan, inf) < inf:
            return None
        self._memory = route.begun(self._memory, situation)
        return attempt, situation

    def _begin_onward(
        self, situation: PlanningContext, clock: CycleClock
    ) -> tuple[SqpResult, PlanningContext]:
        """Search from a first guess; where something fills the way, for one past it or a stop before it."""
        self._memory = route.begin_phase(self._memory, situation, self.config)
        begun = self._memory.unfinished
        if begun is not None and begun.past is not None:
            return self._begin_past(begun.past, search.NOT_YET, situation, clock)
        attempt, guess = self._search_first(situation, clock)
        if not attempt.cut and situation.free and self._surroundings.corridor.obstacles:
            way = self._way_in(attempt, guess)
            if way < inf and attempt.fits:
                # Not squeezed and yet not clear: it has not come to its end that far ahead.
                attempt = self._further(attempt, situation, clock)
                way = self._decided(attempt, self._way_in(attempt, guess))
            if way < inf and not self._stands_at_a_wall(attempt, guess, way):
                return self._begin_past(self._past(situation, way), attempt, situation, clock)
        attempt = self._unless_into_a_wall(attempt, situation)
        if not attempt.problem:
            self._memory = route.begun(self._memory, situation)
        return attempt, situation

    def _past(self, situation: PlanningContext, way: float) -> Past:
        """Ways past what fills the way."""
        here = float(situation.state[THETA])
        obstacles = self._surroundings.corridor.obstacles
        found = detours(self._mpcc.part, here, situation.target.stop, obstacles, self.config)
        return Past(detours=found, meets=here + way)

    def _begin_past(
        self, past: Past, attempt: SqpResult, situation: PlanningContext, clock: CycleClock
    ) -> tuple[SqpResult, PlanningContext]:
        """Search from a guess past either side of what fills the way, else for a stop before it.

        `attempt`: the one before.
        """
        before = self._memory
        for tried, detour in enumerate(past.detours):
            attempt, _ = self._search_first(situation, clock, detour)
            if attempt.cut:
                left = replace(past, detours=past.detours[tried:])
                self._memory = search.sought_past(self._memory, left)
                return attempt, situation
            if attempt.fits and self._way_to_contact(attempt.plan, inf) == inf:
                self._memory = route.begun(self._memory, situation)
                return attempt, situation
            self._memory = renewed(before, unfinished=None)
        return self._begin_stop(attempt, situation, past.meets - float(situation.state[THETA]), clock)

    def _begin_stop(
        self, attempt: SqpResult, situation: PlanningContext, way: float, clock: CycleClock
    ) -> tuple[SqpResult, PlanningContext]:
        left = way - contact.stop_clearance(self.config)
        self._memory = stops.stop_before(self._memory, situation, left, self._surroundings.changes)
        self._aim()
        situation = self._assess()
        if self._memory.phase is Phase.HOLDING:
            return attempt, situation
        return self._begin(situation, clock)

    def _search_first(
        self, situation: PlanningContext, clock: CycleClock, detour: Detour | None = None
    ) -> tuple[SqpResult, Trajectory]:
        """Iterate from a first guess, returned, too, or go on where an earlier cycle had no time to."""
        guess = search.first_guess(self._mpcc, self._memory, situation, detour)
        unfinished = self._memory.unfinished
        start = search.from_guess(guess) if unfinished is None else search.resumed(unfinished, guess)
        attempt = self._search(situation, start, clock)
        self._memory = search.left_unfinished(self._memory, situation, attempt)
        return attempt, guess

    def _search(self, situation: PlanningContext, start: InitialIterate, clock: CycleClock) -> SqpResult:
        """Iterate, and keep the last iterate that was solved to go on from."""
        attempt = search.converge(self._mpcc, self._memory, situation, start, clock)
        if attempt.solved is not None:
            self._memory = renewed(self._memory, solution=attempt.solved)
        return attempt

    def _further(self, attempt: SqpResult, situation: PlanningContext, clock: CycleClock) -> SqpResult:
        """As many iterations more, if there is time for them."""
        more = self._search(situation, search.further(attempt), clock)
        return attempt if more.cut else attempt.then(more)

    def _unless_into_a_wall(self, attempt: SqpResult, situation: PlanningContext) -> SqpResult:
        """From rest no plan is begun that gives way to a boundary: it would only come to a stop before it."""
        if (
            attempt.problem
            or not attempt.corridor_infeasible
            or not route.is_stationary(self._memory, situation)
        ):
            return attempt
        way = self._way_to_contact(attempt.plan, inf)
        if way == inf:
            return attempt
        return replace(attempt, problem=f"no plan from here stays clear: contact in {way:.2f} m")

    def _way_in(self, attempt: SqpResult, guess: Trajectory) -> float:
        """Way to what fills the way of the plan that was sought [m]; inf if nothing does."""
        return self._way_to_contact(attempt.plan if attempt.fits else guess, inf)

    def _stands_at_a_wall(self, attempt: SqpResult, guess: Trajectory, way: float) -> bool:
        """Whether it would stop right here, after a `way` [m] to what is no obstacle: nothing to wait for."""
        left = way - contact.stop_clearance(self.config)
        plan = attempt.plan if attempt.fits else guess
        standing = self._surroundings.standing
        return left <= stops.NEAR_STOP and contact.way_to_obstacle(plan, standing, self.config, inf) == inf

    def _decided(self, attempt: SqpResult, way: float) -> float:
        """The way [m], or inf in the far half of a cruise, which ends in mid-way: it has not seen enough."""
        if not attempt.fits or self._memory.arrive_at is not None:
            return way
        return inf if way > 0.5 * contact.length(attempt.plan) else way

    def _sought(self, situation: PlanningContext, cut: float) -> PlanningContext:
        """The situation by what another plan is to end in.

        A search for another end than the present plan's is first for a way past what is in the way. Where the
        plan is cut and there was no time for that, a stop comes first: it is found soon, and a way past can
        be looked for while it is made for.
        """
        memory, begun = self._memory, self._memory.unfinished
        left = inf
        if begun is not None and begun.stop is None and cut < inf:
            guess = search.first_guess(
                self._mpcc,
                renewed(memory, arrive_at=begun.arrive_at, reverse_into_goal=begun.reverse_into_goal),
                situation,
            )
            way = self._way_to_contact(guess, inf)
            left = (way if way < inf else cut) - contact.stop_clearance(self.config)
        if stops.NEAR_STOP < left < inf:
            self._memory = stops.stop_before(memory, situation, left, None)
        elif begun is not None and begun.stop != memory.stop:
            self._memory = stops.seeking(memory, begun.stop)
        elif begun is None and memory.stop is not None and (cut < inf or self._way_may_be_free()):
            self._memory = stops.seeking(memory, None)
        else:
            return situation
        self._aim()
        return self._assess()
