"""What goes into the controller and what comes out of it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from estimation import GoalEstimate, Judgement
from geometry import InputError, Pose2
from geometry.arrays import Array as Array
from geometry.arrays import Complex as Complex
from geometry.arrays import Index as Index
from geometry.arrays import locked
from geometry.validation import Validated, to_rows, validate


@dataclass(frozen=True, slots=True)
class VehicleState:
    """Measured state of the vehicle; the reference point is the middle of the rear axle.

    Attributes:
        x, y: position [m] in the world frame.
        phi: heading [rad], any branch.
        v: speed [m/s], negative in reverse.
        delta: steering angle [rad] of the bicycle's front wheel, positive to the left.
    """

    x: float
    y: float
    phi: float
    v: float
    delta: float


FASTEST = 100.0  # [m/s], [rad/s], of an obstacle that says how it moves


@dataclass(frozen=True, slots=True, eq=False)
class Obstacle(Validated):
    """An obstacle that says how it moves. NumPy takes it for its outline, as a bare polygon.

    Attributes:
        polygon: corners (m, 2) [m] where it is now, world frame; two of a line, one of a point.
        velocity: (vx, vy) of its middle [m/s]; (0, 0): it stands; None: found from cycle to cycle, as of a
            bare polygon.
        turn_rate: about its middle, counter-clockwise [rad/s].
        name: in reasons; "": its place in the list.

    Raises:
        InputError: a value that is no number, or out of range.
    """

    polygon: ArrayLike
    velocity: tuple[float, float] | None = None
    turn_rate: float = 0.0
    name: str = ""

    def __post_init__(self) -> None:
        validate(self)
        corners = locked(to_rows(self.polygon, 2, "Obstacle.polygon"))
        object.__setattr__(self, "polygon", corners)
        for name, each in (("velocity", self.velocity or ()), ("turn_rate", (self.turn_rate,))):
            if not all(abs(value) <= FASTEST for value in each):
                given = getattr(self, name)
                raise InputError(f"Obstacle.{name} = {given}: must be finite, and at most {FASTEST:g}")

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        return np.array(self.polygon, dtype=dtype)


class Objective(Enum):
    """What the QP of a cycle asks for."""

    CONTOURING = "contouring"
    ARRIVAL = "arrival"
    CARTESIAN = "Cartesian"
    """The goal pose alone, of methods that the paper compares (`rti_mpcc.paper`)."""


class Status(Enum):
    """What the controller is doing, and why."""

    FOLLOWING = "following"
    """Contouring along the path; the goal or cusp does not shape the plan's end yet."""
    ARRIVING = "arriving"
    """Driving a planned arrival at rest at the goal or cusp, or at a stop in front of an obstacle."""
    SETTLING = "settling"
    """Inside the goal tolerance (or at the cusp), braking to a standstill."""
    DOCKED = "docked"
    """Standing inside the tolerance of the goal that was given last."""
    CHANGING_DIRECTION = "changing direction"
    """Standing at a cusp until the queued commands have acted and its dwell is over."""
    STARTING = "starting"
    """Searching the first plan of a segment, at rest or braking."""
    BLOCKED = "blocked"
    """The body overlaps something, or the plan is not clear over the distance of a stop: braking; or standing
    in front of what blocks the route."""
    GOAL_LOST = "goal lost"
    """The goal has not been seen for long and is too uncertain to dock at: stopping in front of it."""
    GOAL_REJECTED = "goal rejected"
    """The given goal was not accepted: standing, or braking to a standstill, if there is no previous goal, or
    standing at that one."""
    SEARCHING = "searching"
    """Standing at the planned goal, which no accepted detection has shown yet."""
    WAITING = "waiting"
    """Standing, or braking to a standstill, as commanded: in a mission that waits, or is cancelled."""
    PLANNING = "planning"
    """Standing until a route to the goal is planned, or until there is a goal."""
    STALLED = "stalled"
    """Standing outside the goal tolerance with no plan that would end inside it; `reason` says why."""
    GOAL_BEHIND = "goal behind"
    """The goal (or cusp) is behind the vehicle: braking, then standing until a route back is planned."""
    FAILED = "failed"
    """No plan was accepted, or there was no time for one, the measurement is doubted, or the drive (or the
    steering) is too weak for the disturbance: a substitute is driven, `reason` says why."""


