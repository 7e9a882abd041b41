"""How ways are planned in an area."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field

from geometry.settings import NonNegative, Positive, Settings, Short, Tolerance


class RoutePlanner(Settings):
    """How `plan_manoeuvre` looks for a way, and when a controller in an area looks for another one.

    Attributes:
        curvature_share: of the vehicle's largest curvature that a way takes: the rest is for control.
        steering_slope: change of the steering along the way, at most [rad/m].
        search_share: as `curvature_share`, of the search: it knows no change of the steering, and less leaves
            room to smoothing; reserve: kept on top of `Clearance.least` in the search and by smooth ways [m].
        final_straight: length of the straight last piece of a way into the goal [m]; final_direction: +1:
            it is driven forward, -1: in reverse, 0: either way.
        reverse_cost: of a metre in reverse, in metres forward; cusp_cost: of a change of direction [m];
            steering_cost: of a change of the steering [m/rad]; closeness_cost: of a metre at
            `Clearance.least`, on top of its own, falling to 0 at what is kept where there is room.
        arc: length of the arcs of the search; open: room beside the body from which on they are twice as
            long, both in radii of the sharpest bend.
        searches: one after the other until there is a way, each with the factor by which its lattice is
            finer near the ends, and the weight of its estimate of what is left to the goal.
        cells: of the grid of estimates, at most.
        places: on a way that are tried to be joined directly.
        knots: distance of the curvatures of a smoothed way, and window: length of way that is smoothed at a
            time, at most, both in radii of the sharpest bend; smoothing_iterations: at most.
        whole_tolerance: length of a stretch from which on its end has the whole of `Behaviour.cusp_tolerance`
            [m]; a shorter one has a share of it; least_tolerance: of it, at least.
        farthest: distance of a goal, at most: one that is farther away is refused [m].
        box: without a boundary the area reaches so far beyond all that is given [m].
        replan_after: a vehicle that has stood so long where it cannot get on asks for another way [s].
        again_after: but not before so long [s] where it has not come away from where the last one begins.
        goal_moved: so does one whose goal is farther than this from the one that its way leads to [m],
            [rad].
        unmoved: what is planned goes on while the vehicle and its goal are within this of where they were
            (longitudinal [m], lateral [m], heading [rad]); near: and is driven from within this.
        instead: another way is driven instead of a path whose goal is out of reach from its last change of
            direction, if it takes at most so many times as long.
        join_after: a way that a vehicle is to go on without a stop begins so far ahead of it [s].
        slices: of planning in one cycle, at most; slices_at_rest: of a vehicle that stands and waits for it.
        nodes: poses expanded, at most; seconds: time of a search, at most [s].
    """

    former: ClassVar = {
        "margin": "clearance.wanted, of which routes keep 0.1 m more",
        "hard_minimum": "clearance.least",
    }

    curvature_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.9
    steering_slope: Positive = 0.6
    search_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.85
    reserve: NonNegative = 0.03
    final_straight: Short = 0.0
    final_direction: Literal[-1, 0, 1] = 0
    reverse_cost: Annotated[float, Field(ge=1.0, le=100.0)] = 1.2
    cusp_cost: NonNegative = 2.0
    steering_cost: NonNegative = 0.2
    closeness_cost: NonNegative = 1.5
    arc: Annotated[float, Field(gt=0.0, le=1.0)] = 0.16
    open: Annotated[float, Field(gt=0.0, le=10.0)] = 0.25
    searches: tuple[tuple[Positive, Annotated[float, Field(ge=1.0, le=100.0)]], ...] = (
        (1.0, 3.0),
        (2.0, 3.0),
        (1.0, 1.5),
        (4.0, 1.5),
        (32.0, 3.0),
    )
    cells: Annotated[int, Field(ge=100, le=10**8)] = 200_000
    places: Annotated[int, Field(ge=1, le=10_000)] = 40
    knots: Annotated[float, Field(gt=0.0, le=1.0)] = 0.2
    window: Annotated[float, Field(ge=5.0, le=1000.0)] = 25.0
    smoothing_iterations: Annotated[int, Field(ge=0, le=1000)] = 40
    whole_tolerance: Positive = 1.0
    least_tolerance: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    farthest: Positive = 2000.0
    box: Positive = 15.0
    replan_after: NonNegative = 1.0
    again_after: NonNegative = 8.0
    goal_moved: tuple[Positive, Positive] = (1.0, 0.35)
    unmoved: Tolerance = (0.03, 0.03, 0.03)
    near: Tolerance = (0.1, 0.05, 0.035)
    instead: Positive = 1.2
    join_after: Positive = 1.0
    slices: Annotated[int, Field(ge=1, le=10_000)] = 2
    slices_at_rest: Annotated[int, Field(ge=1, le=10_000)] = 6
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
