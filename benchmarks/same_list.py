"""The runs that `benchmarks.same` compares, and the generator of their random problems.

    python -P same_list.py DIR JOBS < NAMES

Run as a file with a tree on PYTHONPATH, it writes DIR/NAME.toml for each name on standard input that is a
random problem. Both sides of a comparison drive these files, whichever of the two generated them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

SEED = 41
LEVELS = ("nominal", "noisy", "mismatched", "hard")
PER_LEVEL, SCENES, MISSIONS, UNDOCKINGS = 60, 40, 3, 6
BUILT_IN = (
    "aisle_dock",
    "bay_perpendicular",
    "docking_behind",
    "docking_blackout",
    "docking_full_course",
    "docking_inside",
    "docking_mission",
    "docking_moving_goal",
    "docking_noisy",
    "long_approach",
    "obstacle_appears",
    "path_following",
    "slot_parallel",
    "yard_dead_end",
)
PAPER = ("docking_inside", "docking_behind")
FAULTS = (
    {"kind": "frozen_state", "from": 2.0, "to": 2.2},
    {"kind": "state_jump", "from": 4.0, "to": 4.1, "size": 0.4},
    {"kind": "nan_state", "from": 6.0, "to": 6.3},
    {"kind": "lost_cycles", "from": 8.0, "to": 8.4},
    {"kind": "late_cycles", "from": 10.0, "to": 11.0, "size": 0.07},
    {"kind": "blocked", "from": 14.0, "to": 22.0, "size": 6.0},
    {"kind": "goal_jump", "from": 30.0, "to": 33.0, "size": 0.3},
    {"kind": "clock_back", "from": 36.0, "to": 36.2, "size": 1.0},
    {"kind": "weak_brakes", "from": 38.0, "to": 41.0, "size": 0.6},
)
SOLVER_FAULTS = (
    {"kind": "solver_fail", "from": 5.0, "to": 6.0},
    {"kind": "solver_timeout", "from": 12.0, "to": 13.5},
    {"kind": "stuck_steering", "from": 20.0, "to": 21.0},
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Mover:
    """A box that moves, given to the controller in every cycle of its time.

    Attributes:
        at: its centre at the time `since` (2,) [m]; size: (2,) [m]; velocity: (2,) [m/s].
        since, until: when it is there [s].
    """

    at: tuple[float, float]
    size: tuple[float, float] = (0.6, 0.6)
    velocity: tuple[float, float] = (0.0, 0.0)
    since: float = 0.0
    until: float = 1e9


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run that is compared.

    Attributes:
        scenario: name of a built-in scenario; "" for a random problem, whose file has the name of the run.
        changes: values of the scenario file that differ, by their dotted keys.
        scripted: the controller's clock follows a script, so that no decision depends on the wall clock.
        movers: are given as obstacles.
    """

    name: str
    scenario: str = ""
    preset: str = "default"
    method: str = "dynamic"
    seed: int = 0
    changes: Mapping[str, Any] = field(default_factory=dict)
    scripted: bool = False
    movers: tuple[Mover, ...] = ()


def built_in_runs() -> list[Run]:
    """Each built-in scenario as it is, then with the other presets and methods."""
    found = [Run(name=name, scenario=name) for name in BUILT_IN]
    for name in PAPER:
        for preset in ("paper", "paper_printed"):
            found.append(Run(name=f"{name}-{preset}", scenario=name, preset=preset))
        for method in ("separated", "switched"):
            found.append(Run(name=f"{name}-{method}", scenario=name, method=method))
            found.append(Run(name=f"{name}-{method}-paper", scenario=name, method=method, preset="paper"))
    return found