class Reason(Enum):
    """Why a cycle did what it did: its message, with a place for the detail, and its status.

    Where the status is None, a plan is driven: FOLLOWING or ARRIVING, by the objective.
    """

    DRIVES = "drives", "", None
    DRIVES_TO_STOP = "drives to stop", "driving to a stop in front of an obstacle: {}", None
    DRIVES_UNSEEN = "drives unseen", "{}", None
    """To a goal that has not been seen for a while."""
    DRIVES_ON = "drives on", "{}", None
    """Along the last plan, as this cycle gave none; the detail says why."""
    LATE = "late", "the plan came after the deadline", Status.STARTING
    STATE_DOUBTED = "state doubted", "{}", Status.FAILED
    """Along the last plan, for a moment, as the measured state is doubted."""
    NO_PLAN = "no plan", "{}", Status.FAILED
    SEARCHES_PLAN = "searches plan", "{}", Status.STARTING
    """There is no first plan yet."""
    TURNS_WHEELS = "turns wheels", "turning the wheels at rest to {} rad", Status.STARTING
    RETRIES_SOON = "retries soon", "standing, searches again soon: {}", Status.FAILED
    OVERLAP = "overlap", "{}", Status.BLOCKED
    CREEPS_OUT = "creeps out", "{}: creeps out of it", Status.BLOCKED
    CONTACT_AHEAD = "contact ahead", "contact in {}", Status.BLOCKED
    """The detail: the distance [m], the obstacle or boundary, and the place."""
    WAITS_UNTIL_CLEAR = (
        "waits until clear",
        "waits until the route has been clear for a while{}",
        Status.BLOCKED,
    )
    GOAL_UNCERTAIN = "goal uncertain", "{}", Status.GOAL_LOST
    """The goal is not known well enough to dock at."""
    SETTLES = "settles", "braking to rest at the target", Status.SETTLING
    STANDS_BEFORE_OBSTACLE = "stands before obstacle", "something blocks the route: {}", Status.BLOCKED
    STANDS_AT_CUSP = "stands at cusp", "standing at the cusp", Status.CHANGING_DIRECTION
    GOAL_REJECTED = "goal rejected", "{}", Status.GOAL_REJECTED
    NOT_DETECTED = "not detected", "standing at the planned goal, not detected yet", Status.SEARCHING
    DOCKED = "docked", "standing inside the tolerance", Status.DOCKED
    COMMANDED_TO_STAND = "commanded to stand", "standing as commanded", Status.WAITING
    STALLED = "stalled", "no plan from here ends inside the tolerance{}", Status.STALLED
    GOAL_BEHIND = (
        "goal behind",
        "the goal is {} m behind where the vehicle stops: a new route is needed",
        Status.GOAL_BEHIND,
    )
    PLANS_ROUTE = "plans route", "planning a route: {}", Status.PLANNING
    NO_ROUTE = "no route", "{}", Status.STALLED
    """There is no route in the area; the detail says why."""
    INTERNAL_ERROR = "internal error", "internal error: {}", Status.FAILED

    message: str
    status: Status | None

    def __new__(cls, word: str, message: str, status: Status | None) -> Reason:
        """The value is the word alone."""
        reason = object.__new__(cls)
        reason._value_, reason.message, reason.status = word, message, status
        return reason


@dataclass(frozen=True, slots=True)
class Verdict:
    """The result of a cycle: its reason, and the detail of the message."""

    reason: Reason
    detail: str = ""

    def __str__(self) -> str:
        return self.reason.message.format(self.detail)


class MissionResult(Enum):
    """The result of a step of a mission, or of all of it."""

    RUNNING = "RUNNING"
    SUCCEEDED = "SUCCEEDED"
    NOT_DETECTED = "NOT_DETECTED"
    """The goal was not seen, or not well enough to dock by."""
    NOT_REACHED = "NOT_REACHED"
    """There is no route or no plan to the end of the step, or it cannot be started from here."""
    BLOCKED = "BLOCKED"
    """Something blocks the route."""
    TIMED_OUT = "TIMED_OUT"
    CANCELLED = "CANCELLED"


class Source(Enum):
    """Where a command comes from."""

    SOLUTION = "solution"
    SHIFTED_PLAN = "shifted plan"
    BRAKING = "braking"
    STANDSTILL = "standstill"
    ESCAPE = "escape"
    """Creeping out of what the body overlaps, see `ControllerConfig.escape_speed`."""


