"""Dock: drive to a dock, whose pose is known or detected, and stand there."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
import shapely
from numpy.typing import ArrayLike

from estimation import CharucoBoard
from geometry import Pose2
from geometry.outline import checked_polygon, outline_at
from geometry.validation import Validated, validate, validated
from rti_mpcc.mission.state import DockState, MissionState, PendingStep
from rti_mpcc.mission.step import (
    LONGEST,
    THREE,
    DrivingStep,
    Next,
    Started,
    StepStart,
    all_positive,
    refuse_unless,
)
from rti_mpcc.mission.straight import Straight
from rti_mpcc.mission.undock import Undock
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.orders import GoTo, Resume, Stand
from rti_mpcc.state import ControllerState, Phase
from rti_mpcc.types import Array
from rti_mpcc.world.goals import GoalTerms

QUARTER = 4
"""Corners of a quarter of a circle around where something may be."""


class DockKind(Enum):
    """How the pose of a dock is known."""

    KNOWN = "known"
    """It is at the given pose."""
    DETECTED = "detected"
    """By detections: the given pose is where it is expected."""
    CHARUCO = "charuco"
    """By detections of its ChArUco board in the pictures of a camera."""


@dataclass(frozen=True, slots=True)
class Approach(Validated):
    """The straight last piece of the route into a dock.

    Attributes:
        length: at most LONGEST [m]; direction: +1 forward, -1 in reverse.
    """

    length: float
    direction: int

    def __post_init__(self) -> None:
        validate(self)
        far = f"must be > 0 and at most {LONGEST:g} m"
        either = "must be 1 (forward) or -1 (in reverse)"
        refuse_unless(0.0 < self.length <= LONGEST, self, "length", far)
        refuse_unless(self.direction in (1, -1), self, "direction", either)


@dataclass(frozen=True, slots=True, eq=False)
class Dock(DrivingStep):
    """Drive to a dock and stand there.

    Attributes:
        pose: of the rear axle of the docked vehicle, world frame; None: the controller's own goal.
        name: of the dock, for readers.
        kind: see `DockKind`; None: as the controller's settings say.
        board: at the dock, of a `CHARUCO` dock.
        approach: see there; None: any route into it.
        tolerance: longitudinal [m], lateral [m], heading [rad]; None: that of the settings.
        body: outline (k, 2) [m] of the docked object, in the frame of `pose`: an obstacle in every step but
            `Straight`, where the dock is detected. None: there is none.
        contact: the move that ends in contact, to be put into a mission behind it; None: there is none.
        uncertainty: largest error of `pose` in its position [m] and heading [rad]: detections beyond it are
            rejected, and the route keeps clear of wherever `body` may be, but on the straight approach, on
            which the dock has to be detected.
    """

    word = "dock"
    keys = ("approach", "tolerance", "uncertainty")
    at_goal = True
    pose: Pose2 | None = None
    name: str = field(default="", kw_only=True)
    kind: DockKind | None = field(default=None, kw_only=True)
    board: CharucoBoard | None = field(default=None, kw_only=True)
    approach: Approach | None = field(default=None, kw_only=True)
    tolerance: tuple[float, float, float] | None = field(default=None, kw_only=True)
    body: ArrayLike | None = field(default=None, kw_only=True)
    contact: Straight | None = field(default=None, kw_only=True)
    uncertainty: tuple[float, float] | None = field(default=None, kw_only=True)

    def _check(self) -> None:
        refuse_unless(all_positive(self.tolerance), self, "tolerance", THREE)
        certain = self.uncertainty is None or (self.body is not None and self.approach is not None)
        pair = "must be two numbers > 0, [m] and [rad], of a dock with a body and an approach"
        refuse_unless(certain and all_positive(self.uncertainty), self, "uncertainty", pair)
        fits = (self.kind is DockKind.CHARUCO) == (self.board is not None)
        refuse_unless(fits, self, "board", "a charuco dock has one, and no other")
        for name in ("tolerance", "approach", "kind"):
            good = self.pose is not None or getattr(self, name) is None
            refuse_unless(good, self, name, "only of a dock with a pose, to which a route is planned")
        if self.body is not None:
            checked_polygon(self.body, "Dock.body")

    def keep_out(self) -> tuple[tuple[tuple[float, float], ...], ...]:
        """Outlines of where the body may be, corners x, y [m]; none where its place is certain."""
        if self.uncertainty is None or self.pose is None or self.body is None:
            return ()
        far, turn = self.uncertainty
        poses = [replace(self.pose, phi=self.pose.phi + angle) for angle in (-turn, 0.0, turn)]
        bodies = shapely.MultiPoint(np.concatenate([outline_at(self.body, pose) for pose in poses]))
        around = bodies.convex_hull.buffer(far, quad_segs=QUARTER)
        return (tuple((x, y) for x, y in shapely.get_coordinates(around)[:-1].tolist()),)

    @validated(late=True)
    def body_at(self, pose: Pose2) -> Array | None:
        """The outline (k, 2) of the body, where the dock is at this pose; None: there is none."""
        return None if self.body is None else outline_at(self.body, pose)

    @property
    def detects(self) -> bool:
        """Whether its pose is not known."""
        return self.kind is not DockKind.KNOWN

    @property
    def takes_goal(self) -> bool:
        """Whether it has no pose of its own."""
        return self.pose is None

    @property
    def body_at_pose(self) -> Array | None:
        """The outline of its body at its pose."""
        return None if self.pose is None else self.body_at(self.pose)

    def start(self, at: StepStart) -> Started:
        """Drive to the dock; without a route, on to the goal of the controller's path."""
        mission_state, s, config, area = at
        # That of its path, or given on the way.
        own = self.pose is None and mission_state.own_goal == s.goal.planned
        if own or area is None:
            order = Resume() if s.task.phase is Phase.WAITING else None
            return Started(mission_state.at(None), order, s.goal_pose, s.goal_pose)
        known = self.pose or mission_state.unused_goal or mission_state.own_goal
        goal = known or (None if s.route is None else s.route.end)
        if goal is None:
            return Started(mission_state, Stand(), problem="no goal was given")
        dock_state = DockState(dock=self, place=mission_state.pending[0].place, pose=goal, body_at=goal)
        mission_state = mission_state.at(dock_state)
        here = at.here
        body = body_polygons(np.array([[here.x, here.y, here.phi]]), config.vehicle)[0]
        near = shapely.Polygon(body).buffer(config.clearance.on_routes)
        # Not where the vehicle stands already.
        keep_out = tuple(each for each in self.keep_out() if not near.intersects(shapely.Polygon(each)))
        terms = GoalTerms(
            tolerance=self.tolerance,
            detected=None if self.kind is None else self.kind is not DockKind.KNOWN,
            approach=None if self.approach is None else (self.approach.length, self.approach.direction),
            uncertainty=self.uncertainty,
            keep_out=keep_out,
        )
        return Started(mission_state, GoTo(goal=goal, terms=terms), goal, goal)

    def observed(self, mission_state: MissionState, s: ControllerState) -> MissionState:
        """With the present pose of the dock; of a dock without a pose also the goal that was given.

        Where that was not known at the start of the step, it is where the step is to end.
        """
        pose = s.goal_pose
        if pose is None:
            return mission_state
        dock_state = mission_state.dock_state
        if dock_state is None:
            dock_state = DockState(dock=self, place=mission_state.pending[0].place, pose=pose, body_at=pose)
            mission_state = mission_state.at(dock_state)
        own = s.goal.planned if self.pose is None else mission_state.own_goal
        *before, record = mission_state.log
        if record.goal is None:
            record = replace(record, goal=pose, dock=pose)
        return replace(
            mission_state, dock_state=replace(dock_state, pose=pose), own_goal=own, log=(*before, record)
        )

    def succeeded(self, mission_state: MissionState, direction: int) -> Next:
        """The vehicle stands at the dock."""
        dock_state = mission_state.dock_state
        if dock_state is None:
            return Next(mission_state)
        there = replace(dock_state, reached=True, incoming_direction=direction)
        return Next(replace(mission_state, dock_state=there))

    def before_retry(
        self, pending: PendingStep, mission_state: MissionState, back_off: float
    ) -> tuple[PendingStep, ...]:
        """Drive out of the dock first."""
        dock_state = mission_state.dock_state
        if dock_state is None:
            return (pending,)
        if dock_state.place == pending.place:
            pending = replace(pending, step=replace(self, pose=self.pose or dock_state.pose))
        incoming = dock_state.incoming_direction or (0 if self.approach is None else self.approach.direction)
        if not (incoming and dock_state.reached):
            return (pending,)
        distance = -incoming * (back_off if self.approach is None else max(self.approach.length, back_off))
        return PendingStep(step=Undock(distance, then="continue"), place=pending.place), pending
