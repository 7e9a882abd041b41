"""DockingController: from following a path to standing at the dock, one command a cycle.

A cycle is the five lines of `DockingController.step`: what is known (`world`), on which route and segment
the vehicle is, and where that ends (`course`), what is driven (`drive`), and the command that is sent.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement
from estimation.actuators import record_of
from geometry import Area, Corridor, CorridorError, InputError, Pose2, ReferencePath
from geometry.validation import validated
from rti_mpcc.clock import CycleClock
from rti_mpcc.config import ControllerConfig
from rti_mpcc.course import transitions
from rti_mpcc.course.conditions import REPLAN_INTERVAL, may_change_direction
from rti_mpcc.course.context import PlanningContext, Workspace
from rti_mpcc.course.route_start import OUT_OF_REACH
from rti_mpcc.course.transitions import Event, transition_on
from rti_mpcc.drive import fallback, holding, limiter, search
from rti_mpcc.drive.command import ControlDecision, InputReport, command, diagnose, emergency
from rti_mpcc.drive.driving import driven
from rti_mpcc.drive.fallback import ControlInput
from rti_mpcc.drive.limiter import sent
from rti_mpcc.kernels import make_ready
from rti_mpcc.manoeuvre import Manoeuvre, Segments, checked_manoeuvre, segments_of
from rti_mpcc.model.actuators import Actuators
from rti_mpcc.model.layout import STATES
from rti_mpcc.orders import Follow, GoTo, Order, carried_out
from rti_mpcc.qp.problem import QpProblem
from rti_mpcc.state import ControllerState, Phase, Plans, RouteState, Task
from rti_mpcc.types import Array, Command, GoalOrigin, Reason, Status, VehicleState, Verdict
from rti_mpcc.world import goal_setpoint
from rti_mpcc.world.obstacles import CLEAR_TIME
from rti_mpcc.world.perception import Perception, StepInputs
from rti_mpcc.world.standstill import dock_speed
from rti_mpcc.world.surroundings import Surroundings, area_along
from rti_mpcc.world.vehicle import predicted

if TYPE_CHECKING:  # a controller that plans no route does without
    from rti_mpcc.course.replanning import Replanner
    from rti_mpcc.route_planner.path_repair import PathChange

_log = logging.getLogger(__name__)


class DockingController:
    """Drives a vehicle along a route and into its goal pose.

    The first one on a machine compiles the kernels, in about half a minute (`rti-mpcc warm` does it before).

    It loads all that its cycles need when it is made. Call `prepare_process` then, before the first cycle.

    Args:
        path: the route.
        corridor: its boundaries and obstacles.
        config: settings, all with defaults.
        segments: of the manoeuvre along it; None: `segments_of` the path, which is repaired first where it
            bends too sharply or leads the body into something (`repaired_path`), if `config` has a recovery.

    Attributes:
        config, segments: as given.
        path_changes: repairs of the given path.
        state: that a cycle leaves to the next.

    Raises:
        CorridorError: the corridor is narrower than the body.
        InputError: segments that are no manoeuvre on this path.
    """

    path_changes: tuple[PathChange, ...] = ()

    @validated()
    def __init__(
        self,
        path: ReferencePath,
        corridor: Corridor,
        config: ControllerConfig | None = None,
        *,
        segments: Segments | None = None,
    ) -> None:
        config = config or ControllerConfig()
        self.segments = None if segments is None else checked_manoeuvre(segments, path)
        area = _area_along(path, corridor, config) if config.recovers else None
        if segments is None and area is not None:
            given = path
            path, self.path_changes = _repaired(path, corridor, area, config)
            area = area if path is given else _area_along(path, corridor, config)
        around = Surroundings.of(corridor, path, config)
        replanner = route = None
        if area is not None:
            from rti_mpcc.course.replanning import Replanner

            replanner = Replanner(area, config.changed(route=config.route.along_path()))
            route = RouteState(end=path.end, routes=1)
        task = Task.of(self.segments or segments_of(path, config))
        self._begin(config, ControllerState(area=around, path=path, task=task, route=route), replanner)

    @classmethod
    @validated()
    def in_area(cls, area: Area, config: ControllerConfig | None = None) -> Self:
        """A controller that plans its route from where the vehicle is to the goal that `step` is given.

        It stands until a route is planned, a slice a cycle, and replans when it is blocked or its goal moves.

        Args:
            area: the free space, until `set_area`; obstacles given to `step` are added to it.
            config: settings, all with defaults; of the route `ControllerConfig.route`.
        """
        from rti_mpcc.course.replanning import Replanner

        self = cls.__new__(cls)
        self.segments, config = None, config or ControllerConfig()
        path, task = transitions.standing_route(Pose2(0.0, 0.0, 0.0))
        route, task = RouteState(replan_reason="there is none yet"), replace(task, phase=Phase.PLANNING)
        started = ControllerState(area=Surroundings.in_area(area), path=path, task=task, route=route)
        self._begin(config, started, Replanner(area, config))
        return self

    def _begin(self, config: ControllerConfig, state: ControllerState, replanner: Replanner | None) -> None:
        make_ready()
        actuators = Actuators.of(config.actuators)
        records = record_of(actuators.drive.lag), record_of(actuators.steering.lag)
        given = replace(state.vehicle, actuators=actuators, records=records)
        self.config, self.state, self._replanner = config, replace(state, vehicle=given), replanner
        self._workspace = Workspace(state, config)
        self._perception = Perception(config)
        _log.info("%s", _proportions(config))

    @property
    def path(self) -> ReferencePath | None:
        """The route that is driven, given or planned; None while there is none."""
        s = self.state
        on_none = s.task.phase is Phase.PLANNING or (s.task.phase is Phase.WAITING and not s.has_route)
        return None if on_none else s.path

    @property
    def manoeuvre(self) -> Manoeuvre | None:
        """The last one that was planned, found or not."""
        return None if self.state.route is None else self.state.route.manoeuvre

    @property
    def replans(self) -> int:
        """Number of routes started after the first one."""
        return 0 if self.state.route is None else max(self.state.route.routes - 1, 0)

    @property
    def planning_seconds(self) -> float:
        """Time of all searches for routes [s]."""
        return 0.0 if self.state.route is None else self.state.route.seconds

    @property
    def corridor(self) -> Corridor:
        """Boundaries, and the obstacles that were given last."""
        return self.state.area.known

    @property
    def area(self) -> Area | None:
        """In which it plans routes, with all known static obstacles; None where it plans none."""
        return None if self._replanner is None else self._replanner.area_known(self.state)

    @property
    def has_stepped(self) -> bool:
        """Whether there was a cycle."""
        return self.state.clock.started

    def clear_goal(self) -> None:
        """Forget the goal and its detections: the path's last pose is the goal again."""
        known = replace(self.state.goal, averaged_at=None, fit=None, given_fit=None, refusal="")
        end = self.state.route.end if self.state.on_planned_route and self.state.route else None
        known = self._perception.with_goal(known, end)
        self.state = replace(self.state, goal=replace(known, origin=GoalOrigin.PATH_END))

    @validated()
    def set_area(self, area: Area) -> None:
        """Replace the area, as a map that is updated; it counts from the next step on.

        Kept are a route that stays clear, a search without changes near it, and obstacles given to `step`.

        Args:
            area: all of it; what differs by `rti_mpcc.world.obstacles.MOVED` at most is no change.

        Raises:
            InputError: the controller drives a path in a corridor, or `area` is no Area.
        """
        self.check_area(area)
        assert self._replanner is not None
        self.state = self._replanner.in_another(self.state, area)

    @validated()
    def check_area(self, area: Area) -> None:
        """Raise the InputError of `set_area`, if there is a reason to."""
        route = self.state.route
        if self._replanner is None or route is None or route.end is not None:
            raise InputError(
                "set_area: this controller drives a path in a corridor. Give what has changed to step as "
                "obstacles, or make the controller by DockingController.in_area(area)."
            )

    @validated()
    def assign(self, order: Order) -> None:
        """Give an order, for the next step on. Raises InputError for a goal or manoeuvre without recovery."""
        self.state = carried_out(self.state, order, self._replanner)
        if isinstance(order, GoTo | Follow):  # of another goal nothing was detected yet
            self._perception.forget_goal()

    def step(
        self,
        state: VehicleState,
        *,
        now: float,
        goal: Pose2 | None = None,
        measurements: Sequence[GoalMeasurement] = (),
        obstacles: Sequence[ArrayLike] | None = None,
        clock: CycleClock | None = None,
    ) -> Command:
        """One cycle: the command to apply from now until the next step.

        1. Check the inputs; filter the detections of the goal, and let the goal setpoint follow.
        2. Change to another route if one is needed and planned. Before a given path is started, check the
           reachability of its goal.
        3. Predict where the command will start to act; start the next segment after this one's end; end the
           course before what blocks it.
        4. Drive what the phase asks for, or the next step of the fallback.
        5. Keep the command within the limits, and give its reason. Plan with the time that is left.

        No input makes it raise: unusable inputs are ignored, and the reason says so.

        Args:
            state: measured at `now`.
            now: on any clock that does not stop [s].
            goal: pose to end in; None keeps the last one, first the path's last pose. One that is out of
                reach is rejected (`world.goals`): the reason says why, and the command is not `docked`
                until that goal is reached, or another one is accepted. The vehicle continues to the previous
                goal; without one it stands (`Status.GOAL_REJECTED`). With detections it is the planned goal,
                until they tell it better; one farther than the tolerance from the first is another dock.
            measurements: detections of the goal that arrived since the last step, in any order.
            obstacles: polygons (m, 2), lines (2, 2), points (1, 2) [m] to keep out of; None keeps the last.
            clock: decides what depends on time in this cycle; None: the wall clock and `config.deadline`. For
                recordings and tests.
        """
        clock = clock or CycleClock(self.config.deadline)
        s = self.state
        try:
            s, report = self._known(s, StepInputs(state, now, goal, measurements, obstacles))
            s = self._on_route(s, clock)
            s, context = self._on_segment(s, clock)
            after, decision = driven(s, context)
            after, answer = self._sent(s, after, decision, context, report)
        except Exception as error:
            # An internal error must not leave the vehicle without a command.
            _log.exception("internal error in a cycle, the vehicle is braked")
            after, answer = self._rescued(s, error, clock)
        self.state = after
        return answer

    def problem(self) -> QpProblem:
        """The QP that was solved last on the active segment, for study off line; zeros if none was."""
        return self._workspace.core(self.state).problem()

    # -- what comes in ------------------------------------------------------------------------------

    def _known(self, s: ControllerState, given: StepInputs) -> tuple[ControllerState, InputReport]:
        """With what is known by the inputs of this cycle; judgements of detections, and remarks."""
        task = s.task
        s = holding.not_dead_reckoned(s) if task.docked else s
        part, holds = s.path.parts[task.segment.index], task.hold is not None
        perception, path = self._perception, s.path
        s, remarks = perception.updated(s, given, path=path, part=part, holds=holds)
        s, detections, unfit = perception.located(s, given.measurements, path)
        return s, InputReport(detections, (*remarks, unfit))

    # -- the route and its segment ------------------------------------------------------------------

    def _on_route(self, s: ControllerState, clock: CycleClock) -> ControllerState:
        """On another route if one is needed and planned; a given path is checked before it is started."""
        if self._replanner is None:
            return s
        s = self._replanner.routed(s)
        due = s.task.phase is Phase.STARTING and search.reachability_is_due(s, self.config)
        return self._reachability_checked(s, clock) if due else s

    def _on_segment(self, s: ControllerState, clock: CycleClock) -> tuple[ControllerState, PlanningContext]:
        """Where the command will start to act, on the segment of that time."""
        if s.vehicle.monitor.relocalised:
            # A vehicle that holds inside the tolerance stays there.
            s = replace(transition_on(s, Event.RELOCALISED), start_state=None)
        s, context = self._workspace.context(s, clock)
        if s.task.phase is not Phase.WAITING and may_change_direction(s, context):
            s, context = self._workspace.context(transitions.next_segment(s), clock)
        after = transitions.on_course(s, context)
        if after.task.stop is not s.task.stop:
            return self._workspace.context(after, clock, context.state)
        return after, context

    def _reachability_checked(self, s: ControllerState, clock: CycleClock) -> ControllerState:
        """Before a given path is started, check that the goal is reached from its last change of direction.

        If a first plan from there misses it, the vehicle replans.
        """
        last = Task(segment=(s.task.segment, *s.task.later)[-1])
        trial, segment = replace(s, task=last, plans=Plans(), start_state=None), last.segment
        first, wheels = segment.part.first, segment.wheels or 0.0
        start = np.array([first.x, first.y, first.phi, 0.0, wheels, segment.part.start])
        reaches = search.ends_at_goal(*self._workspace.context(trial, clock, start))
        assert s.route is not None
        wanted = OUT_OF_REACH if reaches is False else s.route.request
        return replace(s, route=replace(s.route, goal_checked=s.goal_pose, request=wanted))

    # -- what goes out --------------------------------------------------------------------------------

    def _sent(
        self,
        s: ControllerState,
        after: ControllerState,
        decision: ControlDecision,
        context: PlanningContext,
        report: InputReport,
    ) -> tuple[ControllerState, Command]:
        """The command within the limits, with its reason, and the state that the cycle leaves.

        What is left of the time is for planning another route. `s`: before the decision.
        """
        at = context.state
        control = self._saturated(decision.control, at, s)
        decision = replace(decision, control=control)
        after = sent(after, control, context.start_time, at, context.before, self.config)
        after = _retried(after, decision.verdict.reason)
        undocked = holding.undocked(context) if s.task.docked and after.task.hold is None else ""
        remarks = (*goal_setpoint.goal_remarks(s.goal), undocked)
        report = report._replace(remarks=(*report.remarks, *remarks))
        if self._replanner is not None:
            after = self._replanner.planned_on(after, context.clock)
        diagnostics = diagnose(decision, at, context.target.pose, after, context.clock, report)
        return after, command(decision, after, self.config, diagnostics)

    def _saturated(self, control: ControlInput, start: Array, s: ControllerState) -> ControlInput:
        measured = s.vehicle.monitor.usable_measurement(self.config)
        return limiter.saturate(control, start, measured, self.config, s.vehicle.disturbance)

    def _rescued(
        self, s: ControllerState, error: Exception, clock: CycleClock
    ) -> tuple[ControllerState, Command]:
        """Brake after an internal error, and plan anew in the next cycle with what was known before it."""
        config, what = self.config, f"{type(error).__name__}: {' '.join(str(error).split())}"
        verdict = Verdict(Reason.INTERNAL_ERROR, what)
        if self._replanner is not None:
            self._replanner.forget()
        at, start = s.clock.now + s.vehicle.dead_time, s.vehicle.monitor.state
        if start is not None:
            with suppress(Exception):  # the error may be in this: then the present estimate is used
                start = predicted(s, at, config)
        elif s.start_state is not None:
            start = s.start_state
        else:
            start = np.zeros(STATES)
        control = self._saturated(fallback.brake(start, config.firm_deceleration, config), start, s)
        before = s.sent[-1].acting(at, s.vehicle.actuators) if s.sent else (0.0, 0.0)
        s = transitions.restarted(sent(s, control, at, start, before, config), str(verdict))
        return s, emergency(control, start, s, verdict, config, clock)