class GoalOrigin(Enum):
    """Where the goal is known from."""

    PATH_END = "path end"
    """No goal was given: it is the last pose of the path that was given."""
    GIVEN = "given"
    """By the `goal` of a step, or by a mission."""
    DETECTED = "detected"


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalSetpoint:
    """The goal that the controller drives to.

    Attributes:
        pose: of the rear axle, world frame; a detected one follows the detections at a bounded rate.
        source: where it is known from.
    """

    pose: Pose2
    source: GoalOrigin


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """A planned motion. All arrays are read-only.

    Attributes:
        times: (N+1,) [s], on the clock of `now`.
        states: (N+1, 6) x [m], y [m], phi [rad], v [m/s], delta [rad], theta [m]; world frame.
        controls: (N, 3) a [m/s²], delta_dot [rad/s], theta_dot [m/s], each held from times[k] to times[k+1].
    """

    times: Array
    states: Array
    controls: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectiveWeights:
    """The weights that act on the plan's first stage, after dynamic allocation (paper Eq. 8 to 11)."""

    lag: float
    contouring: float
    progress_reward: float
    goal_position: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnostics:
    """How a command came about.

    Attributes:
        theta: progress of the vehicle along the route [m].
        part: index of the active one-direction part.
        objective: what the QP asked for.
        weights: the weights acting on the first stage.
        time_to_go: planned time to the arrival [s]; None while contouring.
        failed: the QP of this cycle was not accepted.
        solver_status: the solver's word for its result ("" where no QP was solved).
        iterations: of OSQP and PIQP, of all QPs of this cycle.
        residuals: primal and dual of the last one, scaled; infinite if not solved, (0, 0) without a QP.
        interior_point: PIQP had to solve one of them, which takes 3 ms or so.
        slack: largest corridor slack of the plan [m].
        cause: why the cycle did what it did.
        reason: the same as a sentence, with all remarks.
        target: the pose that the active part is to end in, world frame.
        goal: what detections say about the goal; None if there never was one.
        detections: judgements on those of this cycle.
        prepare_ms, feedback_ms, solve_ms, step_ms: times of the phases [ms].
        deadline_missed: the configured deadline had passed when the plan was chosen; the check of a
            substitute, the last check, and these diagnostics are not counted.
        disturbance: estimated acceleration beside the commands [m/s²], a slope say; positive to the front.
        steering_offset: estimated angle of the wheels to the left of what is measured [rad].
    """

    theta: float
    part: int
    objective: Objective
    weights: EffectiveWeights
    time_to_go: float | None
    failed: bool
    solver_status: str
    iterations: int
    residuals: tuple[float, float]
    slack: float
    reason: str
    target: Pose2
    goal: GoalEstimate | None
    detections: tuple[Judgement, ...]
    prepare_ms: float
    feedback_ms: float
    solve_ms: float
    step_ms: float
    deadline_missed: bool
    disturbance: float = 0.0
    steering_offset: float = 0.0
    cause: Reason = Reason.DRIVES
    interior_point: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionReport:
    """The state of a mission.

    Attributes:
        step: place of the current step, or of the last one.
        kind: of that step, as in scenario files.
        attempt: number of earlier attempts of that step.
        result: of that step alone.
        mission_result: of the whole mission; RUNNING until no step is left. The vehicle may still brake then,
            see `DockingMission.over`.
        reason: why the step failed, or is tried again, or "".
    """

    step: int
    kind: str
    result: MissionResult
    mission_result: MissionResult = MissionResult.RUNNING
    attempt: int = 0
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """What the vehicle shall do until the next step.

    Attributes:
        acceleration: [m/s²], with the disturbance compensated.
        steering_rate: [rad/s].
        speed, steering: set-points [m/s], [rad] for now + dead time + cycle. They are the integrals of both
            rates, continue from the last ones, and are led slowly to what is measured.
        status: what the controller is doing, and why.
        source: where the command comes from.
        docked: standing inside the tolerance of the goal that was given last.
        trajectory: the plan of the command, with accelerations as commanded and steering as measured.
        diagnostics: how it came about.
        goal: the setpoint; None where there is none, or none was accepted.
        mission: the state of the mission; None without one.
        hold: stand still, and set the brake if there is one: the vehicle has come to rest and is to stay. The
            other fields hold it without a brake.
    """

    acceleration: float
    steering_rate: float
    speed: float
    steering: float
    status: Status
    source: Source
    docked: bool
    trajectory: Trajectory
    diagnostics: Diagnostics
    goal: GoalSetpoint | None = None
    mission: MissionReport | None = None
    hold: bool = False
