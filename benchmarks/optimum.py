"""Distance of a docking from the optimum: whole dockings offline, by IPOPT, against the closed loop.

    OMP_NUM_THREADS=1 python -m benchmarks.optimum [--seed 5150] [--count 50] [--jobs 2]

Of the built-in scenarios and of drawn courses with one direction of motion. The program has the bicycle
model over N equal intervals of a free time T, with RK4, the limits and comfort as hard bounds, and the
outline of the body, a point every 0.1 m, kept by `CLEARANCE` from all of the corridor. It is
asked three things:

least time:    min T with no more of each of the three energies than the smooth closed loop took
least energy:  min of the integral of a² in the time that the smooth closed loop took
least ride:    min T that comfort and the comfort jerk alone allow, beside a brisk closed loop

IPOPT finds local optima: it begins at the motions of both closed loops, and the better end counts. Rows are
made for points that are near something at the start, and for those that are found to be after a solution,
until none is. What is checked at the end is the exact body at every interval. The time of a closed loop is
that to the dock less the dead time, in which nothing can move.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil
from statistics import median
from typing import Any, Literal

import casadi as ca
import numpy as np

from benchmarks.problems.courses import drawn_course
from benchmarks.tables import ROOT, command_line, origin, replace_block, table, told, write_json
from geometry import Corridor, Pose2
from geometry.free_space import clearances_in
from geometry.shape_grid import POINT
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_polygons, clearances
from rti_mpcc.simulation import RunResult, Scenario, changed, load_scenario, simulate, summary
from rti_mpcc.simulation.batch import in_processes
from rti_mpcc.types import Array

Question = Literal["time", "energy", "ride"]
BUILT_IN = ("docking_inside", "docking_behind")
STAGES = 80
CLEARANCE = 0.05  # [m], the hard minimum of plans
GRID = 0.1  # [m] between the distances that a spline goes through
OUTLINE = 0.1  # [m] between points of the outline: a corner between two of them stays outside
NEAR = 0.35  # [m]: a point nearer to something gets a row
BEYOND = 6.0  # [m] that the grid reaches beyond the motion
ROUNDS = 6  # of adding rows
TOUCH = 0.03  # [m] that the exact body may miss CLEARANCE by: the spline rounds corners off
ENERGIES = ("acceleration", "steering_rate", "lateral_acceleration")
IPOPT: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "max_iter": 400,
    "tol": 1e-6,
    "mu_strategy": "adaptive",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """T [s]; states (N+1, 5) x, y, phi, v, delta; controls (N, 2) a, delta_dot."""

    time: float
    states: Array
    controls: Array

    @classmethod
    def driven(cls, result: RunResult, until: float) -> Motion:
        """What a closed loop drove after its dead time, on N equal intervals."""
        truth, begin = result.truth, result.scenario.simulation.dead_time
        times = np.linspace(begin, until, STAGES + 1)
        columns = (*truth.poses.T, truth.v, truth.delta)
        states = np.column_stack([np.interp(times, truth.times, column) for column in columns])
        controls = np.diff(states[:, 3:], axis=0) / (times[1] - times[0])
        return cls(time=until - begin, states=states, controls=controls)


@dataclass(frozen=True, slots=True, kw_only=True)
class Docking:
    """What is asked of one scenario.

    Attributes:
        config: limits and comfort; start, goal: poses; direction: of the motion.
        corridor: where the body may be; distance: casadi's, of a point to its walls and obstacles, around the
            motion.
    """

    config: ControllerConfig
    start: Pose2
    goal: Pose2
    direction: int
    corridor: Corridor
    distance: Any

    @classmethod
    def of(cls, scenario: Scenario, motion: Motion) -> Docking:
        """What a scenario with one direction of motion asks, around a motion that does it."""
        path, config = scenario.build_path(), scenario.controller_config()
        corridor = scenario.build_corridor(path)
        low, high = motion.states[:, :2].min(axis=0) - BEYOND, motion.states[:, :2].max(axis=0) + BEYOND
        axes = [np.arange(a, b + GRID, GRID) for a, b in zip(low, high, strict=True)]
        x, y = np.meshgrid(*axes, indexing="ij")
        points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
        apart = clearances_in(corridor.spaces[0], POINT, points, BEYOND).min(axis=1, initial=BEYOND)
        # casadi counts the first axis fastest
        values = np.clip(apart, -BEYOND, BEYOND).reshape(x.shape).ravel(order="F")
        return cls(
            config=config,
            start=path.start,
            goal=_lifted(scenario.goal_pose(), float(motion.states[-1, 2])),
            direction=path.parts[0].direction,
            corridor=corridor,
            distance=ca.interpolant("apart", "bspline", axes, values),
        )

    @property
    def outline(self) -> Array:
        """(m, 2) points all round the body, in its own frame."""
        (corners,) = body_polygons(np.zeros((1, 3)), self.config.vehicle)
        ends = np.roll(corners, -1, axis=0)
        points = []
        for corner, end in zip(corners, ends, strict=True):
            count = ceil(float(np.hypot(*(end - corner))) / OUTLINE)
            points += [corner + (end - corner) * k / count for k in range(count)]
        return np.array(points)

    def clearance(self, motion: Motion) -> float:
        """Exact, of the body at all stages [m]."""
        return float(clearances(motion.states, self.corridor, 0, self.config.vehicle, 1.0).min(initial=1.0))

    def solved(self, question: Question, begin: Motion, most: dict[str, float]) -> Motion | None:
        """The best motion near one, or None; `most`: energies that it may take."""
        rows, found = self._near(begin), begin
        for _ in range(ROUNDS):
            another = self._program(question, begin, most, rows)
            if another is None:
                return None
            found = another
            missing = self._near(found) & ~rows
            if not missing.any():
                break
            rows |= missing
        return found if self.clearance(found) >= CLEARANCE - TOUCH else None

    def _near(self, motion: Motion) -> Any:
        """(N+1, m) whether a point of the outline is near something."""
        x, y = _placed(motion.states[:, :3], self.outline)
        apart = np.array(self.distance(np.vstack([x.ravel(), y.ravel()]))).reshape(x.shape)
        return apart < NEAR

    def _program(self, question: Question, begin: Motion, most: dict[str, float], rows: Any) -> Motion | None:
        config, sides = self.config, ca.Opti()
        comfort, limits, length = config.comfort, config.limits, config.vehicle.wheelbase
        z, u = sides.variable(5, STAGES + 1), sides.variable(2, STAGES)
        time = sides.variable() if question != "energy" else ca.MX(begin.time)
        h = time / STAGES
        sides.subject_to(z[:, 1:] == _step(length).map(STAGES)(z[:, :-1], u, ca.repmat(h, 1, STAGES)))
        start, goal = self.start, self.goal
        sides.subject_to(z[:, 0] == ca.vertcat(start.x, start.y, start.phi, 0.0, 0.0))
        sides.subject_to(z[:4, -1] == ca.vertcat(goal.x, goal.y, goal.phi, 0.0))
        lateral = z[3, :] ** 2 * ca.tan(z[4, :]) / length
        sides.subject_to(sides.bounded(-comfort.acceleration, u[0, :], comfort.acceleration))
        sides.subject_to(sides.bounded(-comfort.steering_rate, u[1, :], comfort.steering_rate))
        sides.subject_to(sides.bounded(-comfort.lateral_acceleration, lateral, comfort.lateral_acceleration))
        sides.subject_to(sides.bounded(-limits.steering, z[4, :], limits.steering))
        sides.subject_to(sides.bounded(0.0, self.direction * z[3, :], limits.speed))
        taken = (h * ca.sumsqr(u[0, :]), h * ca.sumsqr(u[1, :]), h * ca.sumsqr(lateral))
        if question == "time":
            for name, value in zip(ENERGIES, taken, strict=True):
                sides.subject_to(value <= most[name])
        if question == "ride":
            change = ca.diff(ca.horzcat(0.0, u[0, :], 0.0), 1, 1)
            sides.subject_to(sides.bounded(-comfort.jerk * h, change, comfort.jerk * h))
        if question != "energy":
            sides.subject_to(time >= 1.0)
            sides.set_initial(time, begin.time)
        for k, points in enumerate(rows):
            if points.any():
                x, y = _placed_at(z[:3, k], self.outline[points])
                sides.subject_to(self.distance(ca.horzcat(x, y).T) >= CLEARANCE)
        sides.minimize(taken[0] if question == "energy" else time)
        sides.set_initial(z, begin.states.T)
        sides.set_initial(u, begin.controls.T)
        sides.solver("ipopt", {"print_time": False}, IPOPT)
        try:
            answer = sides.solve()
        except RuntimeError:
            return None
        states, controls = (np.array(answer.value(each)).T for each in (z, u))
        return Motion(time=float(answer.value(time)), states=states, controls=controls)


def _lifted(goal: Pose2, near: float) -> Pose2:
    turns = round((near - goal.phi) / (2.0 * np.pi))
    return Pose2(goal.x, goal.y, goal.phi + 2.0 * np.pi * turns)


def _placed(poses: Array, points: Array) -> tuple[Array, Array]:
    """x and y (n, m) of body points (m, 2) at poses (n, 3)."""
    c, s = np.cos(poses[:, 2:3]), np.sin(poses[:, 2:3])
    return poses[:, :1] + c * points[:, 0] - s * points[:, 1], poses[:, 1:2] + s * points[:, 0] + c * points[
        :, 1
    ]


def _placed_at(pose: Any, points: Array) -> tuple[Any, Any]:
    """The same of one pose of casadi's, (m, 1) each."""
    c, s = ca.cos(pose[2]), ca.sin(pose[2])
    along, across = points[:, 0], points[:, 1]
    return pose[0] + c * along - s * across, pose[1] + s * along + c * across


