"""When the vehicle does what on its segments, and how its plans are sought."""

from __future__ import annotations

from math import radians
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from geometry.settings import NonNegative, Positive, Settings, Tolerance

Ride = Literal["smooth", "brisk"]
"""What an arrival is to be like, within comfort.

smooth: of least acceleration energy; its acceleration falls evenly, and is that of comfort at either end.
brisk: of least time, with the comfort acceleration as far as its jerk allows; some 15 % shorter.
"""


class Behaviour(Settings):
    """When a vehicle stands, is at its target or beside it, settles, and has come to a place to go on from.

    Attributes:
        standstill_speed: below this speed the vehicle stands [m/s], also where it creeps out of an overlap.
        moving_speed: a vehicle that stands is taken to stand until it is measured faster than this [m/s]:
            noise is no motion. At least `standstill_speed`.
        standstill_time: a vehicle that has stood so long [s] will not get nearer by waiting.
        turning_time: the same where it may change its direction of motion on its way [s].
        overdue_time: an arrival that is still driven so long [s] after its time to go reached
            `ArrivalTiming.least_time` will not get nearer, even if noise hides that the vehicle stands.
        outside_time: so long a vehicle that holds has to be measured just outside the tolerance to be
            outside [s]; outside_share: at once it is beyond so many times the tolerance.
        settle_share: share of the goal tolerance inside which a braked stop ends the arrival, and within
            which a target has not moved for a vehicle that stalled before it.
        settle_time: a braked stop that ends the arrival takes no longer than this [s]; until then the plan is
            driven.
        due_time: an arrival that has its shortest time to go for so long [s] is due: what it comes to shows.
            due_share: a braked stop within this share of the tolerance ends it then; where its plan ends
            outside the tolerance another way is planned.
        cusp_tolerance: what counts as being at a cusp or a staging pose: longitudinal [m], lateral [m],
            heading [rad] (3 deg).
        cusp_reach: a vehicle that stands within this distance of a cusp may go on from there [m].
        cusp_shift: share of the tolerance at a cusp by which the pose that is made for may lie beside it:
            the rest is for how the vehicle gets there (docs/decisions/13-cusps.md).
        wheels_off: a segment that says so is begun with the wheels within this of the angle that it begins
            with [rad]; wheels_reach: as long as no more of it than this is driven [m].
        calm_speed: slower than this [m/s] a plan turns the wheels within comfort.
        near_stop: a vehicle this near to a stop before something stays where it is [m].
        stop_tolerance: what counts as being at such a stop: longitudinal [m], lateral [m], heading [rad].
    """

    standstill_speed: NonNegative = 0.02
    moving_speed: NonNegative = 0.04
    standstill_time: NonNegative = 1.0
    turning_time: NonNegative = 5.0
    overdue_time: NonNegative = 4.0
    outside_time: NonNegative = 0.3
    outside_share: Annotated[float, Field(ge=1.0, le=1e12)] = 2.0
    settle_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.5
    settle_time: NonNegative = 0.75
    due_time: NonNegative = 0.3
    due_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.8
    cusp_tolerance: Tolerance = (0.1, 0.1, radians(3.0))
    cusp_reach: NonNegative = 0.5
    cusp_shift: Annotated[float, Field(ge=0.0, le=1.0)] = 0.7
    wheels_off: Positive = 0.1
    wheels_reach: NonNegative = 0.5
    calm_speed: NonNegative = 0.1
    near_stop: NonNegative = 0.2
    stop_tolerance: Tolerance = (0.2, 1.0, 0.5)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.moving_speed < self.standstill_speed:
            raise ValueError(
                f"moving_speed = {self.moving_speed} m/s must not be below "
                f"standstill_speed = {self.standstill_speed} m/s"
            )
        return self


class Retries(Settings):
    """What a vehicle does that does not get to its target in one go, or finds no plan.

    Attributes:
        replan_interval: time between two looks whether the way is free again, or whether there is a plan [s].
        give_up_time: a vehicle that stands so long without a first plan [s] says that it failed, and looks
            less often; stalled, it tries again where the obstacles have changed.
        accepted_miss: a first plan that ends within so many times the goal tolerance is driven; from rest
            another way is planned in place of one that misses by more.
    """

    replan_interval: NonNegative = 0.5
    give_up_time: NonNegative = 5.0
    accepted_miss: Annotated[float, Field(ge=1.0, le=1e12)] = 1.5


