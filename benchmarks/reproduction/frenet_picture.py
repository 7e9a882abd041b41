"""The Frenet picture: stages of a plan paired to their references, for a large and a small lag weight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from benchmarks.reproduction.content import Block, Picture, Section, Table, found, say
from geometry import PathPart
from rti_mpcc.model.layout import PHI, THETA, X, Y
from rti_mpcc.ocp.frenet import CONTOURING, LAG, frenet_errors
from rti_mpcc.report import draw
from rti_mpcc.simulation import load_scenario
from rti_mpcc.simulation.closed_loop import controller_of
from rti_mpcc.types import Array, VehicleState

SCENARIO = "docking_inside"
LAGS = (1e3, 10.0)
"""Lag weights q_l of the two plans: Table I's, and one that is too small."""
_BESIDE, _TURNED, _SPEED = 1.5, 0.25, -1.0
"""Where the vehicle starts: beside the path [m], turned [rad], and how fast [m/s]."""
_EVERY = 5
_SAID = (
    "Eq. 4 takes the errors of each stage at the stage's own progress θ_k: e_l along the path, e_c across "
    "it. They are Frenet coordinates only while the lag weight q_l is much larger than the contouring "
    "weight q_c, so that e_l stays near 0 and θ_k near the projection. Both plans begin in the same state "
    "on Scenario 1, {beside:g} m beside its path, turned by {turned:g} rad, at {speed:g} m/s in reverse; "
    "the only difference is q_l, of all stages and of the last one."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Paired:
    """A plan and its references.

    Attributes:
        lag_weight: q_l.
        states: (N+1, 6) of the plan.
        feet: (N+1, 3) x [m], y [m], phi [rad] of the path at each stage's progress.
        lag, contouring: (N+1,) errors [m].
        part: of the path.
    """

    lag_weight: float
    states: Array
    feet: Array
    lag: Array
    contouring: Array
    part: PathPart


def paired(lag_weight: float) -> Paired:
    """The plan of the first cycle of a vehicle beside the path, with this lag weight."""
    scenario = load_scenario(SCENARIO)
    config = scenario.controller_config("paper")
    changes = {"weights": {"lag": lag_weight}, "objective": {"terminal_lag": lag_weight}}
    controller = controller_of(scenario, config.changed(**changes, dead_time=0.0))
    start = controller.state.path.start
    state = VehicleState(
        x=start.x - _BESIDE * np.sin(start.phi),
        y=start.y + _BESIDE * np.cos(start.phi),
        phi=start.phi + _TURNED,
        v=_SPEED,
        delta=0.0,
    )
    states = controller.step(state, now=0.0, goal=scenario.goal_pose()).trajectory.states
    part = controller.state.path.parts[0]
    reference = part.reference(states[:, THETA])
    errors = frenet_errors(states, reference, part.direction)
    return Paired(
        lag_weight=lag_weight,
        states=states,
        feet=np.stack([reference.x, reference.y, reference.phi], axis=-1),
        lag=errors.values[:, LAG],
        contouring=errors.values[:, CONTOURING],
        part=part,
    )


def frenet_figure(plans: list[Paired]) -> Figure:
    """A panel a plan, on the same part of the plane."""
    shown = np.concatenate([np.concatenate((plan.states[:, X : Y + 1], plan.feet[:, :2])) for plan in plans])
    width, height = np.ptp(shown, axis=0)
    # Panels as high as the plane on them, and room for titles, labels and the legend.
    figure = Figure(figsize=(5.1 * len(plans), 4.4 * height / width + 1.6), layout="constrained")
    axes = np.atleast_1d(figure.subplots(1, len(plans), sharex=True, sharey=True))
    for one, plan in zip(axes, plans, strict=True):
        _draw(one, plan)
        one.label_outer()
    draw.legend_below(figure, columns=5)
    return figure


def _draw(axes: Axes, plan: Paired) -> None:
    path = plan.part.reference(np.linspace(plan.part.start, plan.states[-1, THETA] + 1.0, 300))
    axes.plot(path.x, path.y, color=draw.ORANGE, linewidth=1.5, label="path")
    shown = slice(0, None, _EVERY)
    for state, foot in zip(plan.states[shown], plan.feet[shown], strict=True):
        axes.plot([state[X], foot[0]], [state[Y], foot[1]], color=draw.GREY, linewidth=0.8)
    axes.plot(plan.states[:, X], plan.states[:, Y], color=draw.BLUE, linewidth=1.0)
    axes.plot(
        *plan.states[shown, X : Y + 1].T, "o", color=draw.BLUE, markersize=4.0, label="stages of the plan"
    )
    axes.plot(*plan.feet[shown, :2].T, "s", color=draw.ORANGE, markersize=4.0, label="their references")
    stage = marked_stage(plan)
    _mark_errors(axes, plan, stage)
    errors = f"$e_l$ = {plan.lag[stage]:.2f} m, $e_c$ = {plan.contouring[stage]:.2f} m"
    axes.set_title(f"$q_l$ = {plan.lag_weight:g}; marked stage: {errors}", fontsize="medium")
    draw.plane(axes)


def marked_stage(plan: Paired) -> int:
    """The drawn stage with the largest lag error."""
    return int(np.argmax(np.abs(plan.lag[::_EVERY]))) * _EVERY


def _mark_errors(axes: Axes, plan: Paired, stage: int) -> None:
    """From the reference along the path by e_l, from there across it by e_c, to the stage."""
    foot = plan.feet[stage]
    along = foot[:2] + plan.lag[stage] * np.array([np.cos(foot[PHI]), np.sin(foot[PHI])])
    for ends, color, dashes, name in (
        ((foot[:2], along), draw.RED, "solid", "$e_l$"),
        ((along, plan.states[stage, X : Y + 1]), draw.GREEN, (0.0, (3.0, 1.0)), "$e_c$"),
    ):
        x, y = np.stack(ends, axis=-1)
        label = f"{name} of one stage"
        axes.plot(x, y, color=color, linestyle=dashes, linewidth=2.6, label=label, zorder=3.0)


def frenet_section() -> Section:
    """The picture, and the largest errors of both plans."""
    plans = [paired(lag) for lag in LAGS]
    largest = [(float(np.abs(plan.lag).max()), float(np.abs(plan.contouring).max())) for plan in plans]
    table = Table(
        caption="Largest errors of the two plans, of all stages.",
        heads=["plan", "largest |e_l| [m]", "largest |e_c| [m]"],
        rows=[
            [f"q_l = {weight:g}", f"{lag:.3f}", f"{contouring:.3f}"]
            for weight, (lag, contouring) in zip(LAGS, largest, strict=True)
        ],
    )
    verdict = (
        f"With q_l = {LAGS[0]:g} the lag errors are at most {largest[0][0]:.3f} m; with q_l = {LAGS[1]:g} "
        f"they come to {largest[1][0]:.2f} m: progress is rewarded, and little ties it to the vehicle."
    )
    picture = Picture(
        name="frenet",
        png=draw.png(frenet_figure(plans)),
        caption=f"Every {_EVERY}th stage of a plan, paired to its reference by a grey line. "
        "Marked is the drawn stage with the largest lag error.",
        told="Stages of two plans beside a curved path, each with a line to its reference point.",
    )
    figures = {
        f"lag_weight_{weight:g}": {"largest_lag_m": lag, "largest_contouring_m": contouring}
        for weight, (lag, contouring) in zip(LAGS, largest, strict=True)
    }
    blocks: list[Block] = [
        say(_SAID.format(beside=_BESIDE, turned=_TURNED, speed=abs(_SPEED))),
        picture,
        table,
        found(verdict),
    ]
    return Section(name="frenet", title="Frenet errors", blocks=blocks, figures=figures)
