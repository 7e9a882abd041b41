"""Docks a foreign vehicle by a camera with faults, and says where it truly stands.

    OMP_NUM_THREADS=1 python -m benchmarks.foreign_goals [--draws N] [--seed S]

Three places: a path with a corridor and a roughly given goal, an area with a roughly given goal, and a
mission to a dock that says how wrong its pose may be and has a body that must not be touched.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from itertools import product
from math import cos, isnan, nan, pi, sin
from typing import Any, Literal

import numpy as np
import pandas as pd
import shapely

from benchmarks.foreign import Car, Ride, drive
from benchmarks.foreign_cameras import Bursts, DockCamera, MovingDock
from benchmarks.tables import command_line, table
from geometry import Area, Corridor, Pose2, ReferencePath
from rti_mpcc import (
    Approach,
    Command,
    ControllerConfig,
    Dock,
    DockingController,
    DockingMission,
    DockKind,
    GoalFilterConfig,
    GoalTracking,
    Vehicle,
)

Place = Literal["path", "area", "mission"]
PLACES: tuple[Place, ...] = ("path", "area", "mission")
CYCLE = 0.05  # [s]
TOLERANCE = (0.05, 0.05, 0.0349)
UNCERTAINTY = (1.0, 0.26)
BODY = ((-5.0, -1.1), (-2.0, -1.1), (-2.0, 1.1), (-5.0, 1.1))
"""What is docked at, in the frame of the dock [m]: 1.2 m behind the body of the docked vehicle."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One ride: where, the true dock, how far off the planned one is (in its frame), and the camera.

    It lasts `seconds`, at most `after` [s] after the first DOCKED; a dock that moves is
    followed or waited for.
    """

    place: Place
    dock: MovingDock
    off: Pose2
    camera: Callable[[MovingDock], DockCamera]
    seed: int = 0
    seconds: float = 120.0
    follows: bool = False
    after: float = 3.0

    @property
    def planned(self) -> Pose2:
        """The goal that is given."""
        return self.dock.pose.compose(self.off)


def config(*, follows: bool = False) -> ControllerConfig:
    """The settings: all defaults, but whether a dock that moves is followed."""
    tracking = GoalTracking(filter=GoalFilterConfig(moving=follows))
    return ControllerConfig(cycle=CYCLE, deadline=None, goal_tracking=tracking)


def ride(case: Case) -> Ride:
    """What truly happens."""
    steps, start, goal = _controlled(case)
    return drive(
        steps,
        Car.of(Vehicle()),
        start,
        cycle=CYCLE,
        seconds=case.seconds,
        camera=case.camera(case.dock),
        goal=goal,
        seed=case.seed,
        after_docked=case.after,
    )


def _controlled(case: Case) -> tuple[Callable[..., Command], Pose2, Pose2 | None]:
    """The step of a controller or a mission, where it starts, and the goal that it is given."""
    settings = config(follows=case.follows)
    if case.place == "path":
        path = straight_in()
        corridor = Corridor.from_offsets(path, left=5.0, right=-5.0, narrowings=[])
        return DockingController(path, corridor, settings).step, path.start, case.planned
    area = Area(boundary=[[-12.0, -12.0], [12.0, -12.0], [12.0, 14.0], [-12.0, 14.0]])
    controller, start = DockingController.in_area(area, settings), Pose2(-6.0, 6.0, 0.0)
    if case.place == "area":
        return controller.step, start, case.planned
    dock = Dock(
        case.planned,
        kind=DockKind.DETECTED,
        approach=Approach(2.0, -1),
        body=BODY,
        uncertainty=UNCERTAINTY,
        tolerance=TOLERANCE,
    )
    return DockingMission(controller, [dock]).step, start, None


def straight_in() -> ReferencePath:
    """10 m in reverse, bent to the right, then straight."""
    segments = [(-1, -0.1, 6.0), (-1, 0.0, 6.0)]
    return ReferencePath.from_segments(start=Pose2(0.0, 0.0, 0.5 * pi), segments=segments)


def drawn(place: Place, seed: int, **camera: Any) -> Case:
    """A case with the dock and the planned pose at random."""
    rng = np.random.default_rng(seed)
    x, y, turn = rng.uniform(-1.0, 1.0, 3) * (0.4, 0.4, 0.08)
    if place == "path":
        dock = straight_in().end.compose(Pose2(x, y, turn))
    else:
        dock = Pose2(2.0 + 5.0 * x, -2.0 + 2.0 * y, 0.5 * pi + 2.0 * turn)
    bearing, far, wrong = rng.uniform(0.0, 2.0 * pi), rng.uniform(0.1, 0.6), rng.uniform(-0.1, 0.1)
    off = Pose2(far * cos(bearing), far * sin(bearing), wrong)
    return Case(
        place=place,
        dock=MovingDock(pose=dock),
        off=off,
        camera=lambda truth: DockCamera(dock=truth, **camera),
        seed=seed,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What became of a case.

    Attributes:
        docked_at: when it first said DOCKED [s], or None.
        wrong: the longest time for which it said so outside of the true tolerance [s].
        touched: the body of the vehicle met the true one of the dock; stands: at the end.
        reason: the last one.
    """

    docked_at: float | None
    wrong: float
    touched: bool
    stands: bool
    reason: str


