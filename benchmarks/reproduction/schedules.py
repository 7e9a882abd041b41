"""The weight schedules over the progress (the paper's schematic figures), as the controller computes them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from benchmarks.reproduction.content import Picture, Section, say
from geometry import Pose2
from rti_mpcc.config import ControllerConfig
from rti_mpcc.ocp.objectives import StageWeights, Target, TargetKind
from rti_mpcc.paper import PaperObjective
from rti_mpcc.paper.objective import DynamicContouring
from rti_mpcc.report import draw
from rti_mpcc.types import Array

END = 30.0
"""Path end of the drawn schedules [m]."""
SHOWN = (5.0, 36.0)
"""Progress that is drawn [m]."""
_SPACING = 0.05
_HORIZON = 70
_ROWS = (
    ("lag", "lag\n$q_l$ [1/m²]", draw.BLACK, "solid"),
    ("contouring", "contouring\n$q_c$ [1/m²]", draw.BLUE, (0.0, (6.0, 1.5))),
    ("progress_reward", "progress reward\n$\\gamma$ [s/m]", draw.ORANGE, "solid"),
    ("goal", "goal pose\n$q_N$ [1/m²]", draw.RED, (0.0, (6.0, 1.5, 1.0, 1.5))),
)
_SAID = (
    "The weights are drawn by calling the function that the controller calls in every cycle "
    "(`dynamic_weights`, with `ControllerConfig.paper()`), not by formulas written again. The three "
    "columns are the three cases of the paper: a path end or a cusp that is the goal itself (Eq. 7), a "
    "goal pose beside the path (Eq. 9, 10), a goal pose behind the path end (Eq. 11). Eq. 10 prints θ_e "
    "where its prose says θ_g; the published code uses the smaller of the two, and so does this project, "
    "so that one formula serves the last two cases. The weight of the goal pose follows the vehicle's own "
    "progress, all others that of the stage."
)
_CAPTION = (
    "Effective weights over the progress θ with the path ending at θ_e = {end:g} m. Dashed line: where the "
    "path stops to count, min(θ_e, θ_g). Dotted line: β before it, where half of the transition is done."
)


class Schedule(NamedTuple):
    """Weights (n,) over the progress: of a stage there, and the goal's of a vehicle there."""

    lag: Array
    contouring: Array
    progress_reward: Array
    goal: Array


def targets() -> dict[str, Target]:
    """The three cases, by what stands over them."""
    cases = {
        "path end or cusp (Eq. 7)": (TargetKind.PATH_END, 0.0),
        "goal beside the path (Eq. 9, 10)": (TargetKind.POSE, -2.0),
        "goal behind the path end (Eq. 11)": (TargetKind.POSE, 4.0),
    }
    return {
        name: Target(pose=Pose2(END + far, 0.0, 0.0), theta=END + far, theta_end=END, kind=kind)
        for name, (kind, far) in cases.items()
    }


def schedule(config: ControllerConfig, target: Target, theta: Array) -> Schedule:
    """Weights at each progress (n,) [m], without what the last stage of a horizon has besides."""

    def weights(progress: Array) -> StageWeights:
        # Stages of the length that the weights belong to.
        assert isinstance(config.objective, PaperObjective)
        lengths = np.full(len(progress) - 1, config.objective.stage_length)
        return DynamicContouring().weights(config, target, progress, lengths)

    stages = weights(np.append(theta, theta[-1]))  # and one more at the end, which is left out
    goal = [weights(np.full(_HORIZON + 1, one)).goal[0] for one in theta.tolist()]
    return Schedule(stages.lag[:-1], stages.contouring[:-1], stages.progress_reward, np.array(goal))


def schedules_figure() -> Figure:
    """A column a case, a row a weight."""
    config = ControllerConfig.paper()
    theta = np.arange(SHOWN[0], SHOWN[1], _SPACING)
    figure = Figure(figsize=(10.0, 6.8), layout="constrained")
    axes = figure.subplots(len(_ROWS), 3, sharex=True)
    for column, (name, target) in enumerate(targets().items()):
        values = schedule(config, target, theta)
        axes[0, column].set_title(name, fontsize="medium")
        axes[-1, column].set_xlabel("progress θ [m]")
        for row, (field, label, color, dashes) in enumerate(_ROWS):
            one = axes[row, column]
            one.plot(theta, getattr(values, field), color=color, linestyle=dashes, linewidth=1.8)
            one.axvline(target.stop, color=draw.GREY, linestyle="dashed", linewidth=0.9)
            reach = target.stop - config.weights.transition_reach
            one.axvline(reach, color=draw.GREY, linestyle="dotted", linewidth=0.9)
            draw.grid(one)
            # Each by itself: contouring ends at 100 in the first case, begins at 1 in the others.
            top = max(float(getattr(values, field).max()), 1e-3 if field != "goal" else 1.0)
            one.set_ylim(-0.05 * top, 1.15 * top)
            if column == 0:
                one.set_ylabel(label)
    axes[0, 0].set_xlim(*SHOWN)
    return figure


def schedules_section() -> Section:
    """The three schematic figures in one."""
    picture = Picture(
        name="weight_schedules",
        png=draw.png(schedules_figure()),
        caption=_CAPTION.format(end=END),
        told="Lag, contouring, progress and goal weights over the progress for the three kinds of goals.",
    )
    return Section(name="schedules", title="Weight schedules", blocks=[say(_SAID), picture])