def changed_runs() -> list[Run]:
    """Noise, faults and settings on top of built-in scenarios; a deadline by a scripted clock."""
    noise = {"simulation.state_noise": [0.01, 0.01, 0.003, 0.02, 0.002]}
    deadline = {"controller.deadline": 0.02}
    course = "docking_full_course"
    return [
        Run(name="noisy-state", scenario=course, seed=7, changes=noise),
        Run(name="noisy-area", scenario="bay_perpendicular", seed=7, changes=noise),
        Run(name="faults", scenario=course, changes={"faults": list(FAULTS)}),
        Run(
            name="faults-deadline",
            scenario=course,
            scripted=True,
            changes={"faults": list(FAULTS), **deadline},
        ),
        Run(name="faults-solver", scenario=course, changes={"faults": list(SOLVER_FAULTS)}),
        Run(name="deadline-detections", scenario="docking_noisy", seed=3, scripted=True, changes=deadline),
        Run(name="deadline-area", scenario="yard_dead_end", scripted=True, changes=deadline),
        Run(name="deadline-mission", scenario="docking_mission", scripted=True, changes=deadline),
        Run(name="setting-brisk", scenario="docking_behind", changes={"controller.ride": "brisk"}),
        Run(name="setting-time", scenario="docking_behind", changes={"controller.docking_time": 60.0}),
        Run(name="setting-no_recovery", scenario="docking_inside", changes={"controller.recovery": False}),
    ]


def moving_runs() -> list[Run]:
    """Obstacles that appear, cross the route, come towards the vehicle and leave again."""
    course = "docking_full_course"
    crossing = Mover(at=(-6.0, 12.0), velocity=(1.2, 0.0), since=6.0, until=18.0)
    oncoming = Mover(at=(-2.0, 28.0), size=(1.0, 2.0), velocity=(0.0, -0.8), since=4.0, until=30.0)
    wall = Mover(at=(-2.0, 12.0), size=(8.5, 1.0), since=4.0, until=25.0)
    return [
        Run(name="moving-crossing", scenario=course, movers=(crossing,)),
        Run(name="moving-oncoming", scenario=course, movers=(oncoming,)),
        Run(name="moving-appears", scenario=course, movers=(wall,)),
        Run(name="moving-many", scenario=course, seed=5, movers=(crossing, oncoming, wall)),
    ]


def random_runs() -> list[Run]:
    """Random problems: courses of four levels, scenes in an area, missions with their mission."""
    courses = [f"course-{level}-{index:02d}" for level in LEVELS for index in range(PER_LEVEL)]
    scenes = [f"scene-{'nominal' if i % 2 else 'hard'}-{i:02d}" for i in range(SCENES)]
    missions = [f"mission-random-{i:02d}" for i in range(MISSIONS)]
    undockings = [f"undocking-random-{i:02d}" for i in range(UNDOCKINGS)]
    names = (*missions, *courses, *scenes, *undockings)
    return [Run(name=name, seed=1_000_000 * SEED + int(name.rpartition("-")[2])) for name in names]


RUNS: dict[str, Run] = {
    run.name: run for run in (*built_in_runs(), *changed_runs(), *moving_runs(), *random_runs())
}


def generators() -> dict[str, Callable[[str, int], Any]]:
    """Kind of a random problem -> its generator (level, index) -> Scenario, of the tree on PYTHONPATH.

    The only place that knows where a tree has them.
    """
    try:
        modules = [import_module(f"benchmarks.problems.{name}") for name in ("case", "levels", "missions")]
    except ModuleNotFoundError:  # a tree of before these were studies
        campaign = import_module("rti_mpcc.simulation.campaign")
        modules = [campaign, campaign, import_module("rti_mpcc.simulation.missions")]
    case, levels, missions = modules

    def scenario(problems: str, level: str, index: int) -> Any:
        kind = case.Problems(problems)
        chosen = case.CampaignCase(seed=SEED, level=levels.Level(level), index=index, problems=kind)
        return chosen.scenario()

    return {
        "course": partial(scenario, "courses"),
        "scene": partial(scenario, "scenes"),
        "mission": lambda _, index: missions.drawn_mission(SEED, index).scenario,
        "undocking": lambda _, index: missions.drawn_undocking(SEED, index),
    }


def generate(name: str, folder: Path) -> None:
    """Write the scenario file of a random problem."""
    from rti_mpcc.simulation import scenario_text

    kind, level, index = name.split("-")
    text = scenario_text(generators()[kind](level, int(index)))
    part = folder / f"{name}.part"
    part.write_text(text, encoding="utf-8")
    part.rename(folder / f"{name}.toml")


def main() -> None:
    folder, jobs = Path(sys.argv[1]), int(sys.argv[2])
    Parallel(n_jobs=jobs)(delayed(generate)(name, folder) for name in sys.stdin.read().split())


if __name__ == "__main__":
    main()
