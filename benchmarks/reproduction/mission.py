"""The docking mission: up to a capsule, detected on the way back, lowered, connected, and out again."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import degrees
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.reproduction.content import Block, Picture, Section, Table, found, say
from benchmarks.reproduction.verdicts import came_out
from rti_mpcc.report import draw
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.ride import ride_of_run
from rti_mpcc.report.text import number
from rti_mpcc.report.timeline import draw_bands, name_bands
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.batch import DrivenCase
from rti_mpcc.simulation.plant import SAME_TIME
from rti_mpcc.simulation.result import STANDSTILL_SPEED
from rti_mpcc.simulation.ride import samples_at_rest, spells, turning_points
from rti_mpcc.types import MissionResult

T_GOAL, LOWERING = 50.0, 10.0
"""When the vehicle of the paper is at its goal, and how long it lowers its chassis, both about [s]."""
SLOW, HARDLY = 0.2, 0.05
"""While it connects: what this project takes for slow, and for hardly any steering, at most [m/s], [rad]."""
ACROSS, TURNED = 0.02, 0.5
"""Errors at the contact that this project asks for, at most [m], [deg]."""
_ROUNDING = 1.02
"""So many times those speeds and angles are still taken for them: a plant follows its commands late."""
_SIZE = (9.0, 5.2)
"""Of the picture over time [inch]."""
_PAD = 6.0
"""Between its title and what is below it [points]."""
_SAYS = (
    "The paper's last experiment is a mission in the CARLA simulator: the vehicle drives forward on a route "
    "to the expected place of a capsule, stops at the change of direction, where its rear cameras begin to "
    "detect a ChArUco board on the capsule, reverses without a further stop to the pose before the detected "
    "capsule (T_goal about 50 s), lowers its chassis for about 10 s, and reverses slowly and straight, with "
    "hardly any steering left, until it is connected. Here it is the scenario `docking_mission`, on a map "
    "with two capsules: the way is planned, the expected place is 0.64 m and 5.7° off, and the pictures of "
    "the board are drawn and looked at by the real detector. The yard is not the paper's, so times are not "
    "compared, only what happens. The way out of the dock at the end is this project's own."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """What is measured of the drive, None where it never came to it.

    Attributes:
        changes: of direction up to T_goal.
        stood: at the first of them, from and to [s].
        stops: of half a second and more between that and T_goal.
        first_seen: when the board was first detected [s].
        connecting: largest speed [m/s] and steering [rad] while it connects.
    """

    changes: int | None
    stood: tuple[float, float] | None
    stops: int | None
    first_seen: float | None
    connecting: tuple[float, float] | None


def mission_section(outcome: DrivenCase) -> Section:
    """The section of the mission's run: two figures, two tables, and what comes out."""
    result, figures = outcome.result, outcome.figures
    motion = motion_of(result, figures)
    blocks: list[Block] = [
        say(_SAYS),
        Picture(
            name="mission_over_time",
            png=draw.png(motion_figure(result, figures)),
            caption="Speed and steering of the mission, its steps as bands, T_goal (dotted) and the end of "
            "the lowering (dashed).",
            told="Speed and steering over time, with the steps dock, wait, straight and undock.",
        ),
        Picture(
            name="mission_plane",
            png=draw.png(overview_figure(ride_of_run(result))),
            caption="The same from above: the planned goal, the capsule and where each step ended.",
            told="The yard with two capsules and the body of the vehicle each second.",
        ),
        _beside_paper(figures, motion),
        _steps(figures),
        *map(found, verdicts(figures, motion)),
    ]
    measured = {"t_goal_s": figures["time_to_tolerance_s"], "lowering_s": lowering(figures)}
    kept = {"steps": figures["mission"], "peak": figures["peak"], "motion": asdict(motion)}
    return Section(name="mission", title="The docking mission", blocks=blocks, figures={**measured, **kept})


def motion_figure(result: RunResult, figures: Mapping[str, Any]) -> Figure:
    """Speed and steering over time, with the steps of the mission as bands."""
    figure = Figure(figsize=_SIZE, layout="constrained")
    speed, steering = figure.subplots(2, 1, sharex=True)
    truth, limit = result.truth, result.config.limits.steering
    speed.plot(truth.times, truth.v, color=draw.BLUE, linewidth=1.5, label="true")
    speed.set_ylabel("speed v [m/s]")
    steering.plot(truth.times, truth.delta, color=draw.BLUE, linewidth=1.5, label="true")
    for side in (-limit, limit):
        steering.axhline(side, color=draw.GREY, linestyle="dashdot", linewidth=0.8, label="limit")
    steering.set_ylabel("steering δ [rad]")
    for axes in (speed, steering):
        _mark(axes, result, figures)
    speed.set_title("docking mission", pad=_PAD + name_bands(speed, ride_of_run(result)))
    steering.set_xlabel("time [s]")
    steering.set_xlim(0.0, float(truth.times[-1]))
    draw.legend_below(figure, columns=5)
    return figure


def _mark(axes: Axes, result: RunResult, figures: Mapping[str, Any]) -> None:
    draw_bands(axes, ride_of_run(result), waited="end of the lowering")
    draw.grid(axes)
    at_goal = figures["time_to_tolerance_s"]
    if at_goal is not None:
        axes.axvline(at_goal, color=draw.GREEN, linestyle="dotted", linewidth=1.4, label="T_goal")


