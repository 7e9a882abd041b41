"""What the optimal control problem asks for, how it covers the body, and how its QPs are solved."""

from __future__ import annotations

from math import radians, sqrt
from typing import Annotated

from pydantic import Field

from geometry.doors import door
from geometry.settings import NonNegative, Positive, Settings, Triple


class Weights(Settings):
    """Weights of the cost (paper Eq. 2, 5, 7 to 11, Table I), and from where on its terms act.

    Each weight may be 0, which switches its term off.

    Attributes:
        lag, contouring, heading: q_l, q_c [1/m²] and the heading error's weight [1/rad²].
        acceleration, steering_rate, virtual_speed: r, per squared unit of the control. A virtual_speed of
            None is the one with which the progress reward has its best at the cruise speed, so that no
            bound has to hold the vehicle back; 0 (Table I) rewards up to the speed limit.
        progress_reward: gamma [s/m], on theta_dot.
        goal: q_N^e on x, y, heading of the last stage while a goal pose is contoured to.
        contouring_at_end: q_c^e, the contouring weight at a cusp or path end that is the goal (Eq. 8).
        transition_slope, transition_reach: alpha [1/m] and beta [m] of the weight transition sigma.
        lateral_acceleration: on (v² tan(delta)/L)² [s⁴/m²] (published code).
        heading_at_end: heading weight near a cusp or path end (published code).
        terminal_lag, terminal_heading: extra weights at the last stage (published code).
        bound_distance: on (bound_distance_reach - distance of the rear axle to the boundary)²;
            bound_distance_reach: it acts on less than this [m] (published code, both).
        bound_speed: on v² (bound_speed_reach - distance of the rear axle to the boundary)²;
            bound_speed_reach: it acts on less than this [m] (published code, both).
        stage_length: the stage length that the stage weights belong to [s]: a stage of h counts
            h / stage_length times. 0.1 s is the printed sum, 1 s the published code's integral.
        arrival_pose, arrival_speed: on position [1/m²], heading [1/rad²] and speed [s²/m²] at the
            end of a planned arrival.
        arrival_wheels: on the angle of the wheels at the end of a planned arrival, where the next segment
            begins with another one [1/rad²].
        arrival_contouring: contouring weight far from the goal during an arrival.
        comfort, arrival_comfort: on the squared excess over comfort, in the order of `Comfort` [s⁴/m²],
            [s⁴/m²], [s²/rad²], while contouring and during an arrival.
        comfort_ease: share of a comfort value over which its penalty sets in, (C4). A penalty that begins at
            once makes the plans of successive cycles jump to and fro across it.
        comfort_clip: what goes beyond comfort costs its square up to here, in its own units, then linearly:
            comfort gives way to the corridor and the goal.
        goal_clip: what the pull of a goal counts at most, position [m] and heading [rad]: beyond it the cost
            grows linearly (Huber), so that its pull has a bound that the corridor's exact penalty can exceed.
        firm_time: time to go [s] below which an arrival's effort counts less and less, as its cube. The error
            that a plan accepts at the goal to save effort grows with 1/t_go³: without this it is all of the
            way left at 1 s (docs/decisions, 1).
    """

    lag: NonNegative = 1e3
    contouring: NonNegative = 1.0
    heading: NonNegative = 0.0
    acceleration: NonNegative = 1e3
    steering_rate: NonNegative = 100.0
    virtual_speed: NonNegative | None = None
    progress_reward: NonNegative = 100.0
    goal: Triple = (1e4, 1e4, 1e4)
    contouring_at_end: NonNegative = 100.0
    transition_slope: Positive = 1.0
    transition_reach: NonNegative = 10.0
    lateral_acceleration: NonNegative = 0.0
    heading_at_end: NonNegative = 0.0
    terminal_lag: NonNegative = 0.0
    terminal_heading: NonNegative = 0.0
    bound_distance: NonNegative = 0.0
    bound_distance_reach: Positive = 2.0
    bound_speed: NonNegative = 0.0
    bound_speed_reach: Positive = 2.5
    stage_length: Positive = 0.1
    arrival_pose: Positive = 1e5
    arrival_speed: NonNegative = 8e5
    arrival_wheels: NonNegative = 1e3
    arrival_contouring: NonNegative = 0.0
    comfort: Triple = (1e5, 1e5, 1e4)
    arrival_comfort: Triple = (0.0, 1e5, 1e5)
    comfort_ease: Positive = 0.05
    comfort_clip: Positive = 0.1
    goal_clip: tuple[Positive, Positive] = (0.5, 0.3)
    firm_time: Positive = 5.0