def judged(case: Case, done: Ride) -> Outcome:
    """The ride against the truth."""
    wrong = now = 0.0
    for t, command in zip(done.stamps, done.commands, strict=True):
        at = min(int(np.searchsorted(done.truth[:, 0], t - 1e-9)), len(done.truth) - 1)
        outside = command.docked and not done.inside(case.dock.at(float(t)), TOLERANCE, at)
        now = now + CYCLE if outside else 0.0
        wrong = max(wrong, now)
    goal = case.dock.at(float(done.truth[-1, 0]))
    body = shapely.Polygon([(p.x, p.y) for p in (goal.compose(Pose2(x, y, 0.0)) for x, y in BODY)])
    return Outcome(
        docked_at=done.docked_at,
        wrong=wrong,
        touched=case.place == "mission" and done.touches(body),
        stands=abs(float(done.truth[-1, 4])) < 0.01,
        reason=done.commands[-1].diagnostics.reason,
    )


FAULTS: dict[str, dict[str, Any]] = {
    "clean": {},
    "flips 10 %": {"flips": 0.1},
    "flips 30 %": {"flips": 0.3},
    "flips 50 %": {"flips": 0.5},
    "flips 100 %": {"flips": 1.0},
    "flips 30 % about a marker 2.6 m behind": {"flips": 0.3, "lever": -2.6},
    "bursts": {"bursts": Bursts()},
    "bursts from 1.5 s on": {"bursts": Bursts(first=1.5)},
    "bursts of 0.2 m": {"bursts": Bursts(offset=(0.2, 0.0, 0.0), first=0.7)},
    "stamps in ms": {"unit": 1000.0},
    "stamps 2 s old": {"late": 2.0},
}


SPEEDS = (0.05, 0.1, 0.3)
MOTIONS: dict[str, tuple[float, bool]] = {
    f"dock moves at {speed} m/s, {'followed' if follows else 'waited for'}": (speed, follows)
    for speed in SPEEDS
    for follows in (False, True)
}
"""Speed [m/s], and whether the dock is followed."""
MOVED_BY = {"path": 0.6, "area": 0.6, "mission": 0.3}
"""[m]; in a mission the dock stays within its uncertainty of the planned pose."""


def case_of(fault: str, place: Place, seed: int) -> Case:
    """A random case with a fault of `FAULTS` or a motion of `MOTIONS`."""
    if fault in FAULTS:
        case = drawn(place, seed, **FAULTS[fault])
        return replace(case, seconds=40.0) if fault.startswith(("stamps", "flips 100")) else case
    (speed, follows), case = MOTIONS[fault], drawn(place, seed)
    rng = np.random.default_rng(seed)
    bearing, begin = rng.uniform(0.0, 2.0 * pi), rng.uniform(2.0, 20.0 if place == "path" else 35.0)
    dock = replace(
        case.dock,
        velocity=(speed * cos(bearing), speed * sin(bearing)),
        begin=begin,
        end=begin + MOVED_BY[place] / speed,
    )
    return replace(case, dock=dock, follows=follows, after=50.0)


def main() -> None:
    parser = command_line(__doc__, "python -m benchmarks.foreign_goals")
    parser.add_argument("--draws", type=int, default=2, help="rides for each fault and place")
    parser.add_argument("--seed", type=int, default=5400, help="random seed of the first ride")
    parser.add_argument("--faults", nargs="*", default=[*FAULTS, *MOTIONS], help="names; default: all")
    asked = parser.parse_args()
    rows = []
    for place, seed, fault in product(PLACES, range(asked.seed, asked.seed + asked.draws), asked.faults):
        case = case_of(fault, place, seed)
        rows.append({"fault": fault, "place": place, "seed": seed, **asdict(judged(case, ride(case)))})
        print(*rows[-1].values(), sep=" | ", flush=True)
    print(summary(pd.DataFrame(rows)))


def summary(rides: pd.DataFrame) -> str:
    """The table of docs/decisions/16-goal-filter.md."""
    clean = rides[rides["fault"] == "clean"].set_index(["place", "seed"])["docked_at"].rename("clean")
    rides = rides.join(clean, on=["place", "seed"])
    rides["share"] = rides["docked_at"].astype(float) / rides["clean"].astype(float)
    rows = []
    for fault, own in rides.groupby("fault", sort=False):
        share = own["share"].max() if fault in FAULTS else nan
        most = "–" if isnan(share) else f"{share:.2f}"
        docked, touched = own["docked_at"].count(), own["touched"].sum()
        rows.append([str(fault), f"{docked} of {len(own)}", most, f"{own['wrong'].max():.1f}", str(touched)])
    header = ["fault", "docked", "time / clean, at most", "DOCKED outside, at most [s]", "touched"]
    return table(header, rows)


if __name__ == "__main__":
    main()