class ArrivalTiming(Settings):
    """When an arrival begins, how long it takes, and when it gets another time.

    Attributes:
        planned_share: what an arrival takes of the comfort acceleration, and of the speed that narrow places
            allow: the rest is for corrections on the way.
        least_time: shortest time to go that is planned [s]; closer in, the plan always ends this far ahead.
        waiting_reach: no arrival within reach waits until it is nearer than this [m]: (T2) leaves a slow
            vehicle no room to get across to a goal beside its path. With a speed limit of 0.5 m/s it began
            0.9 m before such a goal and stalled (docs/decisions/01-arrival-at-rest.md).
        late_reach: nearer to its target than this an arrival keeps its time [m].
        hurry_from: a plan that would take longer in comfort by more than this share gets more time; hurry: by
            which share it gets a second more each second.
        slack: a plan that would take less than this share of its time in comfort, and has that much more
            than its way takes, gets less; catching_up: so many seconds each second, at most.
        passed_distance: a vehicle that has passed its target by less than this [m] still has that way left.
        target_moved: a target that has moved by more than this is a new arrival [m].
        lost_cycles: after a gap of more cycles than this an arrival gets the time again that its way takes,
            and the vehicle may have done anything within its limits.
        kept_share: a search for an arrival keeps its time as long as this share of what the way takes is
            left; a vehicle whose speed brings it less than this share of its way in its time is slow for it.
        path_spacing: of the samples along a part, and of the pieces of the way ahead, at which the pace is
            known [m].
        least_pieces, most_pieces: in which the way ahead is looked at.
        steering_distance: way over which a step of the path's curvature is steered [m]: no vehicle turns its
            wheels on the spot.
        brisk_share: what an arrival of a brisk ride takes of the comfort acceleration. Nearly all: its time
            has the ramps for a reserve.
        brisk_bound: no plan of a brisk ride takes more than so many times the comfort acceleration.
        slowest: least factor on the speeds of a motion by which it is slowed down for a given docking time.
        cruise_step: in which a cruise is driven in thought for the expected docking time [s].
    """

    planned_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.9
    least_time: Positive = 1.0
    waiting_reach: NonNegative = 30.0
    late_reach: NonNegative = 2.0
    hurry_from: NonNegative = 0.03
    hurry: Positive = 0.2
    slack: Annotated[float, Field(gt=0.0, le=1.0)] = 0.9
    catching_up: NonNegative = 0.5
    passed_distance: NonNegative = 0.5
    target_moved: NonNegative = 0.1
    lost_cycles: Annotated[float, Field(ge=1.0, le=1e12)] = 2.5
    kept_share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    path_spacing: Annotated[float, Field(ge=0.01, le=10.0)] = 0.25
    least_pieces: Annotated[int, Field(ge=2, le=100_000)] = 64
    most_pieces: Annotated[int, Field(ge=2, le=100_000)] = 400
    steering_distance: Annotated[float, Field(ge=0.0, le=1000.0)] = 4.0
    brisk_share: Annotated[float, Field(gt=0.0, le=1.0)] = 0.98
    brisk_bound: Annotated[float, Field(ge=1.0, le=10.0)] = 1.1
    slowest: Annotated[float, Field(gt=0.0, le=1.0)] = 0.1
    cruise_step: Annotated[float, Field(gt=0.0, le=10.0)] = 0.25

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.most_pieces < self.least_pieces:
            raise ValueError(
                f"most_pieces = {self.most_pieces} must not be below least_pieces = {self.least_pieces}"
            )
        return self


class Search(Settings):
    """How a plan is sought, and what it has to fulfil to be driven.

    Attributes:
        iterations: real-time iterations of one search, at most; of one that misses the goal twice as many.
        first_iterations: from a first guess on, at least; settled: two of them are enough where the second
            has moved the plan by less than this for each second ahead [m/s].
        unsolved: from a first guess on so many QPs may remain unsolved.
        first_patience: from a first guess on a QP may take so many times the configured iterations;
            clean_patience: the same for a plan that is sought once more from a clean start.
        first_damping: weight on the change (`qp.filling.fill_cost`) from a first guess on: it may be far from
            the optimum, and what is far from a linearisation is not known to it; damping: the same from cycle
            to cycle, once it has come down to that; damping_share: of the last one, until then. By
            docs/decisions/05-damping-and-curvature.md.
        checked_span: beginning of a plan over which it has to obey the dynamics [s].
        position_defect, heading_defect: largest error of a plan against the dynamics over that span [m],
            [rad].
        input_excess: share of an input limit by which a solver's answer may pass it before it is cut.
        blocked_slack: corridor slack [m], on top of what the vehicle begins with, of a plan that goes through
            something rather than past it: it is not driven.
        seen_share: share of a cruise's plan up to which what stands in its way counts: it ends in mid-way,
            and has not seen enough of what is beyond.
        plan_age: a plan that is driven while another one is sought is iterated itself when it is older than
            this [s] (docs/decisions/06-sliced-solves.md).
    """

    iterations: Annotated[int, Field(ge=1, le=1000)] = 10
    first_iterations: Annotated[int, Field(ge=1, le=1000)] = 3
    settled: NonNegative = 0.02
    unsolved: Annotated[int, Field(ge=1, le=1000)] = 2
    first_patience: Annotated[int, Field(ge=1, le=1000)] = 10
    clean_patience: Annotated[int, Field(ge=1, le=1000)] = 3
    first_damping: NonNegative = 1e-2
    damping: NonNegative = 1e-4
    damping_share: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.5
    checked_span: Positive = 2.0
    position_defect: Positive = 0.05
    heading_defect: Positive = radians(2.0)
    input_excess: NonNegative = 0.02
    blocked_slack: NonNegative = 0.3
    seen_share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    plan_age: NonNegative = 0.2

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.first_iterations > self.iterations:
            raise ValueError(
                f"first_iterations = {self.first_iterations} must not be above iterations = {self.iterations}"
            )
        return self


class Guesses(Settings):
    """The shape of a first guess: how it comes to the path.

    Attributes:
        fade_distance: over which an offset at the start or at the target fades into the path [m], at least.
        fade_curvature: with which a large offset at the start begins to fade [1/m]: the end that trails
            swings out.
        fade_heading: a heading from the path beyond this fades like this [rad] (60 deg).
        astray: a start at which the heading goes astray by more than this while the steering turns to where
            the fade needs it [rad] has the steering turned first.
        least_stretch: way beside a bend's inside per way of the path, at least: the guess must not run into
            the centre.
    """

    fade_distance: Positive = 12.0
    fade_curvature: Positive = 0.1
    fade_heading: Annotated[float, Field(gt=0.0, le=1.5)] = 1.05
    astray: NonNegative = 0.05
    least_stretch: Annotated[float, Field(gt=0.0, le=1.0)] = 0.2
