"""What is known in a cycle of the vehicle, its goal and its surroundings, and what it was commanded."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TypeVar

from estimation import DisturbanceEstimate, GoalEstimate, PoseHistory
from estimation.actuators import ActuatorRecord
from geometry import Pose2
from rti_mpcc.model.actuators import UNDISTURBED, Actuation, Actuators, Disturbance, QueuedCommand
from rti_mpcc.types import GoalOrigin
from rti_mpcc.world.goals import NO_TERMS, GoalFit, GoalTerms
from rti_mpcc.world.monitor import StateMonitor
from rti_mpcc.world.standstill import AxisMotion
from rti_mpcc.world.surroundings import Surroundings

SETTLING_BY_POSE = 0.5  # [s]; with 0.35 a drive that creeps and lags by 0.4 s still swings


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockState:
    """The controller's own clock, which never runs back.

    Attributes:
        now: time of this cycle [s]; started: there was a first one.
        offset: how far it is ahead of the user's clock [s].
        shown: last time on the user's clock [s]; stood: number of cycles in which that did not change.
    """

    now: float = 0.0
    started: bool = False
    offset: float = 0.0
    shown: float | None = None
    stood: int = 0


@dataclass(frozen=True, kw_only=True)
class VehicleEstimate:
    """The estimate of the vehicle.

    Attributes:
        monitor: its state, and why a measurement is doubted.
        offsets: the estimate of the disturbance, or None; disturbance: by it, none where it is not known.
        poses: of the last moments.
        heading_hint: remark on the first measured heading, or "".
        actuators: dead times and lags of drive and steering; records: what is learnt of both.
        standing_since: when it came to rest, or restarted at rest [s]; None while it moves.
        motion: along its axis, of the last moments.
    """

    monitor: StateMonitor = field(default_factory=StateMonitor)
    offsets: DisturbanceEstimate | None = None
    disturbance: Disturbance = UNDISTURBED
    poses: PoseHistory = field(default_factory=PoseHistory)
    heading_hint: str = ""
    actuators: Actuators = field(default_factory=Actuators)
    records: tuple[ActuatorRecord, ActuatorRecord] = (ActuatorRecord(), ActuatorRecord())
    standing_since: float | None = None
    motion: AxisMotion = field(default_factory=AxisMotion)

    @cached_property
    def dead_time(self) -> float:
        """From a command until it acts [s]."""
        return self.actuators.dead_time

    @property
    def braking_delay(self) -> float:
        """From a command to brake until the drive has answered it [s]."""
        return self.actuators.dead_time + self.actuators.drive.lag

    @property
    def settling(self) -> float:
        """Time constant with which the last of a stop has to be taken out [s], or 0: as usual.

        A speed that the pose tells, without the sensor or below its dead band, comes late: taken out as usual
        it would swing for ever.
        """
        by_pose = self.monitor.sensors.speed.problem != "" or self.motion.unseen != 0.0
        return SETTLING_BY_POSE if by_pose else 0.0

    @cached_property
    def stands(self) -> bool:
        """Whether it stands."""
        return self.standing_since is not None

    def is_stationary(self, now: float, seconds: float = 0.0) -> bool:
        """Whether it has been standing for `seconds` at `now` [s]."""
        return self.standing_since is not None and now - self.standing_since >= seconds


@dataclass(frozen=True, kw_only=True)
class GoalState:
    """What is known of the goal.

    Attributes:
        planned: the user's goal pose, or None for the path's last pose; dock: the first one of its dock.
        given: the user's goal as given last; averaged_at: when it was averaged [s] (`steadied`), or None.
        fit, given_fit: the checks of the planned goal and of the given one; None: not checked yet.
        origin: of the planned goal; refusal: why the given goal was rejected, or "".
        pose: the setpoint: `planned`, or by detections; None for the path's last pose.
        estimate: by detections, or None; estimated_at: when [s]; estimate_fit: its check, or None.
        detected: the last detected goal that passed its check, or None.
        undetected: why the last detection was rejected, while none was accepted, or "".
        waiting: the vehicle stops, or stands, before a goal that is not known well enough.
        terms: of the goal, in place of the settings.
    """

    planned: Pose2 | None = None
    dock: Pose2 | None = None
    given: Pose2 | None = None
    averaged_at: float | None = None
    fit: GoalFit | None = None
    given_fit: GoalFit | None = None
    origin: GoalOrigin = GoalOrigin.PATH_END
    refusal: str = ""
    pose: Pose2 | None = None
    estimate: GoalEstimate | None = None
    estimated_at: float | None = None
    estimate_fit: GoalFit | None = None
    detected: Pose2 | None = None
    undetected: str = ""
    waiting: bool = False
    terms: GoalTerms = NO_TERMS

    @cached_property
    def accepted(self) -> bool:
        """Whether a given or detected goal was accepted."""
        return self.origin is GoalOrigin.GIVEN or self.detected is not None

    @cached_property
    def rejected(self) -> bool:
        """Whether the given goal was rejected, and no other one was accepted."""
        return self.refusal != "" and not self.accepted


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """What is known in a cycle; the base of all that it leaves to the next.

    Attributes:
        area: the free space, with the obstacles that were given last.
        queue: commands that do not act yet, as they will act; sent: the last ones, as they were sent.
    """

    clock: ClockState = ClockState()
    vehicle: VehicleEstimate = field(default_factory=VehicleEstimate)
    goal: GoalState = GoalState()
    area: Surroundings
    queue: tuple[QueuedCommand, ...] = ()
    sent: tuple[Actuation, ...] = ()


W = TypeVar("W", bound=World)
"""What is known, and what is kept with it."""
