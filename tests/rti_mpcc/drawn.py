"""What the property tests tell a controller: a sequence of cycles with tame, spoiled and wild inputs.

A cycle is drawn as plain values, so that a failing example prints as something to be typed in; `told` turns
them into arguments of `step` once it is known where the vehicle is by then.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import inf, isfinite, nan, pi
from typing import Any

import numpy as np
from hypothesis import strategies as st

from estimation import Frame, GoalMeasurement
from geometry import Pose2
from rti_mpcc import VehicleState
from rti_mpcc.config import EXIT
from tests.rti_mpcc.worlds import OF_ONE_PART, WORLDS, Setting, World, box

EXTREMES = (0.0, -0.0, pi, -pi, 1e-300, 5e-324, 1e9, -1e9, 1e17, 1e300, -1e300, 1.7e308, inf, -inf, nan)
WILD = st.one_of(st.sampled_from(EXTREMES), st.floats())
Outline = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """Beside the route at a `share` of its length, [m], [rad]; the speed is in shares of its limit."""

    share: float
    along: float
    across: float
    turned: float
    speed: float
    steering: float

    def pose(self, world: World) -> Pose2:
        return world.pose(self.share).compose(Pose2(self.along, self.across, self.turned))


@dataclass(frozen=True, slots=True, kw_only=True)
class Spoiled:
    """One number of something that is tame otherwise is replaced."""

    field: int
    value: float


Numbers = tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Detected:
    """A detection: a place or wild numbers, `age` [s] before now or a wild stamp, and a covariance."""

    at: Placed | Numbers
    age: float
    frame: Frame
    spread: Numbers | None
    """Diagonal (3) or all (9) of the covariance."""

    def made(self, world: World, here: Pose2, now: float) -> GoalMeasurement:
        values = self.at
        if isinstance(values, Placed):
            pose = values.pose(world)
            pose = pose.relative_to(here) if self.frame is Frame.VEHICLE else pose
            values = (pose.x, pose.y, pose.phi)
        spread = None if self.spread is None else np.array(self.spread)
        if spread is not None:
            spread = np.diag(spread) if len(spread) == 3 else spread.reshape(3, 3)
        x, y, phi = values
        return GoalMeasurement(stamp=now - self.age, x=x, y=y, phi=phi, covariance=spread, frame=self.frame)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """What one step is told.

    Attributes:
        passed: since the last step [s]; None: one cycle; (now,): whatever the clock shows then.
        state: None: where the last commands have led; a place, to which the vehicle is moved; or five wild
            numbers, which are measured once.
        spoiled: one number of the state is replaced, this once.
        goal, measurements: see there.
        obstacles: outlines; a Placed is a box.
    """

    passed: float | tuple[float] | None = None
    state: Placed | Numbers | None = None
    spoiled: Spoiled | None = None
    goal: Placed | Numbers | None = None
    measurements: tuple[Detected, ...] = ()
    obstacles: tuple[Placed | Outline, ...] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A route and corridor by number, settings, where the vehicle begins, and the cycles."""

    world: int
    setting: Setting
    start: Placed
    cycles: tuple[Cycle, ...]


def pose_of(numbers: Numbers) -> Pose2:
    """A pose of any numbers, as a bridge would hand it over that checks nothing."""
    pose = object.__new__(Pose2)
    for name, value in zip(("x", "y", "phi"), numbers, strict=True):
        object.__setattr__(pose, name, value)
    return pose


def measured(cycle: Cycle, state: VehicleState) -> VehicleState:
    """What is measured of a state."""
    if isinstance(cycle.state, tuple):
        state = VehicleState(*cycle.state)
    if cycle.spoiled is None:
        return state
    values = [getattr(state, field.name) for field in fields(VehicleState)]
    values[cycle.spoiled.field] = cycle.spoiled.value
    return VehicleState(*values)


def placed_state(place: Placed, world: World, limit: float) -> VehicleState:
    """A state at a place, `limit` the speed limit [m/s]."""
    pose = place.pose(world)
    return VehicleState(x=pose.x, y=pose.y, phi=pose.phi, v=limit * place.speed, delta=place.steering)


def told(cycle: Cycle, world: World, here: Pose2, now: float) -> dict[str, Any]:
    """Goal, measurements and obstacles as arguments of `step`."""
    found: dict[str, Any] = {}
    if cycle.goal is not None:
        placed = isinstance(cycle.goal, Placed)
        found["goal"] = cycle.goal.pose(world) if placed else pose_of(cycle.goal)  # type: ignore[union-attr, arg-type]
    if cycle.measurements:
        found["measurements"] = [m.made(world, here, now) for m in cycle.measurements]
    if cycle.obstacles is not None:
        found["obstacles"] = [
            box(world.pose(o.share), o.along, o.across, 0.1 + abs(o.turned))
            if isinstance(o, Placed)
            else _array(o)
            for o in cycle.obstacles
        ]
    return found


def _array(outline: Outline) -> Any:
    """An array where the rows allow one, otherwise the rows as they are."""
    lengths = {len(row) for row in outline}
    return np.array(outline) if len(lengths) == 1 else [list(row) for row in outline]


# -- strategies ------------------------------------------------------------------------------------------