def _proportions(config: ControllerConfig) -> str:
    """The lengths that follow from the vehicle's size and from the tolerance."""
    kept, tolerance, vehicle = config.clearance, config.goal_tolerance, config.vehicle
    return (
        f"vehicle of {vehicle.front + vehicle.rear:.2f} m: "
        f"clearance {kept.least:.3g} m at least, {kept.wanted:.3g} m wanted, "
        f"{kept.on_routes:.3g} m on routes; other lengths are {100.0 * config.size:.0f} % of those for cars; "
        f"it stands below {config.rest_speed:.3g} m/s, at the dock {dock_speed(tolerance, config):.3g} m/s"
    )


def _area_along(path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> Area | None:
    """All of the corridor along a path; None, with a warning, if it is not enclosed."""
    try:
        return area_along(path, corridor, config)
    except CorridorError as error:
        _log.warning("%s The path is not changed, and no other route is planned", error)
        return None


def _repaired(
    path: ReferencePath, corridor: Corridor, area: Area, config: ControllerConfig
) -> tuple[ReferencePath, tuple[PathChange, ...]]:
    """The path repaired inside its corridor and past its obstacles, with log messages."""
    from rti_mpcc.route_planner.path_repair import repaired_path

    made = repaired_path(path, area.with_obstacles(corridor.obstacles), config)
    for change in made.changes:
        # A path that only lacks clearance is no reason to warn: the goal may be elsewhere.
        told = change.aside is not None or change.curvature > change.possible
        _log.log(logging.WARNING if told else logging.INFO, "%s", change)
    return made.path, made.changes


def _retried(s: ControllerState, reason: Reason) -> ControllerState:
    """Whether the next cycle waits for the goal, or a vehicle blocked at rest searches again."""
    waiting, yielding = reason is Reason.GOAL_UNCERTAIN, s.task.yielding
    if waiting is not s.goal.waiting:
        s = replace(s, goal=replace(s.goal, waiting=waiting))
    blocked = reason.status is Status.BLOCKED and s.task.stop is None
    since = None if yielding is None else yielding.clear_since
    waits = since is not None and s.clock.now - since <= 2.0 * CLEAR_TIME  # later no plan has come
    tried = s.vehicle.stands and s.clock.now - s.task.driving_since >= REPLAN_INTERVAL
    return transition_on(s, Event.STANDS_BLOCKED) if blocked and not waits and tried else s
