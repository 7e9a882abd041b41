"""The searches for a way, one after the other, each in a lattice of its own.

A lattice as fine as it has to be: a coarse one may be searched in vain all over the place while the way out
of where it is tight needs a finer one. And as greedy as it may be: the estimate knows no body, and one that
counts for much leads into gaps that it does not fit through, in which a finer lattice has only more places.
So each search gets half of what it leaves to the next.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from math import inf, sqrt

import numpy as np

from geometry.arrays import Array
from rti_mpcc.manoeuvre import PlanOutcome
from rti_mpcc.route_planner.cost_to_go import CostToGo, axle_clearances, cost_to_go, disc_of
from rti_mpcc.route_planner.costs import Terms
from rti_mpcc.route_planner.hybrid_astar import EXHAUSTED, SEARCHING, HybridAStar
from rti_mpcc.route_planner.leaving import Begins
from rti_mpcc.route_planner.problem import ARC, Problem

_CELLS = 200_000  # of the grid of estimates, at most
_SLICE = 8  # nodes of each tree between two questions whether there is time
_CLOSER = 1.0 / 3.0  # as far apart are the poses that are looked at once a way was nearer to something


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ends:
    """What the searches of a problem share: where they end, and estimates of the cost to there.

    Attributes:
        goals: (n, 3) where the last straight pieces begin; lasts: (n, 2) these, see `Problem.lasts`.
        grids: costs to the first goal and to the start.
    """

    goals: Array
    lasts: Array
    grids: tuple[CostToGo, CostToGo]

    @classmethod
    def of(cls, problem: Problem, lasts: Array, terms: Terms) -> Generator[None, None, Ends]:
        """Find the estimates, slice by slice."""
        config, low, high = problem.config, problem.low, problem.high
        cell = max(ARC * terms.radius, sqrt(float(np.prod(high - low)) / _CELLS))
        radius = disc_of(config.vehicle)
        reach = radius + config.clearance.on_routes + cell
        apart = yield from axle_clearances(problem.grid, low, high, cell, reach)
        goals = np.array([problem.before_goal(length) for length in lasts[:, 0]])
        to_goal = yield from cost_to_go(apart, low, cell, radius, (goals[0, 0], goals[0, 1]), config)
        to_start = yield from cost_to_go(
            apart, low, cell, radius, (problem.start[0], problem.start[1]), config
        )
        return cls(goals=goals, lasts=lasts, grids=(to_goal, to_start))


class Searches:
    """All searches for one problem.

    Args:
        problem, begins, ends: see there; terms: of the first search.
        spent: the time that the planning took so far [s].

    Attributes:
        nodes: poses expanded in all; nearest: how near to the goal they came [m].
    """

    def __init__(
        self, problem: Problem, begins: Begins, ends: Ends, terms: Terms, spent: Callable[[], float]
    ) -> None:
        self._problem, self._begins, self._ends, self._spent = problem, begins, ends, spent
        self._left = list(problem.config.route.searches)
        self.terms = terms
        self.nodes, self.nearest = 0, inf
        self._budget_spent, self._rejected = False, ""

    def next_way(self) -> Generator[None, None, tuple[int, Array, Array] | None]:
        """Where the next search that finds a way begins, the way (n, 2), and the straight piece after it.

        The piece is (1, 2), or (0, 2) without one. None: no search is left, or no budget.
        """
        settings = self._problem.config.route
        while self._left and not self._budget_spent:
            finer, weight = self._left.pop(0)
            terms = self.terms._replace(finer=finer, weight=weight)
            most = (
                settings.nodes - self.nodes
                if not self._left
                else settings.nodes // 2 ** (len(self._left) + 1)
            )
            search = yield from self._searched(terms, most)
            if search.cost < inf:
                return search.way()
            ended = search.state == EXHAUSTED
            self._budget_spent = not ended and (not self._left or self._is_late)
        return None

    def reject(self, clearance: float) -> None:
        """Go on after a way that leaves so much [m] between the poses that the search looked at."""
        least = self._problem.config.clearance.least
        self._rejected = f"the way found leaves {clearance:.3f} m, at least {least} m are kept"
        self.terms = self.terms._replace(check=_CLOSER * self.terms.check)

    @property
    def failure(self) -> tuple[PlanOutcome, str]:
        """Why there is no way."""
        nearest = f"the nearest is {self.nearest:.2f} m from the goal"
        if self._budget_spent:
            said = f"{self.nodes} poses were looked at in {self._spent():.1f} s, {nearest}"
            return PlanOutcome.BUDGET_SPENT, said
        said = f"all of {self.nodes} poses that can be reached were looked at, {nearest}"
        return PlanOutcome.NO_WAY, self._rejected or said

    def _searched(self, terms: Terms, most: int) -> Generator[None, None, HybridAStar]:
        """A search that has come to its end, or to as many nodes or as late as it may."""
        problem, begins, ends = self._problem, self._begins, self._ends
        search = HybridAStar(
            problem.body.shape,
            problem.grid.solid,
            terms,
            begins.poses,
            begins.pieces,
            begins.costs,
            ends.goals,
            ends.lasts,
            ends.grids,
        )
        yield
        while search.state == SEARCHING and most - search.expanded >= 2 and not self._is_late:
            search.advance(min(_SLICE, (most - search.expanded) // 2))
            yield
        self.nodes += search.expanded
        self.nearest = min(self.nearest, search.nearest)
        return search

    @property
    def _is_late(self) -> bool:
        return self._spent() >= self._problem.config.route.seconds