def _step(wheelbase: float) -> Any:
    """RK4 of the bicycle model over an interval."""
    z, u, h = ca.SX.sym("z", 5), ca.SX.sym("u", 2), ca.SX.sym("h")

    def rate(state: Any) -> Any:
        x, v = state[2], state[3]
        return ca.vertcat(v * ca.cos(x), v * ca.sin(x), v * ca.tan(state[4]) / wheelbase, u[0], u[1])

    first = rate(z)
    second = rate(z + 0.5 * h * first)
    third = rate(z + 0.5 * h * second)
    fourth = rate(z + h * third)
    return ca.Function("step", [z, u, h], [z + h / 6.0 * (first + 2.0 * second + 2.0 * third + fourth)])


def measured(scenario: Scenario) -> dict[str, Any]:
    """What the closed loops took, and what is the least; None where a program had no solution."""
    rides: dict[str, Any] = {}
    motions = {}
    for ride in ("smooth", "brisk"):
        result = simulate(changed(scenario, {"controller.ride": ride}))
        figures = summary(result)
        if not figures["docked"] or figures["direction_changes"] > 0:
            return {"scenario": scenario.name, "why": f"the {ride} closed loop did not dock in one go"}
        motions[ride] = Motion.driven(result, figures["time_to_dock_s"])
        rides[ride] = {
            "time": motions[ride].time,
            "energy": figures["energy_to_dock"],
            "over_comfort": max(figures["peak"][name] / value for name, value in figures["comfort"].items()),
        }
    docking = Docking.of(scenario, motions["smooth"])
    most = rides["smooth"]["energy"]
    found: dict[Question, list[Motion]] = {"time": [], "energy": [], "ride": []}
    for question, ends in found.items():
        for motion in motions.values():
            begin = motion
            if question == "energy":
                begin = Motion(time=rides["smooth"]["time"], states=motion.states, controls=motion.controls)
            best = docking.solved(question, begin, most)
            ends += [] if best is None else [best]
    energy = [motion.time / STAGES * float(np.sum(motion.controls[:, 0] ** 2)) for motion in found["energy"]]
    return {
        "scenario": scenario.name,
        "rides": rides,
        "least_time": min((motion.time for motion in found["time"]), default=None),
        "least_energy": min(energy, default=None),
        "least_ride": min((motion.time for motion in found["ride"]), default=None),
    }