def motion_of(result: RunResult, figures: Mapping[str, Any]) -> Motion:
    """What is measured of the drive."""
    times, v, at_goal = result.truth.times, result.truth.v, figures["time_to_tolerance_s"]
    until = len(times) if at_goal is None else int(np.searchsorted(times, at_goal))
    turns = turning_points(times[:until], v[:until])
    still = list(spells(np.abs(v) <= STANDSTILL_SPEED))
    turn = next(((a, b) for a, b in still if turns and a <= turns[0] <= b), None)
    stops = None
    if turn is not None and at_goal is not None:
        after = slice(turn[1] + 1, until)
        stops = len(list(spells(samples_at_rest(times[after], v[after]))))
    return Motion(
        changes=None if at_goal is None else len(turns),
        stood=None if turn is None else (float(times[turn[0]]), float(times[turn[1]])),
        stops=stops,
        first_seen=(figures["goal"] or {}).get("first_seen_s"),
        connecting=_connecting(result),
    )


def _connecting(result: RunResult) -> tuple[float, float] | None:
    """Largest speed and steering while the vehicle moves in the last straight step."""
    move = next((each for each in reversed(result.mission) if each.kind == "straight"), None)
    if move is None:
        return None
    truth = result.truth
    end = truth.times[-1] if move.end is None else move.end
    rows = (truth.times >= move.begin) & (truth.times <= end) & (np.abs(truth.v) > STANDSTILL_SPEED)
    if not rows.any():
        return None
    return float(np.abs(truth.v[rows]).max()), float(np.abs(truth.delta[rows]).max())


def lowering(figures: Mapping[str, Any]) -> float | None:
    """How long the vehicle stood at the dock to lower its chassis [s]: its shortest wait."""
    waits = [step for step in figures["mission"] if step["kind"] == "wait" and step["end_s"] is not None]
    return min((step["end_s"] - step["begin_s"] for step in waits), default=None)


def _beside_paper(figures: Mapping[str, Any], motion: Motion) -> Table:
    speed, steering = motion.connecting or (None, None)
    rows = [
        ["T_goal [s]", f"about {T_GOAL:.0f}", number(figures["time_to_tolerance_s"], 1)],
        ["lowering [s]", f"about {LOWERING:.0f}", number(lowering(figures), 1)],
        ["changes of direction up to T_goal", "1", number(motion.changes, 0)],
        ["largest speed while it connects [m/s]", "slow", number(speed, 2)],
        ["largest steering while it connects [rad]", "hardly any", number(steering, 3)],
    ]
    caption = "The mission in the paper's yard and in this one. What it says in words is in words here."
    return Table(caption=caption, heads=["", "paper", "here"], rows=rows)


def _steps(figures: Mapping[str, Any]) -> Table:
    heads = ["step", "begin [s]", "end [s]", "result", "along [mm]", "across [mm]", "heading [°]"]
    rows = []
    for step in figures["mission"]:
        error = step["final_error"]
        told = ["", "", ""]
        if error is not None:
            along, across = 1e3 * error["longitudinal_m"], 1e3 * error["lateral_m"]
            told = [number(along, 1), number(across, 1), number(degrees(error["heading_rad"]), 2)]
        times = number(step["begin_s"], 1), number(step["end_s"], 1)
        rows.append([step["kind"], *times, step["result"], *told])
    caption = (
        "The steps of the mission and the true errors at their ends: of `dock` to the pose before the "
        "capsule, of `straight` to the end of the move, before which the contact stops it."
    )
    return Table(caption=caption, heads=heads, rows=rows, worded=[3])


def verdicts(figures: Mapping[str, Any], motion: Motion) -> list[str]:
    """What of the paper's experiment comes out, a sentence an outcome."""
    at_goal, lowered = figures["time_to_tolerance_s"], lowering(figures)
    stood, seen = motion.stood, motion.first_seen
    reached = number(at_goal, 1)
    began = "–" if stood is None else f"stands there from {stood[0]:.1f} to {stood[1]:.1f} s"
    return [
        came_out(
            "The vehicle gets to the pose before the capsule",
            at_goal is not None,
            f"{reached} s here, about {T_GOAL:.0f} s in the paper's yard",
        ),
        came_out(
            "It stops at the change of direction, and detects the board from there on",
            None if stood is None else seen is not None and stood[0] <= seen <= stood[1],
            f"{began}, first detection at {number(seen, 1)} s",
        ),
        came_out(
            "It changes direction once, and reverses to that pose without a further stop",
            None if motion.stops is None else motion.changes == 1 and motion.stops == 0,
            f"changes of direction {number(motion.changes, 0)}, further stops {number(motion.stops, 0)}",
        ),
        came_out(
            "It stands while it lowers its chassis",
            lowered is not None and lowered >= LOWERING - SAME_TIME,
            f"{number(lowered, 1)} s here, about {LOWERING:.0f} s in the paper",
        ),
        *_connected(figures["mission"], motion),
    ]


def _connected(steps: Sequence[Mapping[str, Any]], motion: Motion) -> list[str]:
    contact = next((step for step in reversed(steps) if step["kind"] == "straight"), None)
    error = None if contact is None else contact["final_error"]
    if contact is None or error is None or motion.connecting is None:
        return [came_out("It connects", False)]
    speed, steering = motion.connecting
    across, turned = abs(error["lateral_m"]), degrees(abs(error["heading_rad"]))
    succeeded = contact["result"] == MissionResult.SUCCEEDED.value
    return [
        came_out(
            "It connects slowly and with hardly any steering",
            speed <= _ROUNDING * SLOW and steering <= _ROUNDING * HARDLY,
            f"at most {number(speed, 2)} m/s and {number(steering, 3)} rad, "
            f"asked for are {SLOW:g} m/s and {HARDLY:g} rad",
        ),
        came_out(
            "It connects",
            succeeded and across <= ACROSS and turned <= TURNED,
            f"{1e3 * across:.1f} mm and {turned:.2f}° off its axis, "
            f"asked for are {1e3 * ACROSS:.0f} mm and {TURNED}°",
        ),
    ]
