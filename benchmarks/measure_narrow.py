"""What is narrow: the smallest bays and gaps that are docked in, and how long the hardest cycles take.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_narrow [--draws 10] [--seed 1] [--docs]

Bays are drawn: a bend, then straight into a bay as deep as the body is long, forward or in reverse, with so
much beside the body. Walls stand so far ahead of a goal, or behind one that is driven to in reverse, at the
end of a drawn bend. Lanes that leave 0.25 m on either side of the body, with bends one way, both ways and as
sharp as can be driven, tell how long cycles are where most rows act. Prints the tables and, with `--docs`,
writes them into docs/performance.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import process_time
from typing import Any

import numpy as np
from rich.progress import track

from benchmarks.problems.case import CampaignCase
from benchmarks.problems.levels import Level
from benchmarks.tables import command_line, named, number, origin, publish, table, told
from rti_mpcc.config import Vehicle
from rti_mpcc.simulation import RunResult, Scenario, load_scenario, scenario_from_dict, simulate, summary
from rti_mpcc.simulation.campaign import drive_case
from rti_mpcc.types import Array

COMMAND = "python -m benchmarks.measure_narrow"
ROOM = (0.25, 0.15, 0.1, 0.08)
"""Beside the body in a bay, or ahead of it at a goal [m]."""
LANE_ROOM = 0.25
"""On either side of the body in the lanes [m]."""
VEHICLE = Vehicle()
Draw = Callable[[np.random.Generator, float], Scenario]


def scenario(segments: Sequence[tuple[int, float, float]], corridor: dict[str, Any]) -> Scenario:
    """A goal at the end of a route (direction, curvature, length) in a corridor."""
    parts = [dict(zip(("direction", "curvature", "length"), one, strict=True)) for one in segments]
    return scenario_from_dict(
        {
            "name": "narrow",
            "path": {"start": [0.0, 0.0, 0.0], "segments": parts},
            "corridor": corridor,
            "goal": {"offset": [0.0, 0.0, 0.0]},
            "simulation": {"dead_time": 0.18, "cycle": 0.05, "duration": 90.0},
        }
    )


def bend(random: np.random.Generator) -> tuple[float, float]:
    """Curvature [1/m], to either side, and length [m]."""
    return float(random.choice([-1.0, 1.0]) * random.uniform(0.05, 0.15)), float(random.uniform(6.0, 12.0))


def bay(random: np.random.Generator, room: float) -> Scenario:
    """A lane 3 m to both sides that ends in a bay."""
    direction, (curvature, length) = int(random.choice([-1, 1])), bend(random)
    deep = VEHICLE.front + VEHICLE.rear
    straight = float(random.uniform(8.0, 12.0)) + deep
    half, end = 0.5 * VEHICLE.width + room, length + straight
    reach = VEHICLE.front if direction > 0 else VEHICLE.rear
    narrow = {"from": end + reach - deep, "to": end, "left": half, "right": -half}
    return scenario(
        [(direction, curvature, length), (direction, 0.0, straight)],
        {"left": 3.0, "right": -3.0, "narrowings": [narrow]},
    )


def before_a_wall(random: np.random.Generator, room: float) -> Scenario:
    """A goal behind a bend with a wall ahead of the leading end of the body."""
    direction, (curvature, length) = int(random.choice([-1, 1])), bend(random)
    straight = float(random.uniform(6.0, 12.0))
    segments = [(direction, curvature, length), (direction, 0.0, straight)]
    free = scenario(segments, {"left": 4.0, "right": -4.0})
    end = free.build_path().end
    leading = VEHICLE.front if direction > 0 else VEHICLE.rear
    along = direction * np.array([np.cos(end.phi), np.sin(end.phi)])
    across = np.array([-along[1], along[0]])
    near = np.array([end.x, end.y]) + (leading + room) * along
    outline = [near - 1.5 * across, near + 0.5 * along - 1.5 * across]
    outline += [near + 0.5 * along + 1.5 * across, near + 1.5 * across]
    obstacle = [point.tolist() for point in outline]
    return scenario(segments, {"left": 4.0, "right": -4.0, "obstacles": [obstacle]})


def lanes(random: np.random.Generator) -> dict[str, Scenario]:
    """Lanes that leave LANE_ROOM on either side."""
    half = 0.5 * VEHICLE.width + LANE_ROOM
    corridor = {"left": half, "right": -half}
    gentle, (_, length) = float(random.uniform(0.03, 0.06)), bend(random)
    return {
        "straight lane": scenario([(1, 0.0, 30.0)], corridor),
        "bend in a lane": scenario([(1, 0.0, 8.0), (1, gentle, length), (1, 0.0, 8.0)], corridor),
        "S-bend in a lane": scenario(
            [(1, 0.0, 6.0), (1, gentle, length), (1, -gentle, length), (1, 0.0, 6.0)], corridor
        ),
        "S-bend in reverse": scenario(
            [(-1, 0.0, 6.0), (-1, gentle, length), (-1, -gentle, length), (-1, 0.0, 6.0)], corridor
        ),
        "corner": scenario(
            [(1, 0.0, 8.0), (1, 0.2, 7.8), (1, 0.0, 8.0)],
            {
                "left": 3.0,
                "right": -3.0,
                "narrowings": [{"from": 6.0, "to": 9.0, "left": half + 0.2, "right": -half - 0.2}],
            },
        ),
    }


def docked(draw: Draw, draws: int, seed: int, what: str) -> list[list[str]]:
    """For each gap the numbers of docked and of touched goals, and the least clearance."""
    rows = []
    for room in ROOM:
        random = np.random.default_rng(seed)
        drives = [
            summary(simulate(draw(random, room)))
            for _ in track(range(draws), f"{what}, {room} m", transient=True)
        ]
        near = [drive["min_clearance_m"] for drive in drives]
        rows.append(
            [
                what,
                number(room, 2),
                f"{sum(drive['docked'] for drive in drives)} of {draws}",
                str(sum(least <= 0.0 for least in near)),
                number(min(near), 3),
                number(float(np.median([drive["time_to_dock_s"] or np.inf for drive in drives])), 1),
                str(sum(drive["fallback_cycles"] > 0 for drive in drives)),
            ]
        )
    return rows


def cycles(result: RunResult) -> Array:
    """Times (n,) of the cycles but the first [ms]."""
    return np.asarray(result.cycles.step_ms[1:])


def hardest(draws: int, seed: int) -> list[list[str]]:
    """Cycles of the lanes, next to those of docking_inside."""
    random, rows = np.random.default_rng(seed), []
    usual = simulate(load_scenario("docking_inside"))
    median = float(np.median(cycles(usual)))
    drawn: dict[str, list[RunResult]] = {"docking_inside": [usual]}
    for _ in track(range(draws), "lanes", transient=True):
        for name, one in lanes(random).items():
            drawn.setdefault(name, []).append(simulate(one))
    for name, results in drawn.items():
        times = np.concatenate([cycles(result) for result in results])
        p50, p99 = (float(np.percentile(times, share)) for share in (50.0, 99.0))
        worst = max(float(np.percentile(cycles(result), 99.0)) for result in results)
        first = [float(result.cycles.step_ms[0]) for result in results]
        figures = [p50, p99, worst, float(np.median(first)), max(first)]
        rows.append(
            [
                name,
                f"{sum(result.ended == 'docked' for result in results)} of {len(results)}",
                *(number(value, 2) for value in figures),
                number(p99 / median, 1),
                number(worst / median, 1),
            ]
        )
    return rows


def throughput(cases: int, seed: int) -> list[list[str]]:
    """Campaign cases a second of CPU, their drawing included."""
    rows = []
    for level in (Level.NOMINAL, Level.HARD):
        begun = process_time()
        for index in track(range(cases), f"cases, {level.value}", transient=True):
            drive_case(CampaignCase(seed=seed, level=level, index=index))
        seconds = process_time() - begun
        rows.append([level.value, str(cases), number(cases / seconds, 2)])
    return rows


def main() -> None:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("--draws", type=int, default=10, help="of each kind; default: %(default)s")
    parser.add_argument("--seed", type=int, default=1, help="random seed; default: %(default)s")
    parser.add_argument("--docs", action="store_true", help="write docs/performance.md")
    asked = parser.parse_args()
    source = origin(f"{COMMAND} --draws {asked.draws} --seed {asked.seed}")
    header = [
        "goal",
        "gap [m]",
        "docked",
        "touched",
        "least clearance [m]",
        "to dock p50 [s]",
        "with fallback",
    ]
    found = docked(bay, asked.draws, asked.seed, "in a bay")
    found += docked(before_a_wall, asked.draws, asked.seed, "before a wall")
    blocks = {"narrow": table(header, found)}
    header = ["cycles [ms]", "docked", "p50", "p99", "p99 of the worst", "first, p50", "first, max"]
    header += ["p99 / docking_inside's p50", "worst / docking_inside's p50"]
    blocks["hardest"] = table(header, hardest(asked.draws, asked.seed))
    header = ["level", "cases", "cases a second of CPU"]
    blocks["throughput"] = table(header, throughput(4 * asked.draws, asked.seed))
    said = {name: told(source) if name == "throughput" else named(source) for name in blocks}
    publish("performance.md", {name: f"{blocks[name]}\n\n{said[name]}" for name in blocks}, docs=asked.docs)


if __name__ == "__main__":
    main()