def ratios(run: dict[str, Any]) -> dict[str, float | None]:
    """Of the closed loops over the least: smooth time, smooth energy, brisk time."""
    if "why" in run:
        return dict.fromkeys(("smooth", "energy", "brisk"))
    took = {
        "smooth": (run["rides"]["smooth"]["time"], run["least_time"]),
        "energy": (run["rides"]["smooth"]["energy"]["acceleration"], run["least_energy"]),
        "brisk": (run["rides"]["brisk"]["time"], run["least_ride"]),
    }
    return {name: None if least is None else one / least for name, (one, least) in took.items()}


def in_short(runs: Iterable[dict[str, Any]]) -> str:
    """Median and 95th percentile of the ratios, with the number of runs."""
    known = [ratios(run) for run in runs]
    parts = []
    for name, words in (
        ("smooth", "Time of a smooth ride over the least with no more of each energy"),
        ("energy", "Its acceleration energy over the least in its time"),
        ("brisk", "Time of a brisk ride over the least within comfort and jerk"),
    ):
        values = [value for one in known if (value := one[name]) is not None]
        if values:
            figures = f"median {median(values):.3f}, p95 {np.percentile(values, 95):.3f}"
            parts.append(f"- {words}: {figures} ({len(values)} of {len(known)}).")
    return "\n".join(parts)