def around(bound: float) -> st.SearchStrategy[float]:
    return st.floats(-bound, bound)


def placed(beside: float, turned: float) -> st.SearchStrategy[Placed]:
    """So many metres and radians off the route at most."""
    return st.builds(
        Placed,
        share=st.floats(0.0, 1.0),
        along=around(beside),
        across=around(beside),
        turned=around(turned),
        speed=around(1.5),
        steering=around(0.9),
    )


def standing_at_the_end(beside: float, turned: float) -> st.SearchStrategy[Placed]:
    """Of the route, or so many metres and radians off it at most."""
    return st.builds(
        Placed,
        share=st.just(1.0),
        along=around(beside),
        across=around(beside),
        turned=around(turned),
        speed=st.just(0.0),
        steering=st.just(0.0),
    )


def numbers(count: int) -> st.SearchStrategy[Numbers]:
    """Wild ones."""
    return st.tuples(*[WILD] * count)


BESIDE, NEAR, FAR = placed(0.3, 0.1), placed(3.0, 1.2), placed(200.0, 10.0)
ENDS = standing_at_the_end(2.0, 0.4)
SPREADS = st.one_of(st.none(), st.just((0.0025, 0.0025, 0.001)), numbers(3), numbers(9))
DETECTIONS = st.builds(
    Detected,
    at=st.one_of(ENDS, ENDS, FAR, numbers(3)),
    age=st.one_of(st.just(0.0), st.floats(-0.1, 1.0), WILD),
    frame=st.sampled_from(Frame),
    spread=SPREADS,
)
OUTLINES = st.one_of(
    NEAR,
    NEAR,
    FAR,
    st.lists(st.tuples(around(60.0), around(60.0)), min_size=3, max_size=6).map(tuple),
    st.lists(numbers(2), max_size=5).map(tuple),
    st.lists(st.one_of(numbers(1), numbers(2), numbers(3)), max_size=4).map(tuple),
)


def often(usual: Any, *others: st.SearchStrategy[Any], times: int = 6) -> st.SearchStrategy[Any]:
    """The usual value, and each other one so many times less often."""
    # Each an object of its own: of the same strategy twice `one_of` would keep one.
    return st.one_of(*[st.just(usual) for _ in range(times)], *others)


CYCLES = st.builds(
    Cycle,
    passed=often(
        None, st.floats(0.0, 0.5), st.sampled_from([0.0, -1.0, 2.0, 1e4]), WILD, st.tuples(WILD), times=30
    ),
    state=often(None, NEAR, FAR, numbers(5), times=40),
    spoiled=often(None, st.builds(Spoiled, field=st.integers(0, 4), value=WILD), times=12),
    goal=often(None, ENDS, NEAR, FAR, numbers(3), times=20),
    measurements=often((), st.lists(DETECTIONS, min_size=1, max_size=3).map(tuple), times=3),
    obstacles=often(None, st.lists(OUTLINES, max_size=3).map(tuple), times=12),
)
SHAKEN = st.builds(
    Cycle,
    passed=often(None, st.floats(0.0, 0.5), times=10),
    state=often(None, standing_at_the_end(0.12, 0.06), numbers(5), times=6),
    goal=often(None, standing_at_the_end(0.12, 0.06), times=10),
)


def drawn_settings(
    required: st.SearchStrategy[bool], deadline: st.SearchStrategy[float | None]
) -> st.SearchStrategy[Setting]:
    return st.builds(
        Setting,
        preset=often("default", st.sampled_from(["paper", "paper_printed"]), times=3),
        cycle=st.sampled_from([0.05, 0.005, 0.02, 0.1, 0.2]),
        dead_time=st.sampled_from([0.0, 0.18, 0.5]),
        stages=often(10, st.sampled_from([20, 70]), times=5),
        required=required,
        deadline=deadline,
        speed=st.sampled_from([10.0, 3.0, 1.0]),
        iterations=often(400, st.sampled_from([5, 100])),
    )


BEGIN = Placed(share=0.0, along=0.0, across=0.0, turned=0.0, speed=0.0, steering=0.0)
STARTS = often(BEGIN, NEAR, BESIDE, ENDS, standing_at_the_end(0.06, 0.03), FAR, times=3)
DRIVING = st.builds(
    Run,
    world=st.integers(0, WORLDS - 1),
    setting=drawn_settings(st.booleans(), often(None, st.sampled_from([0.02, EXIT + 1e-6]), times=8)),
    start=STARTS,
    cycles=st.lists(CYCLES, min_size=5, max_size=20).map(tuple),
)
DOCKED = st.builds(
    Run,
    world=st.sampled_from(OF_ONE_PART),
    setting=drawn_settings(st.just(False), st.none()),
    start=standing_at_the_end(0.04, 0.02),
    cycles=st.lists(st.one_of(SHAKEN, CYCLES), min_size=5, max_size=20).map(tuple),
)
RUNS = st.integers(0, 7).flatmap(lambda lot: DRIVING if lot else DOCKED)
"""One in eight begins inside the tolerance of its goal."""


def is_finite(state: VehicleState) -> bool:
    return all(isfinite(getattr(state, field.name)) for field in fields(VehicleState))
