"""Plans routes in random scenes and public parking cases, and writes the tables of docs/planning.md.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_planner [--count 40] [--seed 99]

The parking cases are read from ../shared/parking where that is there; without it their table stays. They are
driven, too, with comfort values as large as the limits. Times are CPU times of a process in which the kernels
are loaded.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from time import process_time

import numpy as np

from benchmarks.problems.scenes import KINDS, drawn_scene
from benchmarks.tables import ROOT, command_line, number, origin, replace_block, table, told
from geometry import Area, Pose2
from rti_mpcc import ControllerConfig, Manoeuvre
from rti_mpcc.route_planner.planner import RoutePlanning
from rti_mpcc.route_planner.problem import RouteProblem
from rti_mpcc.simulation import Scenario, changed, load_scenario, simulate, summary

COMMAND = "python -m benchmarks.measure_planner"
PAGE = ROOT / "docs" / "planning.md"
PARKING = ROOT.parent / "shared" / "parking"


@dataclass(frozen=True, slots=True, kw_only=True)
class Planned:
    """A way and what it took: CPU time in all and of the longest slice [s]."""

    manoeuvre: Manoeuvre
    seconds: float
    slice: float

    @property
    def stops(self) -> int:
        """Stops within a direction, at which only the wheels are turned."""
        directions = [segment.part.direction for segment in self.manoeuvre.segments]
        return sum(one == two for one, two in pairwise(directions))


def planned(start: Pose2, goal: Pose2, area: Area, config: ControllerConfig) -> Planned:
    """Plan slice by slice."""
    planning, slices = RoutePlanning(RouteProblem.of(start, goal, area, config)), []
    while planning.manoeuvre is None:
        begun = process_time()
        planning.advance()
        slices.append(process_time() - begun)
    return Planned(manoeuvre=planning.manoeuvre, seconds=sum(slices), slice=max(slices))


def scenes(count: int, seed: int) -> str:
    """A row for each kind of random scene."""
    rows = []
    for kind in KINDS:
        found = []
        for index in range(count):
            scene = drawn_scene(seed, index, kind)
            config = ControllerConfig(
                vehicle=scene.vehicle, limits=scene.limits, comfort_acceleration=scene.comfort_acceleration
            )
            area = Area(boundary=scene.boundary, obstacles=scene.obstacles)
            found.append(planned(scene.start, scene.goal, area, config))
        ways = [each for each in found if each.manoeuvre.found]
        clear = [each.manoeuvre.clearance for each in ways]
        rows.append(
            [
                kind,
                f"{len(ways)} of {count}",
                milliseconds(each.seconds for each in found),
                milliseconds(each.slice for each in found),
                f"{number(float(np.median(clear)), 2)} ({number(min(clear), 3)})",
                number(float(np.mean([each.manoeuvre.cusps for each in ways])), 1),
                str(sum(each.stops > 0 for each in ways)),
            ]
        )
    header = [
        "kind", "found", "CPU time, median / p95 / most [ms]", "longest slice, the same [ms]",
        "clearance, median (least) [m]", "cusps, mean", "with stops to steer",
    ]  # fmt: skip
    return table(header, rows)


def driven(scenario: Scenario) -> list[str]:
    """Time to dock [s] and least clearance [m] in closed loop, comfort being all that the limits allow."""
    limits = scenario.limits
    brisk = {
        "controller.comfort_acceleration": limits.acceleration,
        "controller.comfort_steering_rate": limits.steering_rate,
    }
    told = summary(simulate(changed(scenario, brisk)))
    return [number(told["time_to_dock_s"], 1), number(told["min_clearance_m"], 3)]


def parking() -> str:
    """A row for each public parking case."""
    rows = []
    for file in sorted(PARKING.glob("*.toml")):
        scenario = load_scenario(str(file))
        config, area = scenario.controller_config(), scenario.build_area()
        goal = Pose2(*(scenario.goal.pose or (0.0, 0.0, 0.0)))
        each = planned(scenario.start_pose(), goal, area, config)
        way = each.manoeuvre
        figures = (
            [number(way.length, 1), str(way.cusps), number(way.clearance, 3)] if way.found else ["–"] * 3
        )
        loop = driven(scenario) if way.found else ["–"] * 2
        rows.append([file.stem, *figures, milliseconds([each.seconds]), milliseconds([each.slice]), *loop])
    header = [
        "case", "length [m]", "cusps", "clearance [m]", "CPU time [ms]", "longest slice [ms]",
        "time to dock [s]", "clearance driven [m]",
    ]  # fmt: skip
    return table(header, rows)


def milliseconds(seconds: Iterable[float]) -> str:
    """Median, 95th percentile and most; of one figure that."""
    values = 1e3 * np.array(list(seconds))
    if len(values) == 1:
        return number(float(values[0]), 0)
    return " / ".join(
        number(float(each), 0) for each in (np.median(values), np.percentile(values, 95), values.max())
    )


def main() -> None:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("--count", type=int, default=40, help="scenes of each kind; default: %(default)s")
    parser.add_argument("--seed", type=int, default=99, help="of the scenes; default: %(default)s")
    given = parser.parse_args()
    source = origin(f"{COMMAND} --count {given.count} --seed {given.seed}")
    planned(
        Pose2(0.0, 0.0, 0.0), Pose2(9.0, 3.0, 0.0), Area(), ControllerConfig()
    )  # loads all there is to load
    replace_block(PAGE, "scenes", f"{scenes(given.count, given.seed)}\n\n{told(source)}")
    if PARKING.is_dir():
        replace_block(PAGE, "parking", f"{parking()}\n\n{told(source)}")


if __name__ == "__main__":
    main()