def _cells(run: dict[str, Any]) -> list[str]:
    if "why" in run:
        return [run["scenario"], run["why"], *[""] * 6]
    smooth, brisk, over = run["rides"]["smooth"], run["rides"]["brisk"], ratios(run)
    values: list[float | None] = [smooth["time"], run["least_time"], over["smooth"], over["energy"]]
    values += [brisk["time"], run["least_ride"], over["brisk"]]
    return [run["scenario"], *("–" if value is None else f"{value:.2f}" for value in values)]


SHOWN = 1.1
"""Brisk rides that take more than this times the least have a row in docs/optimum.md."""
HEADER = ["scenario", "smooth [s]", "least [s]", "ratio", "energy ratio", "brisk [s]", "least [s]", "ratio"]


def page_text(runs: Sequence[dict[str, Any]], source: str) -> str:
    """The ratios of all runs; rows of the built-in scenarios and of brisk rides above `SHOWN`."""
    shown = [run for run in runs if run["scenario"] in BUILT_IN or (ratios(run)["brisk"] or 0.0) > SHOWN]
    return "\n\n".join(
        [
            in_short(runs),
            f"The built-in scenarios, and courses with a brisk ratio above {SHOWN:g}; all are in "
            "[optimum.json](optimum.json).",
            table(HEADER, [_cells(run) for run in shown]),
            source,
        ]
    )


def main() -> None:
    parser = command_line(__doc__, "python -m benchmarks.optimum")
    parser.add_argument("--seed", type=int, default=5150)
    parser.add_argument("--count", type=int, default=50)
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    source = origin(f"python -m benchmarks.optimum --seed {asked.seed} --count {asked.count}")
    scenarios = [load_scenario(name) for name in BUILT_IN]
    scenarios += [drawn_course(asked.seed, index) for index in range(asked.count)]
    runs: list[dict[str, Any] | None] = []
    for run in in_processes(partial(measured), scenarios, asked.jobs):
        runs.append(run)
        print(*_cells(run), sep=" | ", flush=True)
    done = [run for run in runs if run is not None]
    write_json(ROOT / "docs" / "optimum.json", {"origin": source, "runs": done})
    replace_block(ROOT / "docs" / "optimum.md", "optimum", page_text(done, told(source)))


if __name__ == "__main__":
    main()
