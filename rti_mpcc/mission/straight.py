"""A straight move with hardly any steering, and whether the errors at its start can be corrected on it.

With wheels of at most delta a bicycle of wheelbase L changes its heading by at most
k = tan(delta)/L for each metre. From a lateral error y0 and a heading error h0 it comes, over l metres in the
direction d = +1 or -1, to any heading error h1 with |h1 - h0| <= k l, and with that to any lateral error of

(L1)  |y1 - (y0 + d l (h0 + h1)/2)| <= k l²/4 - (h1 - h0)²/(4 k):

at the bounds it turns as sharply as it can one way first, and then the other.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import degrees, inf, tan

import numpy as np

from geometry import Area, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome, Segment, SegmentEnd
from rti_mpcc.mission.state import MissionState
from rti_mpcc.mission.step import (
    DrivingStep,
    Next,
    Signal,
    Started,
    StepStart,
    all_positive,
    check_distance,
    refuse_unless,
)
from rti_mpcc.model.footprint import body_of
from rti_mpcc.orders import Follow, Stand
from rti_mpcc.world.goals import GoalTerms

SPACING = 0.05
"""Distance of the poses on a straight move or a route out at which the clearance is checked [m]."""
STRAIGHT_END = 0.03
"""Longitudinal tolerance of a straight move's end [m]: a contact is no farther."""
_BESIDE = 1.0  # an obstacle farther from the body is not beside it [m]


@dataclass(frozen=True, slots=True)
class Straight(DrivingStep):
    """Drive straight on: along the axis of the dock that the vehicle stands at, else along its heading.

    Attributes:
        distance: at most LONGEST [m], negative in reverse.
        speed: at most [m/s]; steering: angle of the wheels, at most [rad].
        tolerance: lateral [m] and heading [rad] error at its end, at most. It is not started where the errors
            are too large to be corrected on it. None: any errors.
        until: signal that it is over before its distance, a contact say; None: there is none.
    """

    word = "straight"
    from_rest = True
    distance: float
    speed: float = field(default=0.2, kw_only=True)
    steering: float = field(default=0.05, kw_only=True)
    tolerance: tuple[float, float] | None = field(default=None, kw_only=True)
    until: Signal | None = field(default=None, kw_only=True)

    def _check(self) -> None:
        check_distance(self.distance, self)
        for name in ("speed", "steering"):
            refuse_unless(0.0 < getattr(self, name) < inf, self, name, "must be > 0, and finite")
        two = "must be two numbers > 0: lateral [m], heading [rad]"
        refuse_unless(all_positive(self.tolerance), self, "tolerance", two)

    def start(self, at: StepStart) -> Started:
        """Drive along the axis of the dock at which the vehicle stands, or along its own heading."""
        mission_state, dock_state = at.mission_state, at.mission_state.dock_state
        axis = dock_state.pose if dock_state is not None and dock_state.reached else None
        order, problem = straight_order(self, axis, at.here, at.area, at.config)
        if order is None:
            return Started(mission_state, Stand(), problem=problem)
        if dock_state is not None and dock_state.reached:
            mission_state = replace(mission_state, dock_state=replace(dock_state, joined=True))
        return Started(mission_state, order, order.manoeuvre.goal, axis)

    def succeeded(self, mission_state: MissionState, direction: int) -> Next:
        """Stop at once: it may be in contact."""
        return Next(mission_state, Stand(at_once=True))


def straight_order(
    step: Straight, axis: Pose2 | None, here: Pose2, area: Area | None, config: ControllerConfig
) -> tuple[Follow | None, str]:
    """The order to drive it, or None and why it cannot be started.

    Args:
        axis: dock at which the vehicle stands: the move is along its axis, and ends `distance` from it. None:
            along the vehicle's own heading.
    """
    line = here if axis is None else axis
    error = here.relative_to(line)
    left = step.distance - error.x
    if left * step.distance <= 0.0:
        return None, f"the vehicle stands at {error.x:.3f} m of the move, beyond its end"
    curvature = tan(min(step.steering, config.limits.steering)) / config.vehicle.wheelbase
    if step.tolerance is not None and not is_correctable(error, left, curvature, step.tolerance):
        return None, (
            f"the errors are too large to be corrected over {abs(left):.2f} m: "
            f"lateral {error.y:.3f} m, heading {degrees(error.phi):.2f} deg"
        )
    return _order(step, line, error.x, here, area, config), ""


def is_correctable(error: Pose2, length: float, curvature: float, tolerance: tuple[float, float]) -> bool:
    """Whether an error across a straight move can come within a tolerance on it, (L1).

    Args:
        error: lateral [m] and heading [rad] at its start.
        length: [m], negative in reverse; curvature: at most [1/m]; tolerance: lateral [m], heading [rad].
    """
    lateral, heading = tolerance
    turn = curvature * abs(length)
    low, high = max(-heading, error.phi - turn), min(heading, error.phi + turn)
    if low > high:
        return False
    for end in np.linspace(low, high, 21).tolist():
        straight = error.y + 0.5 * (error.phi + end) * length
        turned = 0.0 if end == error.phi else 0.25 * (end - error.phi) ** 2 / curvature
        swing = 0.25 * curvature * length**2 - turned
        if abs(straight) - max(swing, 0.0) <= lateral:
            return True
    return False


def _order(
    step: Straight, line: Pose2, start: float, here: Pose2, area: Area | None, config: ControllerConfig
) -> Follow:
    direction = 1 if step.distance > 0.0 else -1
    pieces = [(direction, 0.0, abs(step.distance - start))]
    path = ReferencePath.from_segments(start=line.compose(Pose2(start, 0.0, 0.0)), segments=pieces)
    lateral, heading = step.tolerance or config.goal_tolerance[1:]
    tolerance = (STRAIGHT_END, lateral, heading)
    segment = Segment(
        part=path.parts[0],
        index=0,
        end=SegmentEnd.GOAL,
        tolerance=tolerance,
        speed=step.speed,
        steering=step.steering,
        wheels=0.0,
        margin=_clearance(path, area, config),
    )
    manoeuvre = Manoeuvre(
        start=here, goal=path.end, outcome=PlanOutcome.FOUND, segments=(segment,), nearest=0.0
    )
    return Follow(manoeuvre=manoeuvre, terms=GoalTerms(tolerance=tolerance, detected=False))


def _clearance(path: ReferencePath, area: Area | None, config: ControllerConfig) -> float | None:
    """Least clearance of a body on the path [m]; None: more than enough, or not known."""
    if area is None:
        return None
    (part,) = path.parts
    on_path = part.reference(part.places(SPACING))
    poses = np.column_stack([on_path.x, on_path.y, on_path.phi])
    least = float(area.grid.signed_distances(body_of(config.vehicle), poses, _BESIDE)[:, 0].min())
    return None if least >= config.clearance.wanted else max(least, 0.0)