class SpeedProfile(Settings):
    """Bound on |v| and theta_dot that falls towards the stop point (published code).

    Attributes:
        final: speed allowed at the stop point [m/s].
        deceleration: how the bound falls [m/s²]: v² <= final² + 2 deceleration (theta_stop - theta).
        behind: for a goal behind the path end, the share of the speed from which `deceleration` stops over
            the way behind it: so fast the vehicle may be at the stop point, if that is more than `final`.
    """

    final: Positive = 1.0
    deceleration: Positive = 5.0
    behind: NonNegative = 0.5

    @door(late=True)
    def at_stop(self, behind: float) -> float:
        """Speed allowed at the stop point [m/s], the goal lying `behind` [m] the path end (0: not)."""
        return max(self.final, self.behind * sqrt(2.0 * self.deceleration * max(behind, 0.0)))


class Footprint(Settings):
    """How the corridor rows keep the body from what stands.

    Attributes:
        pieces: boxes of equal length that the body is cut into, each with a half-plane for each side.
        margin: distance kept all round the body [m].
        near: what is farther from a piece than the margin and this acts on it in no way [m].
        outward: of the points of a piece that are about equally near to a side the one farther out along the
            body counts, by so much of how much farther out it is: a turn that brings nearer which of them is
            nearer, in rad (docs/decisions, 8).
        corner: where a half-plane turns by more than this between two stages a corner is passed [rad];
            between: so many poses on the way there are looked at, too.
    """

    pieces: Annotated[int, Field(ge=1, le=20)] = 2
    margin: Annotated[float, Field(ge=0.0, le=10.0)] = 0.1
    near: Positive = 1.0
    outward: Annotated[float, Field(ge=0.0, le=0.5)] = 0.02
    corner: Annotated[float, Field(gt=0.0, le=1.5)] = radians(18.0)
    between: Annotated[int, Field(ge=0, le=100)] = 7


class NarrowPassage(Settings):
    """The margin and the speed between walls that face each other, (H8) and (P2) (docs/decisions, 11).

    Attributes:
        facing: walls face each other if the cosine between their normals is below this.
        strip: left to either side to steer in, of what is between two walls [m]: rows that all bind say the
            same.
        speed: with which the least room is driven through [m/s].
        reaction_time: so much faster a vehicle drives for each metre of room more, 1 / reaction_time [s]: who
            drives with a heading that is off by 0.1 rad for a second comes nearer to a wall by 0.1 s times
            the speed.
        spacing: between the places on a part at which the room is looked up [m]; the pieces of the body are
            longer.
        obstacle_reach: obstacles farther than this from the path leave it its room [m].
    """

    facing: Annotated[float, Field(ge=-1.0, le=0.0)] = -0.5
    strip: NonNegative = 0.03
    speed: Positive = 0.3
    reaction_time: Positive = 0.1
    spacing: Annotated[float, Field(ge=0.01, le=100.0)] = 0.5
    obstacle_reach: Positive = 8.0


class BoundRelaxation(Settings):
    """How bounds and corridor are given back that the measured state has taken, (H4) (docs/decisions, 9).

    Attributes:
        margin_time: so long the plan may take to give back the corridor's margin [s]. Over 3 s or 5 s the
            vehicle came nearer to walls, and steered harder all the same.
        margin_distance: S, over which it is given back, as far as the room that the trailing end needs for
            that goes [m].
        boundary_distance: over which a body that is over a boundary is brought back, once it has turned [m].
        far_share: of the margin, that must be missing for a vehicle to be far outside; far_speed: one that is
            so many times as fast as its limit is braked at any jerk.
        patience: while it is, a QP may take so many times the configured iterations at least: what presses it
            back in at all stages adds up, and it takes the solver long to find how much.
        turning_share: of a steering rate beyond comfort that the last plan had, which the next one may have
            there, (J3). Less than 1: what the solver is off by is not to add up.
    """

    margin_time: Positive = 1.5
    margin_distance: Positive = 3.5
    boundary_distance: Positive = 10.0
    far_share: NonNegative = 0.1
    far_speed: Annotated[float, Field(ge=1.0, le=1e12)] = 1.1
    patience: Annotated[int, Field(ge=1, le=1000)] = 10
    turning_share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.99


