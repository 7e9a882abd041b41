"""Drives past people, through narrow lanes and on slopes, and writes the tables of docs/obstacles.md.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_obstacles [--walkers 20]

The plant and the judge are those of the tests, not the product's.
"""

from __future__ import annotations

from math import radians

import numpy as np

from benchmarks.collisions import meet
from benchmarks.encounters import Car, Drive, drive
from benchmarks.tables import ROOT, command_line, number, origin, replace_block, table, told
from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController
from rti_mpcc.simulation import load_scenario

COMMAND = "python -m benchmarks.measure_obstacles"
SEED = 77
"""Of the people: not the tests'."""
LANES = ((0.0, (3.0, 1.5, 1.25, 1.15, 1.1)), (1.0 / 33.0, (3.0, 1.5, 1.35, 1.3)))
SLOPES = ((0.0, 0.0), (0.3, 0.0), (-0.3, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.0, 2.0), (0.0, -2.0), (0.5, 2.0))


def hardest(found: Drive) -> float:
    """Largest acceleration that was commanded [m/s²]."""
    return max(abs(command.acceleration) for command in found.commands)


def walkers(count: int) -> str:
    rows = []
    for lag in (0.0, 0.2):
        runs = [meet(number, SEED, lag=lag) for number in range(count)]
        found = [each for _, each in runs]
        accelerations = [hardest(each) for each in found]
        rows.append(
            [
                f"{lag:g} s",
                str(count),
                str(sum(any(contact.front for contact in each.collisions) for each in found)),
                str(sum(bool(each.contacts) for each in found)),
                str(sum(bool(each.resumptions) for each in found)),
                f"{np.median(accelerations):.2f}, {max(accelerations):.2f}",
                str(sum(each.docked for each in found)),
            ]
        )
    header = (
        "lag",
        "people",
        "collisions",
        "contacts",
        "stops",
        "a: median, most [m/s²]",
        "docked",
    )
    return table(header, rows)


def lanes() -> str:
    rows = []
    for curvature, halves in LANES:
        for half in halves:
            path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, curvature, 40.0)])
            config = ControllerConfig(dead_time=0.18, deadline=None)
            corridor = Corridor.from_offsets(path, left=half, right=-half)
            found = drive(DockingController(path, corridor, config), Car(config=config), path.start, 150.0)
            docked = number(float(found.times[-1]) - 0.45, 1) if found.docked else "no"
            speed = float(np.abs(found.states[:, 3]).max())
            rows.append(
                [
                    "straight" if curvature == 0.0 else "bend",
                    f"{half:g}",
                    f"{speed:.2f}",
                    f"{hardest(found):.2f}",
                    docked,
                ]
            )
    return table(("lane", "half width [m]", "top speed [m/s]", "most a [m/s²]", "docked [s]"), rows)


def slopes() -> str:
    scenario, rows = load_scenario("docking_full_course"), []
    path = scenario.build_path()
    goal, config = scenario.goal_pose(), scenario.controller_config("default")
    for slope, offset in SLOPES:
        car = Car(config=config, slope=slope, offset=radians(offset))
        controller = DockingController(path, scenario.build_corridor(path), config)
        found = drive(controller, car, path.start, 120.0, goal=goal)
        error = Pose2(*found.states[-1, :3].tolist()).relative_to(goal)
        docked = number(float(found.times[-1]) - 0.45, 1) if found.docked else "no"
        rows.append([f"{slope:+g}", f"{offset:+g}", docked, f"{1e3 * error.x:+.0f}", f"{1e3 * error.y:+.0f}"])
    header = ("slope [m/s²]", "wheels off by [deg]", "docked [s]", "along [mm]", "across [mm]")
    return table(header, rows)


def main() -> None:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("--walkers", type=int, default=20, metavar="N", help="people for each plant")
    count = parser.parse_args().walkers
    source = origin(COMMAND if count == 20 else f"{COMMAND} --walkers {count}")
    page = ROOT / "docs" / "obstacles.md"
    for name, text in (("lanes", lanes()), ("slopes", slopes()), ("walkers", walkers(count))):
        replace_block(page, name, f"{text}\n\n{told(source)}")


if __name__ == "__main__":
    main()
