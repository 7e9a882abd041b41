"""DockingController: from following a path to standing at the dock, one command a cycle.

It composes the layers below and decides nothing itself: `planning` decides what the cycle asks for and
finds a plan, `safety` decides what is driven.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from numpy.typing import ArrayLike

from estimation import GoalMeasurement, GoalPoseFilter, Judgement
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.controller import QpProblem, RtiMpcc
from rti_mpcc.model.delay import QueuedCommand, still_acting
from rti_mpcc.model.layout import DELTA_DOT, V
from rti_mpcc.ocp.horizon import stage_lengths, stage_times
from rti_mpcc.planning import aim, intake, route, search, sensing
from rti_mpcc.planning.clock import CycleClock
from rti_mpcc.planning.memory import ControllerMemory, Phase, Situation
from rti_mpcc.planning.search import Attempt, Start
from rti_mpcc.planning.surroundings import Surroundings
from rti_mpcc.planning.trust import weighed
from rti_mpcc.safety import contact, gate, ladder
from rti_mpcc.safety.act import Act, command
from rti_mpcc.safety.stopping import stopping_motion
from rti_mpcc.types import Command, Source, Status, Trajectory, VehicleState

TOO_LATE = "the plan came after the deadline"


class DockingController:
    """Drives a vehicle along a route and into its goal pose.

    Args:
        path: the route; corridor: its boundaries and obstacles; config: settings, all with defaults.

    Raises:
        CorridorError: the corridor is narrower than the body.
    """

    def __init__(
        self, path: ReferencePath, corridor: Corridor, config: ControllerConfig | None = None
    ) -> None:
        self.path = path
        self.config = config or ControllerConfig()
        self._surroundings = Surroundings.of(corridor, path, self.config)
        self._memory = ControllerMemory()
        tracking = self.config.goal_tracking
        self._filter = GoalPoseFilter(tracking.filter) if tracking.required else None
        self._mpcc = self._core()

    @property
    def memory(self) -> ControllerMemory:
        """What this controller remembers from cycle to cycle."""
        return self._memory

    def clear_goal(self) -> None:
        """Forget the goal and its detections: the path's last pose is the goal again."""
        self._plan_for(None)

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

        No value that comes in makes it raise: what is not fit to be used is left out, and said.

        Args:
            state: measured at `now`.
            now: on any clock that runs on [s].
            goal: pose to end in; None keeps the last one. Without any it is the path's last pose. With
                detections it is the planned goal, made for until they say better; another one than the last
                is another dock, whose detections begin anew.
            measurements: detections of the goal that arrived since the last step, in any order.
            obstacles: polygons (m, 2) [m] to keep out of; None keeps the last ones.
            clock: decides what depends on time in this cycle; None: the wall clock and `config.deadline`. For
                recordings and tests.
        """
        clock = clock or CycleClock(self.config.deadline)
        before, changes = self._memory, self._surroundings.changes
        remarks = self._receive(state, now, goal, obstacles)
        detections = self._locate_goal(measurements)
        self._aim()
        situation = self._situation()
        act = self._act(situation, clock, new_obstacles=self._surroundings.changes > changes)
        if clock.late() and act.drive.source is Source.SOLUTION:
            act = self._go_on(before, situation, TOO_LATE, act.attempt) or self._stop(
                situation, Status.STARTING, TOO_LATE, attempt=act.attempt
            )
        act = replace(act, drive=gate.admitted(act.drive, situation.state, state, self.config))
        self._remember(act, situation)
        return command(act, situation, self._memory, detections, remarks, self.config, clock)

    def problem(self) -> QpProblem:
        """The QP of the last cycle that solved one, for study off line."""
        return self._mpcc.problem()

    # -- what comes in ------------------------------------------------------------------------------

    def _receive(
        self,
        state: VehicleState,
        now: float,
        goal: Pose2 | None,
        obstacles: Sequence[ArrayLike] | None,
    ) -> tuple[str, ...]:
        """Take what is new, in so far as it can be used; says what could not."""
        memory, clock_remark = intake.timed(self._memory, now, self.config.cycle)
        goal, goal_remark = intake.goal_in(goal, self.path.end)
        surroundings, unreadable = intake.surroundings_in(self._surroundings, obstacles)
        trust = weighed(memory.trust, state, memory.queue, memory.now, self.config)
        self._memory = replace(memory, trust=trust.doubting(unreadable, memory.trust))
        if surroundings is not self._surroundings:
            self._surroundings = surroundings
            self._mpcc.set_obstacles(surroundings.corridor)
        if goal is not None and goal != self._memory.planned:
            self._plan_for(goal)
        return tuple(remark for remark in (clock_remark, goal_remark) if remark)

    def _plan_for(self, goal: Pose2 | None) -> None:
        self._memory = route.with_goal(self._memory, goal)
        if self._filter is not None:
            self._filter.reset()

    def _locate_goal(self, measurements: Sequence[GoalMeasurement]) -> tuple[Judgement, ...]:
        """Filter what was detected, and let the pose made for follow; says what became of the detections."""
        settings, now = self.config.goal_tracking.filter, self._memory.now
        self._memory = aim.noted(self._memory, settings.history)
        if measurements and self._filter is None:
            self._filter = GoalPoseFilter(settings)
        if self._filter is None:
            return ()
        self._filter.predict(now)
        judgements = []
        for measurement in measurements:
            own = intake.measurement_in(measurement, self._memory.clock_offset)
            judgement = self._filter.update(aim.placed(own, self._memory, settings))
            judgements.append(replace(judgement, stamp=measurement.stamp))
        estimate = self._filter.estimate(now)
        self._memory = aim.aimed(self._memory, estimate, self.path.end, now, self.config)
        return tuple(judgements)

    def _aim(self) -> None:
        """Give the core what the active part is to end in: a stop, its own end, or the goal."""
        if route.may_be_free(self._memory, self._memory.now, self._surroundings.changes):
            self._memory = route.released(self._memory)
        if self._memory.stop_at is not None:
            self._mpcc.set_stop(self._memory.stop_at)
        else:
            self._mpcc.set_goal(self._memory.goal if self._on_last_part else None)

    @property
    def _on_last_part(self) -> bool:
        return self._memory.part == len(self.path.parts) - 1

    def _core(self) -> RtiMpcc:
        index = self._memory.part
        return RtiMpcc(self.path.parts[index], self._surroundings.corridor, self.config, index=index)

    def _situation(self) -> Situation:
        """Where the command will begin to act, on the part that the vehicle is on by then."""
        if self._memory.trust.found:
            self._memory = replace(route.restart(self._memory), reached=None)
        situation = self._assess()
        if not route.may_change_direction(self._memory, situation, self.config.dead_time):
            return situation
        self._memory = route.next_part(self._memory)
        self._mpcc = self._core()
        self._aim()
        return self._assess()

    def _assess(self) -> Situation:
        return sensing.situation_of(
            self._memory, self._mpcc.part, self._mpcc.target, self.config, last_part=self._on_last_part
        )

    # -- what is driven -----------------------------------------------------------------------------

    def _act(self, situation: Situation, clock: CycleClock, *, new_obstacles: bool) -> Act:
        self._memory = route.noticed(self._memory, situation)
        if situation.doubt:
            return self._doubt(situation, situation.doubt)
        self._memory = route.decide(self._memory, situation, self.config)
        phase = self._memory.phase
        if phase is Phase.HOLDING:
            return self._hold(situation)
        waiting = aim.must_wait(self._memory, situation, self.config)
        if waiting and route.stands(self._memory, situation):
            self._memory = route.restart(self._memory)
            return self._stop(situation, Status.GOAL_LOST, waiting)
        if phase is Phase.STALLED:
            return self._stop(situation, Status.STALLED, "no plan from here ends inside the tolerance")
        if phase is Phase.SETTLING:
            wanted = ladder.landing(situation, self.config)
            return self._stop(situation, Status.SETTLING, "braking to rest at the target", wanted)
        if phase is Phase.STARTING:
            return self._start(situation, clock)
        if route.arrival_due(self._memory, situation, self.config) or (new_obstacles and self._plan_is_cut()):
            act = self._change_over(situation, clock)
            if act is not None:
                return act
        return self._iterate(situation, clock)

    def _doubt(self, situation: Situation, doubt: str) -> Act:
        """Drive on along the last plan for a moment, by what is believed; then brake."""
        memory = self._memory
        driving = memory.phase in (Phase.CONTOURING, Phase.ARRIVING) and not memory.latched
        if driving and situation.now - memory.trust.since <= self.config.plausibility.blind:
            act = self._go_on(memory, situation, doubt)
            if act is not None:
                return replace(act, status=Status.FAILED)
        return self._give_up(situation, doubt)

    def _start(self, situation: Situation, clock: CycleClock) -> Act:
        """Look for a first plan."""
        stands, latched = route.stands(self._memory, situation), self._memory.latched
        if stands and not route.looks_again(self._memory, situation):
            status = Status.FAILED if latched else Status.BLOCKED
            return self._stop(situation, status, f"standing, looks again soon: {latched or 'contact ahead'}")
        attempt, situation = self._begin(situation, clock)
        if self._memory.phase is Phase.HOLDING:
            return self._hold(situation)
        if not attempt.problem:
            return self._accept(attempt, situation)
        if latched and stands:
            self._memory = replace(self._memory, looked_at=situation.now)
        status = Status.FAILED if latched else Status.STARTING
        return self._stop(situation, status, attempt.problem, ladder.braking(self.config), attempt)

    def _change_over(self, situation: Situation, clock: CycleClock) -> Act | None:
        """Turn from the present plan to the first one of another objective; None: not yet."""
        driving = self._memory
        attempt, other = self._begin(situation, clock)
        if not attempt.problem and self._memory.phase is not Phase.HOLDING:
            return self._accept(attempt, other)
        self._memory = replace(driving, unfinished=self._memory.unfinished)
        self._aim()
        if route.too_late(driving, situation, self.config):
            wanted = ladder.braking(self.config)
            return self._stop(situation, Status.FAILED, attempt.problem, wanted, attempt)
        return None

    def _iterate(self, situation: Situation, clock: CycleClock) -> Act:
        """One real-time iteration, and the ladder if it gives no plan."""
        memory = self._memory
        attempt = self._search(situation, search.going_on(memory.solution), clock)
        if attempt.problem and not attempt.cut and memory.driven is not None:
            attempt = attempt.then(self._search(situation, search.clean(memory.driven), clock))
        if not attempt.problem:
            return self._accept(attempt, situation)
        act = self._go_on(self._memory, situation, attempt.problem, attempt)
        return act or self._give_up(situation, attempt.problem, attempt)

    def _search(self, situation: Situation, start: Start, clock: CycleClock) -> Attempt:
        """Iterate, and keep the last iterate that was solved to go on from."""
        attempt = search.converge(self._mpcc, self._memory, situation, start, clock)
        if attempt.solved is not None:
            self._memory = replace(self._memory, solution=attempt.solved)
        return attempt

    def _begin(self, situation: Situation, clock: CycleClock) -> tuple[Attempt, Situation]:
        """Search from a first guess; where something fills the way, for a stop before it."""
        self._memory = route.begin_phase(self._memory, situation, self.config)
        guess = search.first_guess(self._mpcc, self._memory, situation)
        unfinished = self._memory.unfinished
        start = search.from_guess(guess) if unfinished is None else search.resumed(unfinished)
        attempt = self._search(situation, start, clock)
        self._memory = search.left_unfinished(self._memory, situation.target, attempt)
        filled = not attempt.cut and (attempt.problem or attempt.squeezed)
        if filled and situation.free and self._surroundings.corridor.obstacles:
            way = self._way_to_contact(guess, inf)
            if way < inf:
                return self._begin_stop(attempt, situation, way, clock)
        if not attempt.problem:
            self._memory = route.begun(self._memory, situation)
        return attempt, situation

    def _begin_stop(
        self, attempt: Attempt, situation: Situation, way: float, clock: CycleClock
    ) -> tuple[Attempt, Situation]:
        left = way - contact.stop_clearance(self.config)
        self._memory = route.stop_before(self._memory, situation, left, self._surroundings.changes)
        self._aim()
        situation = self._assess()
        if self._memory.phase is Phase.HOLDING:
            return attempt, situation
        return self._begin(situation, clock)

    def _plan_is_cut(self) -> bool:
        """Whether something lies in the way of the plan being driven, however far along."""
        plan = self._memory.driven
        return plan is not None and self._way_to_contact(plan, inf) < inf

    def _way_to_contact(self, plan: Trajectory, reach: float) -> float:
        corridor = self._surroundings.corridor
        return contact.way_to_contact(plan, corridor, self._memory.part, self.config, reach)

    # -- the rungs of the ladder --------------------------------------------------------------------

    def _accept(self, attempt: Attempt, situation: Situation) -> Act:
        """Drive the plan of this cycle."""
        plan = attempt.solutions[-1].trajectory
        self._memory = replace(
            self._memory, driven=plan, accepted_at=situation.now, latched="", looked_at=None
        )
        return self._drive(plan, Source.SOLUTION, situation, "", attempt)

    def _go_on(
        self, memory: ControllerMemory, situation: Situation, problem: str, attempt: Attempt | None = None
    ) -> Act | None:
        """Drive the last accepted plan in this memory on; None if there is none that may be."""
        plan = ladder.driven_on(memory.driven, memory.accepted_at, situation, self.config)
        if plan is None:
            return None
        return self._drive(plan, Source.SHIFTED_PLAN, situation, problem, attempt)

    def _give_up(self, situation: Situation, problem: str, attempt: Attempt | None = None) -> Act:
        """Brake to a standstill; what moved begins afresh once there is a reason to."""
        if self._memory.phase not in (Phase.HOLDING, Phase.STALLED):
            self._memory = replace(route.restart(self._memory), latched=problem)
        return self._stop(situation, Status.FAILED, problem, ladder.braking(self.config), attempt)

    def _drive(
        self,
        plan: Trajectory,
        source: Source,
        situation: Situation,
        problem: str,
        attempt: Attempt | None,
    ) -> Act:
        """Drive a plan, unless its body meets something or the goal is not known well enough."""
        config, memory, rate = self.config, self._memory, float(plan.controls[0, DELTA_DOT])
        way = self._way_to_stop_in(plan, situation)
        self._memory = replace(memory, blocked=way is not None)
        if way is not None:
            wanted = ladder.before_contact(float(situation.state[V]), way, config)
            return self._stop(situation, Status.BLOCKED, f"contact in {way:.2f} m", wanted, attempt, rate)
        waiting = aim.must_wait(memory, situation, config)
        if waiting:
            return self._stop(situation, Status.GOAL_LOST, waiting, attempt=attempt, steering_rate=rate)
        return Act(
            drive=ladder.follow(plan.controls[0], source),
            status=Status.FOLLOWING if memory.arrive_at is None else Status.ARRIVING,
            reason=problem
            or ("" if situation.free else "making for a stop before something in the way")
            or aim.remark(memory),
            trajectory=plan,
            attempt=attempt,
        )

    def _way_to_stop_in(self, plan: Trajectory, situation: Situation) -> float | None:
        """Way to a contact that the vehicle must brake for now [m], or None."""
        need = contact.stopping_distance(float(situation.state[V]), self.config)
        reach = need + contact.CHECKED
        way = self._way_to_contact(plan, reach)
        return way if way <= (reach if self._memory.blocked else need) else None

    def _hold(self, situation: Situation) -> Act:
        if not situation.free:
            return self._stop(situation, Status.BLOCKED, "standing before something that fills the way")
        if not situation.last_part:
            return self._stop(situation, Status.CHANGING_DIRECTION, "standing at the cusp")
        if aim.never_seen(self._memory, self.config):
            return self._stop(situation, Status.SEARCHING, "standing at the planned goal, not detected yet")
        return self._stop(situation, Status.DOCKED, "standing inside the tolerance")

    def _stop(
        self,
        situation: Situation,
        status: Status,
        reason: str,
        deceleration: float | None = None,
        attempt: Attempt | None = None,
        steering_rate: float = 0.0,
    ) -> Act:
        """Brake at `deceleration` [m/s²], by default the comfort acceleration, and stand."""
        config, state = self.config, situation.state
        wanted = config.comfort_acceleration if deceleration is None else deceleration
        times = stage_times(
            situation.begin, stage_lengths(config.cruise_horizon, config.cycle, config.stages)
        )
        stands = route.stands(self._memory, situation)
        drive = ladder.hold(state, config) if stands else ladder.brake(state, wanted, config, steering_rate)
        return Act(
            drive=drive,
            status=status,
            reason=reason,
            trajectory=stopping_motion(state, times, wanted, config.vehicle.wheelbase),
            attempt=attempt,
        )

    def _remember(self, act: Act, situation: Situation) -> None:
        """Queue the command; a vehicle that stands blocked begins afresh."""
        drive = act.drive
        sent = QueuedCommand(situation.begin, drive.acceleration, drive.steering_rate)
        queue = (*still_acting(self._memory.queue, situation.now), sent)
        waiting = act.status is Status.GOAL_LOST
        self._memory = replace(self._memory, queue=queue, reached=situation.state, waiting=waiting)
        if act.status is Status.BLOCKED and self._memory.stop_at is None:
            if route.stands(self._memory, situation) and route.looks_again(self._memory, situation):
                self._memory = replace(route.restart(self._memory), looked_at=situation.now)
        elif not self._memory.latched:
            self._memory = replace(self._memory, looked_at=None)
