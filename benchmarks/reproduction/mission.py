"""The docking mission: up to a capsule, detected on the way back, lowered, connected, and out again."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.reproduction.content import Block, Picture, Section, Table, found, say
from benchmarks.reproduction.verdicts import came_out
from rti_mpcc.report import style
from rti_mpcc.report.axes import grid, legend_below, png
from rti_mpcc.report.mission_bands import draw_bands
from rti_mpcc.report.numbers import number
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.batch import Outcome
from rti_mpcc.types import MissionResult

T_GOAL, LOWERING = 50.0, 10.0
"""When the vehicle of the paper is at its goal, and how long it lowers its chassis, both about [s]."""
ACROSS, TURNED = 0.02, 0.5
"""Errors at the contact that this project asks for, at most [m], [deg]."""
_SIZE = (9.0, 5.2)
"""Of the picture over time [inch]."""
_ABOVE = 18.0  # [points] between the names of the steps and the title
_SAYS = (
    "The paper's last experiment is a mission in the CARLA simulator: the vehicle drives forward on a route "
    "to the expected place of a capsule, stops at the change of direction, where its rear cameras begin to "
    "detect a ChArUco board on the capsule, reverses without a further stop to the pose before the detected "
    "capsule (T_goal about 50 s), lowers its chassis for about 10 s, and reverses slowly and straight, with "
    "hardly any steering left, until it is connected. Here it is the scenario `docking_mission`, on a map "
    "with two capsules: the way is planned, the expected place is 0.64 m and 5.7° off, and the pictures of "
    "the board are drawn and looked at by the real detector. The yard is not the paper's, so times are not "
    "compared, only what happens."
)


def mission_section(outcome: Outcome) -> Section:
    """The section of the mission's run, its table and two figures."""
    result, figures = outcome.result, outcome.figures
    blocks: list[Block] = [
        say(_SAYS),
        Picture(
            name="mission_over_time",
            png=png(motion_figure(result, figures)),
            caption="Speed and steering of the mission, its steps as bands, T_goal (dotted) and the end of "
            "the lowering (dashed).",
            told="Speed and steering over time, with the steps dock, wait, straight and undock.",
        ),
        Picture(
            name="mission_plane",
            png=png(overview_figure(result)),
            caption="The same from above: the planned goal, the capsule and where each step ended.",
            told="The yard with two capsules and the body of the vehicle each second.",
        ),
        _table(figures),
        *(found(sentence) for sentence in verdicts(figures)),
    ]
    steps = figures["mission"]
    return Section(
        name="mission", title="The docking mission", blocks=blocks,
        figures={"t_goal_s": figures["time_to_tolerance_s"], "steps": steps, "peak": figures["peak"]},
    )  # fmt: skip


def motion_figure(result: RunResult, figures: Mapping[str, Any]) -> Figure:
    """Speed and steering over time, with the steps of the mission as bands."""
    figure = Figure(figsize=_SIZE, layout="constrained")
    speed, steering = figure.subplots(2, 1, sharex=True)
    truth, limit = result.truth, result.config.limits.steering
    speed.plot(truth.times, truth.v, color=style.BLUE, linewidth=1.5, label="true")
    speed.set_ylabel("v [m/s]")
    steering.plot(truth.times, truth.delta, color=style.BLUE, linewidth=1.5, label="true")
    for side in (-limit, limit):
        steering.axhline(side, color=style.GREY, linestyle="dashdot", linewidth=0.8, label="limit")
    steering.set_ylabel("delta [rad]")
    for place, axes in enumerate((speed, steering)):
        _marked(axes, result, figures, named=place == 0)
    speed.set_title("docking mission", pad=_ABOVE)
    steering.set_xlabel("time [s]")
    steering.set_xlim(0.0, float(truth.times[-1]))
    legend_below(figure)
    return figure


def _marked(axes: Axes, result: RunResult, figures: Mapping[str, Any], *, named: bool) -> None:
    draw_bands(axes, result, named=named)
    grid(axes)
    at_goal = figures["time_to_tolerance_s"]
    if at_goal is not None:
        axes.axvline(at_goal, color=style.GREEN, linestyle="dotted", linewidth=1.4, label="T_goal")


def _table(figures: Mapping[str, Any]) -> Table:
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


def verdicts(figures: Mapping[str, Any]) -> list[str]:
    """What of the paper's experiment comes out, from the summary of the run."""
    steps, at_goal = figures["mission"], figures["time_to_tolerance_s"]
    contact = next((step for step in reversed(steps) if step["kind"] == "straight"), None)
    error = None if contact is None else contact["final_error"]
    waits = [step["end_s"] - step["begin_s"] for step in steps if step["kind"] == "wait" and step["end_s"]]
    connected = contact is not None and contact["result"] == MissionResult.SUCCEEDED.value
    told = "–" if at_goal is None else f"{at_goal:.1f} s here, about {T_GOAL:.0f} s in the paper's yard"
    found_ = [
        came_out("The vehicle gets to the pose before the capsule", at_goal is not None, told),
        came_out(
            "It reverses there with one change of direction",
            figures["direction_changes"] in (1, 2),
            f"{figures['direction_changes']} here, the way out counted",
        ),
        came_out(
            "It stands while it lowers its chassis",
            bool(waits) and min(waits) >= LOWERING,
            f"{min(waits, default=0.0):.1f} s here, about {LOWERING:.0f} s in the paper",
        ),
    ]
    if error is None:
        return [*found_, "It does not connect."]
    across, turned = abs(error["lateral_m"]), degrees(abs(error["heading_rad"]))
    most = f"asked for are {1e3 * ACROSS:.0f} mm and {TURNED}°"
    told = f"{1e3 * across:.1f} mm and {turned:.2f}° off its axis, {most}"
    return [*found_, came_out("It connects", connected and across <= ACROSS and turned <= TURNED, told)]
