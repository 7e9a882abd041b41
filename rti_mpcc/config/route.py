"""How routes are planned in an area, and how missions are driven."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field

from geometry.settings import CONSTANT, NonNegative, Positive, Settings, Short


class RoutePlanner(Settings):
    """How `plan_manoeuvre` looks for a way, and when a controller in an area looks for another one.

    Attributes:
        steering_slope: change of the steering along the route, at most [rad/m].
        reserve: kept on top of `Clearance.least` in the search and by smooth routes [m].
        final_straight: length of the straight last piece of a route into the goal [m].
        final_direction: +1: it is driven forward, -1: in reverse, 0: either way.
        reverse_cost: of a metre in reverse, in metres forward.
        cusp_cost: of a change of direction [m].
        steering_cost: of a change of the steering [m/rad].
        closeness_cost: of a metre at `Clearance.least`, on top of its own, falling to 0 at what is kept where
            there is room.
        searches: one after the other until there is a route, each with the factor by which its lattice is
            finer near the ends, and the weight of its estimate of the cost to the goal.
        farthest: distance of a goal, at most: one that is farther away is refused [m].
        nodes: poses expanded, at most.
        seconds: time of a search, at most [s].
    """

    former: ClassVar = {
        "margin": "clearance.wanted, of which routes keep 0.1 m more",
        "hard_minimum": "clearance.least",
        "curvature_share search_share arc open cells places knots window smoothing_iterations "
        "whole_tolerance least_tolerance box replan_after again_after goal_moved unmoved near instead "
        "join_after slices slices_at_rest": CONSTANT,
    }

    steering_slope: Positive = 0.6
    reserve: NonNegative = 0.03
    final_straight: Short = 0.0
    final_direction: Literal[-1, 0, 1] = 0
    reverse_cost: Annotated[float, Field(ge=1.0, le=100.0)] = 1.2
    cusp_cost: NonNegative = 2.0
    steering_cost: NonNegative = 0.2
    closeness_cost: NonNegative = 1.5
    searches: tuple[tuple[Positive, Annotated[float, Field(ge=1.0, le=100.0)]], ...] = (
        (1.0, 3.0),
        (2.0, 3.0),
        (1.0, 1.5),
        (4.0, 1.5),
        (32.0, 3.0),
    )
    farthest: Positive = 2000.0
    nodes: Annotated[int, Field(ge=1, le=10**9)] = 100_000
    seconds: Positive = 20.0

    def along_path(self) -> Self:
        """The settings for another way than a path that was given.

        The path has said in which direction to drive, so neither costs more. Where there was one there mostly
        is room: a way with fewer changes of direction is worth a longer search, and what is not found soon is
        not there.
        """
        return self.changed(
            reverse_cost=1.0,
            cusp_cost=6.0,
            searches=((1.0, 2.0), (2.0, 3.0), (4.0, 3.0)),
            nodes=min(self.nodes, 20_000),
        )


class MissionSettings(Settings):
    """When a step of a mission is over, and what a retry does.

    Attributes:
        settled: a step is over once the vehicle has stood at its end for so long [s].
        back_off: distance that a vehicle drives out of a dock, at least, before it tries again [m].
    """

    former: ClassVar = {
        "body_moved straight_end out_tolerance out_straights out_bends out_undone out_sides out_ends spacing "
        "beside headings": CONSTANT,
    }

    settled: NonNegative = 0.5
    back_off: Annotated[Short, Field(gt=0.0)] = 3.0