class AdmmSettings(Settings):
    """How OSQP steps.

    Attributes:
        rho: its first step-size parameter, which it adapts; over_relaxation: its alpha.
        fine: it is to come to the fine tolerance in its first iterations.
        rows_scaled: bounds that are far off count less, see `SolverSettings.row_scaling_from`.
    """

    rho: Positive = 0.1
    over_relaxation: Annotated[float, Field(gt=0.0, lt=2.0)] = 1.6
    fine: bool = False
    rows_scaled: bool = False


class SolverSettings(Settings):
    """How QPs are scaled, and settings of OSQP (docs/decisions, 4 and 6).

    Attributes:
        tolerance: absolute and relative termination tolerance, on the scaled problem.
        fine_tolerance: the same for the first `fine_iterations` of a QP that goes on from the one before: a
            shape that costs little changes by little from cycle to cycle, and never comes to its best where
            that is within the tolerance. What is not that good by then has to reach `tolerance`.
        max_iterations: of one QP; a QP that needs more is not accepted.
        slice_iterations: so many are done in one go, then the step size is adapted, and it is asked whether
            to go on. OSQP's own time limit stops anywhere, which could not be played back.
        check_interval: iterations between two termination checks.
        polish: refine the active set's solution (off on the vehicle, on for reference solutions).
        warm: steps where a QP goes on from the one before. Rows that are equalities or far from their bounds,
            most of them, settle by |1 - over-relaxation| an iteration: with OSQP's 1.6 that alone takes 20
            iterations, with 1 a QP near its guess takes 3 (docs/decisions, 4).
        cold: from a first guess, where rows come to act that are far from it: there may be hundreds of
            iterations to do, the fewest with a larger first step.
        retry: once more from a clean start. What did not come to its end the first time mostly has
            multipliers at the slack's weight, a thousand times the usual ones, to which small steps take too
            long (docs/decisions, 4).
        change_weight: on every change, in scaled units of variables and cost.
        idle_weight: on the change of progress where no Frenet cost acts on it: it just goes on as planned.
        bound_unit: bounds on states and controls count in so many units. Each row drags on the solver's steps
            like a proximal term, active or not; with small rows those that are far from active hardly do,
            which makes the difference between 400 and 50 iterations.
        row_scaling_from: an inequality farther from its bound than this, in units of its row, counts in
            proportion to that: k times less at a distance of k times this. A plan whose shape costs little
            would be held by bounds that are far off for hundreds of iterations (docs/decisions, 4). A row
            that does come to act from afar takes long: with a first guess none is scaled down.
        row_scaling_most: largest k, for bounds at infinity.
    """

    tolerance: Annotated[float, Field(gt=0.0, le=0.1)] = 5e-4
    fine_tolerance: Annotated[float, Field(gt=0.0, le=0.1)] = 1e-6
    fine_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 6
    max_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 400
    slice_iterations: Annotated[int, Field(ge=1, le=1_000_000)] = 48
    check_interval: Annotated[int, Field(ge=1, le=1000)] = 6
    polish: bool = False
    warm: AdmmSettings = AdmmSettings(over_relaxation=1.0, fine=True, rows_scaled=True)
    cold: AdmmSettings = AdmmSettings(rho=1.0)
    retry: AdmmSettings = AdmmSettings(rho=10.0)
    change_weight: Positive = 1e-6
    idle_weight: NonNegative = 1e-2
    bound_unit: Positive = 10.0
    row_scaling_from: Positive = 0.02
    row_scaling_most: Annotated[float, Field(ge=1.0, le=1e12)] = 1e4
