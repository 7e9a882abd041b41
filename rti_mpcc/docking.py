"""DockingController: from following a path to standing at the dock, one command a cycle.

It composes the layers below and decides nothing itself: what comes in is checked and set against the segment
that the vehicle is on; `driving` does what the phase asks for, or takes the next rung of the fallback, with
first plans by `scouting`; and what goes out is checked again.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalPoseFilter, Judgement
from geometry import Area, Corridor, CorridorError, InputError, Pose2, ReferencePath
from geometry.angles import degrees_hint
from geometry.doors import door
from rti_mpcc import orders, scouting
from rti_mpcc.behaviour import moves
from rti_mpcc.behaviour.conditions import may_change_direction
from rti_mpcc.behaviour.transitions import Event, transition_on
from rti_mpcc.config import ControllerConfig
from rti_mpcc.driving import driven
from rti_mpcc.kernels import make_ready
from rti_mpcc.manoeuvre import Manoeuvre, Segments, checked_manoeuvre, segments_of
from rti_mpcc.model.delay import QueuedCommand, queued
from rti_mpcc.model.layout import PHI, STATES, X, Y
from rti_mpcc.orders import Follow, GoTo, Order
from rti_mpcc.planning import aim, goals, sensing, stops, validation
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.context import PlanningContext
from rti_mpcc.planning.plausibility import StateMonitor, validate_measurement
from rti_mpcc.planning.state import ControllerState, Phase, Plans, RouteState, Task
from rti_mpcc.planning.stops import REPLAN_INTERVAL
from rti_mpcc.planning.surroundings import Surroundings, area_along
from rti_mpcc.planning.workspace import Workspace, Workspaces
from rti_mpcc.qp.problem import QpProblem
from rti_mpcc.rerouting import Rerouter, standing_route
from rti_mpcc.route_planner.mending import PathChange, mended_path
from rti_mpcc.safety import fallback, limiter
from rti_mpcc.safety.decision import command, emergency, status_of
from rti_mpcc.safety.fallback import ControlInput
from rti_mpcc.types import Array, Command, GoalOrigin, Reason, Status, VehicleState, Verdict

_log = logging.getLogger(__name__)


class DockingController:
    """Drives a vehicle along a route and into its goal pose.

    The first one on a machine compiles the kernels, in about a minute (`rti-mpcc warm` does it before).

    A controller loads all that its cycles need when it is made. Call `prepare_process` after that, before the
    first cycle.

    Args:
        path: the route; corridor: its boundaries and obstacles; config: settings, all with defaults.
        segments: of the manoeuvre along it; None: `segments_of` the path, which is made drivable before where
            it bends more sharply than the vehicle can, or leads the body into something (`mended_path`),
            unless `config` has no recovery.

    Attributes:
        config, segments: as given.
        path_changes: what was made of each place at which the path as it was given cannot be driven.
        state: what is known from cycle to cycle.

    Raises:
        CorridorError: the corridor is narrower than the body.
        InputError: segments that are no manoeuvre on this path.
    """

    path_changes: tuple[PathChange, ...] = ()

    @door()
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
            path, self.path_changes = _mended(path, corridor, area, config)
            area = area if path is given else _area_along(path, corridor, config)
        around = Surroundings.of(corridor, path, config)
        rerouter = None  # of other ways than the path, in all of its corridor
        if area is not None:
            rerouter = Rerouter(area, config.changed(route=config.route.along_path()))
        task = Task(segments=self.segments or segments_of(path, config))
        begun = ControllerState(area=around, path=path, task=task)
        if rerouter is not None:
            begun = replace(begun, route=RouteState(end=path.end, ways=1))
        self._begin(config, begun, rerouter)

    @classmethod
    @door()
    def in_area(cls, area: Area, config: ControllerConfig | None = None) -> Self:
        """A controller that plans its way: from where the vehicle is to the goal that `step` is given.

        It stands until a way is planned, a slice of the search a cycle, and plans another one from where it
        is when it cannot get on, or its goal is elsewhere.

        Args:
            area: where the vehicle may be, until `set_area`; obstacles given to `step` come on top of it.
            config: settings, all with defaults; of the way `ControllerConfig.route`.
        """
        self = cls.__new__(cls)
        config = config or ControllerConfig()
        path, segments = standing_route(Pose2(0.0, 0.0, 0.0))
        begun = ControllerState(
            area=Surroundings.in_area(area), path=path, task=Task(segments=segments), route=RouteState()
        )
        self.segments = None
        self._begin(
            config, moves.without_way(begun, path, segments, "there is none yet"), Rerouter(area, config)
        )
        return self

    def _begin(self, config: ControllerConfig, state: ControllerState, rerouter: Rerouter | None) -> None:
        make_ready()
        self.config, self.state, self._rerouter = config, state, rerouter
        self._workspaces = Workspaces(state.path, state.area.corridor, config, state.task.segment)
        # Made here in any case: a first detection while driving must not wait for what the filter loads.
        self._filter = GoalPoseFilter(config.goal_tracking.filter)
        self._filtering = config.goal_tracking.required

    @property
    def path(self) -> ReferencePath | None:
        """The route that is driven, given or planned; None while there is none."""
        s = self.state
        on_none = s.task.phase is Phase.PLANNING or (s.task.phase is Phase.WAITING and not s.on_a_way)
        return None if on_none else s.path

    @property
    def manoeuvre(self) -> Manoeuvre | None:
        """The last one that was planned, found or not."""
        return None if self.state.route is None else self.state.route.manoeuvre

    @property
    def replans(self) -> int:
        """How often the vehicle set out on another way than the first one."""
        return 0 if self.state.route is None else max(self.state.route.ways - 1, 0)

    @property
    def planning_seconds(self) -> float:
        """That all searches for ways took [s]."""
        return 0.0 if self.state.route is None else self.state.route.seconds

    @property
    def corridor(self) -> Corridor:
        """Where the vehicle may be, with the obstacles that were told last."""
        return self.state.area.known

    @property
    def area(self) -> Area | None:
        """In which it plans ways, with all that stands as far as is known; None where it plans none."""
        return None if self._rerouter is None else self._rerouter.area_known(self.state)

    @property
    def has_stepped(self) -> bool:
        """Whether there was a cycle."""
        return self.state.clock.time is not None

    def clear_goal(self) -> None:
        """Forget the goal and its detections: the path's last pose is the goal again."""
        known = replace(self.state.goal, fit=None, given_fit=None, refusal="")
        end = self.state.route.end if self.state.on_planned_way and self.state.route else None
        s = self._made_for(replace(self.state, goal=known), end)
        self.state = replace(s, goal=replace(s.goal, origin=GoalOrigin.PATH_END))

    @door()
    def set_area(self, area: Area) -> None:
        """Replace the area, as a map that is updated; it counts from the next step on.

        The route is driven on where it stays clear, and a search goes on where nothing has changed near it.
        Obstacles given to `step` stay.

        Args:
            area: all of it; what differs by `rti_mpcc.planning.obstacles.MOVED` at most is no change.

        Raises:
            InputError: the controller drives a path in a corridor, or `area` is no Area.
        """
        self.check_area(area)
        assert self._rerouter is not None
        self.state = self._rerouter.in_another(self.state, area)

    @door()
    def check_area(self, area: Area) -> None:
        """Raise the InputError of `set_area`, if there is a reason to."""
        route = self.state.route
        if self._rerouter is None or route is None or route.end is not None:
            raise InputError(
                "set_area: this controller drives a path in a corridor. Give what has changed to step as "
                "obstacles, or make the controller by DockingController.in_area(area)."
            )

    @door()
    def assign(self, order: Order) -> None:
        """Give it something else to do, from the next step on.

        Raises:
            InputError: a goal or a manoeuvre for a controller that plans no ways.
        """
        self.state = orders.carried_out(self.state, order, self._rerouter)
        if isinstance(order, GoTo | Follow):  # of another goal nothing was detected yet
            self._filter.reset()

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

        1. Check what comes in, and take what can be used.
        2. Filter the detections of the goal, and let the pose made for follow.
        3. Take another way if one is needed and planned; plan on with the time that is left. Before a given
           path is begun, try its last part.
        4. Predict where the command will begin to act; begin the next segment where this one is over.
        5. Drive what the phase asks for, or the next rung of the fallback.
        6. Keep the command within the limits, and say why it is what it is.

        No value that comes in makes it raise: what is not fit to be used is left out, and said.

        Args:
            state: measured at `now`.
            now: on any clock that runs on [s].
            goal: pose to end in; None keeps the last one. Without any it is the path's last pose. One that is
                out of reach is not taken (`planning.goals`): the reason says why, and the command is not
                `docked` until that goal is reached, or another one or none is asked for. The vehicle drives
                on to the last one that was taken; without one it stands (`Status.GOAL_REJECTED`). With
                detections it is the planned goal, made for until they say better; one that is beside the
                first by more than the tolerance is another dock, whose detections begin anew.
            measurements: detections of the goal that arrived since the last step, in any order.
            obstacles: polygons (m, 2), lines (2, 2) and points (1, 2) [m] to keep out of; None keeps the last
                ones.
            clock: decides what depends on time in this cycle; None: the wall clock and `config.deadline`. For
                recordings and tests.
        """
        clock = clock or CycleClock(self.config.deadline)
        s = self.state
        try:
            s, remarks = self._given(s, state, now, goal, obstacles)
            s, detections, unfit = self._goal_located(s, measurements)
            s = s if self._rerouter is None else self._rerouter.routed(s)
            s = self._rehearsed(s, clock)
            s, context, w = self._on_segment(s, clock)
            after, decision = driven(s, context, w)
            decision = replace(decision, control=self._saturated(decision.control, context.state, s))
            status = status_of(decision.verdict, after.task)
            after = _sent(after, decision.control, context.begin, context.state)
            after = _looking_again(after, status, decision.verdict.reason)
            remarks = (*remarks, unfit, *aim.goal_remarks(s.goal))
            if self._rerouter is not None:
                after = self._rerouter.planned_on(after, clock)
            sent = command(decision, status, context, after, detections, remarks, self.config, clock)
        except Exception as error:
            # An internal error must not leave the vehicle without a command.
            _log.exception("internal error in a cycle, the vehicle is braked")
            after, sent = self._rescued(s, error, clock)
        self.state = after
        return sent

    def problem(self) -> QpProblem:
        """The QP that was solved last on the active segment, for study off line; zeros if none was."""
        return self._workspaces.core(self.state).problem()

    # -- what comes in ------------------------------------------------------------------------------

    def _given(
        self,
        s: ControllerState,
        measured: VehicleState,
        now: float,
        goal: Pose2 | None,
        obstacles: Sequence[ArrayLike] | None,
    ) -> tuple[ControllerState, tuple[str, ...]]:
        """Take what is new, in so far as it can be used; says what could not."""
        config = self.config
        clock, clock_remark = validation.timed(s.clock, now, config)
        area = validation.surroundings_in(s.area, obstacles, clock.now)
        last = s.vehicle
        monitor = validate_measurement(last.monitor, measured, s.queue, clock.now, config, last.disturbance)
        known = sensing.learnt(s, monitor, config)
        monitor = monitor.doubting(area.unreadable, last.monitor)
        hint = self._heading_hint(s, monitor)
        vehicle = replace(last, monitor=monitor, offsets=known, heading_hint=hint)
        vehicle = aim.noted(vehicle, clock.now, config.goal_tracking.filter.history)
        known_goal, another = validation.goal_in(goal, s.goal, s.path, area, config)
        s = replace(s, clock=clock, area=area, vehicle=vehicle, goal=known_goal)
        if another is not None:
            s = self._made_for(s, another)
        return s, (clock_remark, hint)

    def _heading_hint(self, s: ControllerState, monitor: StateMonitor) -> str:
        """What there is to say of the heading measured first, as long as one as large is measured."""
        state, measured = monitor.state, monitor.measured
        hint = "" if measured is None else degrees_hint("heading", float(measured[PHI]))
        if state is None or not hint:
            return ""
        if s.vehicle.monitor.state is not None:
            return s.vehicle.heading_hint
        if s.area.corridor.area is not None:
            return hint
        here = Pose2(float(state[X]), float(state[Y]), float(state[PHI]))
        part = s.path.parts[s.task.segment.index]
        return goals.degrees_beside("heading", here, part)

    def _made_for(self, s: ControllerState, goal: Pose2 | None) -> ControllerState:
        """Another planned goal; the detections of another dock begin anew."""
        dock = s.goal.dock
        if (
            goal is not None
            and dock is not None
            and goal.relative_to(dock).within(self.config.goal_tolerance)
        ):
            return moves.with_goal_corrected(s, goal)
        self._filter.reset()
        return moves.with_goal(s, goal)

    def _goal_located(
        self, s: ControllerState, given: Sequence[GoalMeasurement]
    ) -> tuple[ControllerState, tuple[Judgement, ...], str]:
        """Filter the detections, let the pose made for follow; with judgements, and what was no detection."""
        measurements, unfit = validation.measurements_in(given)
        self._filtering = self._filtering or bool(measurements)
        if not self._filtering:
            refused = aim.undetected(s.goal, (), unfit)
            return replace(s, goal=replace(s.goal, undetected=refused)), (), unfit
        self._filter.predict(s.now)
        judgements = []
        for measurement in measurements:
            # With its stamp on the controller's own clock.
            offset = s.clock.offset
            own = replace(measurement, stamp=measurement.stamp + offset) if offset else measurement
            judgement = self._filter.update(aim.with_vehicle_pose(own, s.vehicle))
            judgements.append(replace(judgement, stamp=measurement.stamp))
        estimate = self._filter.estimate(s.now)
        fit = None
        if estimate.pose is not None:
            fit = goals.checked_again(s.goal.estimate_fit, estimate.pose, s.path, s.area, self.config)
        end = None if s.on_planned_way else s.path.end
        goal = aim.rate_limited_goal(s.goal, estimate, end, s.now, self.config, fit)
        goal = replace(goal, undetected=aim.undetected(goal, judgements, unfit))
        return replace(s, goal=goal), tuple(judgements), unfit

    # -- the segment --------------------------------------------------------------------------------

    def _on_segment(
        self, s: ControllerState, clock: CycleClock
    ) -> tuple[ControllerState, PlanningContext, Workspace]:
        """Where the command will begin to act, on the segment that the vehicle is on by then."""
        s = self._targeted(s)
        if s.vehicle.monitor.found:
            # A plan starts again; while it is inside the tolerance a vehicle at its target stays there.
            s = replace(transition_on(s, Event.FOUND_ELSEWHERE), begin=None)
        w = self._workspaces_on(s).of(s, clock)
        context = w.context(s)
        if s.task.phase is Phase.WAITING or not may_change_direction(s, context, self.config):
            return s, context, w
        s = self._targeted(moves.next_segment(s))
        w = self._workspaces.of(s, clock)
        return s, w.context(s), w

    def _rehearsed(self, s: ControllerState, clock: CycleClock) -> ControllerState:
        """Before a given path is begun: whether the goal is reached from its last change of direction.

        Where a first plan from there misses it, another way is planned from here.
        """
        if self._rerouter is None or not scouting.reachability_is_due(s, self.config):
            return s
        last = Task(segments=(s.task.segments[-1],))
        with self._workspaces_on(s).set_aside():
            trial = self._targeted(replace(s, task=last, plans=Plans(), begin=None))
            segment = trial.task.segment
            first, wheels = segment.part.first, segment.wheels or 0.0
            start = np.array([first.x, first.y, first.phi, 0.0, wheels, segment.part.start])
            w = replace(self._workspaces.of(trial, clock), start=start)
            reaches = scouting.ends_at_goal(trial, w.context(trial), w)
        assert s.route is not None
        wanted = scouting.OUT_OF_REACH if reaches is False else s.route.wanted
        return replace(s, route=replace(s.route, rehearsed=s.goal_pose, wanted=wanted))

    def _workspaces_on(self, s: ControllerState) -> Workspaces:
        """Those of the route that the state is on."""
        if self._workspaces.path is not s.path:
            self._workspaces = Workspaces(s.path, s.area.corridor, self.config, s.task.whole)
        return self._workspaces

    def _targeted(self, s: ControllerState) -> ControllerState:
        """With what the segment is to end in now, and without a stop before what may be gone."""
        target = self._workspaces_on(s).target(s)
        if target != s.task.target:
            s = replace(s, task=replace(s.task, target=target))
        return moves.released(s) if stops.way_may_be_free(s) else s

    # -- what goes out --------------------------------------------------------------------------------

    def _saturated(self, control: ControlInput, start: Array, s: ControllerState) -> ControlInput:
        measured = s.vehicle.monitor.heeded(self.config)
        return limiter.saturate(control, start, measured, self.config, s.vehicle.disturbance)

    def _rescued(
        self, s: ControllerState, error: Exception, clock: CycleClock
    ) -> tuple[ControllerState, Command]:
        """Brake, and begin afresh in the next cycle with what was known when this one went wrong."""
        config, what = self.config, f"{type(error).__name__}: {' '.join(str(error).split())}"
        verdict = Verdict(Reason.MISTAKE, what)
        if self._rerouter is not None:
            self._rerouter.forget()
        at, start = s.now + config.dead_time, s.vehicle.monitor.state
        if start is not None:
            with suppress(Exception):  # the error may be in this: then the present estimate is used
                start = sensing.predicted(s, at, config)
        elif s.begin is not None:
            start = s.begin
        else:
            start = np.zeros(STATES)
        control = self._saturated(fallback.brake(start, config.firm_deceleration, config), start, s)
        s = _sent(moves.begun_again(s, str(verdict)), control, at)
        return s, emergency(control, start, s, verdict, config, clock)


def _area_along(path: ReferencePath, corridor: Corridor, config: ControllerConfig) -> Area | None:
    """All of the corridor along a path; None, and a warning, where that is not known."""
    try:
        return area_along(path, corridor, config)
    except CorridorError as error:
        _log.warning("%s The path is not changed, and no other route is planned", error)
        return None


def _mended(
    path: ReferencePath, corridor: Corridor, area: Area, config: ControllerConfig
) -> tuple[ReferencePath, tuple[PathChange, ...]]:
    """The path made drivable where it is not, inside its corridor and past its obstacles; says so."""
    made = mended_path(path, area.with_obstacles(corridor.obstacles), config)
    for change in made.changes:
        # Where there is no room on the path the goal may be elsewhere: that alone is no reason to warn.
        told = change.aside is not None or change.curvature > change.possible
        _log.log(logging.WARNING if told else logging.INFO, "%s", change)
    return made.path, made.changes


def _sent(
    s: ControllerState, control: ControlInput, at: float, begin: Array | None = None
) -> ControllerState:
    """With a command among those under way, to act from `at` [s] on, in the state `begin` (6,) if known."""
    sent = QueuedCommand(at, control.acceleration, control.steering_rate)
    return replace(s, queue=queued(s.queue, sent, s.now), begin=begin)


def _looking_again(s: ControllerState, status: Status, reason: Reason) -> ControllerState:
    """Whether the next cycle waits for the goal; blocked at rest it starts again, unless it waits a while."""
    waiting, halt = status is Status.GOAL_LOST, s.task.halt
    if waiting is not s.goal.waiting:
        s = replace(s, goal=replace(s.goal, waiting=waiting))
    held = status is Status.BLOCKED or reason is Reason.OUT_OF_TIME
    blocked = held and s.task.stop is None and not s.task.looks_past
    waits = halt is not None and halt.clear_since is not None
    tried = s.is_stationary and s.now - s.task.driving_since >= REPLAN_INTERVAL
    return transition_on(s, Event.STANDS_BLOCKED) if blocked and not waits and tried else s
