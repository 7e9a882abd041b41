"""The solver's inside at one cycle: the plan over the horizon, slack and weights of its stages, figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.lines import Line2D

from rti_mpcc.model.layout import DELTA, DELTA_DOT, A, V
from rti_mpcc.report import style
from rti_mpcc.report.axes import grid as faint_grid
from rti_mpcc.report.film import Film
from rti_mpcc.report.views import CycleView
from rti_mpcc.types import Array, Trajectory

_ROOM = 1.1
"""Each axis reaches so many times as far as what is shown on it."""
_STAGE_WEIGHTS = (
    ("lag", "lag", style.BLACK, "solid"),
    ("contouring", "contouring", style.BLUE, "solid"),
    ("progress reward", "progress_reward", style.ORANGE, "solid"),
    ("acceleration", "acceleration", style.GREEN, "dashed"),
    ("steering rate", "steering_rate", style.PINK, "dashed"),
)
"""Weights that all stages have; that of the goal acts on the last one alone."""
_LEAST_LACK = 20.0
"""The panel of the slack reaches so far at least [mm]."""


class PlanPanels:
    """Four panels: v, delta, a, delta_dot of the plan over the time ahead, with their limits.

    Args:
        axes: four, empty; film: whose cycles are shown.
    """

    def __init__(self, axes: Sequence[Axes], film: Film) -> None:
        limits = film.config.limits
        kinds = (
            ("v [m/s]", limits.speed),
            ("delta [rad]", limits.steering),
            ("a [m/s²]", limits.acceleration),
            ("delta_dot [rad/s]", limits.steering_rate),
        )
        plans = [view.observed.command.trajectory for view in film.views]
        horizon = max(float(plan.times[-1] - plan.times[0]) for plan in plans)
        self.lines: list[Line2D] = []
        for one, (name, limit), reach in zip(axes, kinds, _reaches(plans), strict=True):
            _frame(one, name, horizon)
            one.set_title(f"limit ±{limit:g}", fontsize="small", loc="right", pad=2.0)
            for side in (-limit, limit):
                one.axhline(side, color=style.GREY, linestyle="dashdot", linewidth=0.8)
            one.set_ylim(-_ROOM * max(reach, 0.05 * limit), _ROOM * max(reach, 0.05 * limit))
            drawn = "default" if len(self.lines) < 2 else "steps-post"
            (line,) = one.plot([], [], color=style.GREEN, linewidth=1.5, drawstyle=drawn)
            self.lines.append(line)

    def show(self, view: CycleView) -> None:
        """Show the plan of this cycle."""
        plan = view.observed.command.trajectory
        for line, values in zip(self.lines, _curves(plan), strict=True):
            line.set_data(plan.times - plan.times[0], values)


def _curves(plan: Trajectory) -> tuple[Array, Array, Array, Array]:
    """v, delta, a, delta_dot (N+1,); the last input is repeated."""
    controls = np.concatenate([plan.controls, plan.controls[-1:]])
    return plan.states[:, V], plan.states[:, DELTA], controls[:, A], controls[:, DELTA_DOT]


def _reaches(plans: Sequence[Trajectory]) -> Array:
    """(4,) the largest absolute value of each curve in any of the plans."""
    largest = [[np.abs(curve).max() for curve in _curves(plan)] for plan in plans]
    reaches: Array = np.max(largest, axis=0)
    return reaches


def _frame(axes: Axes, name: str, horizon: float) -> None:
    axes.set_xlim(0.0, max(horizon, 1e-3))
    axes.set_ylabel(name)
    faint_grid(axes)


class StagePanels:
    """Two panels over the time ahead: slack of the stages, and their weights, where the cycle has a QP.

    Args:
        slack, weights: axes, empty; film: whose cycles are shown.
    """

    def __init__(self, slack: Axes, weights: Axes, film: Film) -> None:
        plans = [view.observed.command.trajectory for view in film.views]
        horizon = max(float(plan.times[-1] - plan.times[0]) for plan in plans)
        self._frame_slack(slack, film, horizon)
        _frame(weights, "stage weights", horizon)
        weights.set_xlabel("time ahead [s]")
        # From 0 to 1e5: linear below 1, so that a weight that is switched off still shows.
        weights.set_yscale("symlog", linthresh=1.0)
        weights.set_yticks([0.0, 1e0, 1e2, 1e4, 1e6])
        weights.set_ylim(0.0, 1e3 * _largest_weight(film))
        self.weights = [
            weights.plot([], [], color=color, linestyle=dashes, drawstyle="steps-post", label=label)[0]
            for label, _, color, dashes in _STAGE_WEIGHTS
        ]
        weights.legend(loc="upper right", fontsize="x-small", ncols=2, framealpha=0.7)

    def _frame_slack(self, axes: Axes, film: Film, horizon: float) -> None:
        _frame(axes, "slack [mm]", horizon)
        axes.set_xlabel("time ahead [s]")
        (self.lack,) = axes.plot([], [], color=style.GREY, linewidth=2.5, label="plan lacks of the margin")
        (self.slack,) = axes.plot([], [], color=style.RED, linewidth=1.2, label="slack in the QP")
        largest = max(1e3 * _worst(view) for view in film.views)
        axes.set_ylim(-0.05 * _LEAST_LACK, _ROOM * max(largest, _LEAST_LACK))
        axes.legend(loc="upper right", fontsize="x-small", framealpha=0.7)

    @property
    def lines(self) -> list[Line2D]:
        """All curves."""
        return [self.lack, self.slack, *self.weights]

    def show(self, view: CycleView) -> None:
        """Show this cycle; curves of a QP that it has not are empty."""
        plan, inside = view.observed.command.trajectory, view.observed.inside
        self.lack.set_data(plan.times[1:] - plan.times[0], 1e3 * view.lack)
        ahead = np.zeros(0) if inside is None else inside.times - inside.times[0]
        self.slack.set_data(ahead[1:], np.zeros(0) if inside is None else 1e3 * inside.slack)
        for line, (_, name, _, _) in zip(self.weights, _STAGE_WEIGHTS, strict=True):
            values = np.zeros(0) if inside is None else getattr(inside.weights, name)
            line.set_data(ahead[: len(values)], values)


def _worst(view: CycleView) -> float:
    """The largest slack that is shown [m]."""
    inside = view.observed.inside
    return max(float(view.lack.max()), 0.0 if inside is None else float(inside.slack.max()))


def _largest_weight(film: Film) -> float:
    kept = [view.observed.inside.weights for view in film.views if view.observed.inside is not None]
    return max([1.0, *(float(np.max(getattr(one, name))) for one in kept for _, name, *_ in _STAGE_WEIGHTS)])


def inside_panels(figure: Figure, place: SubplotSpec, film: Film) -> tuple[PlanPanels, StagePanels]:
    """Six panels in two columns on this place of a figure."""
    grid = place.subgridspec(3, 2, wspace=0.45, hspace=0.35)
    axes = [figure.add_subplot(grid[row, column]) for row in range(3) for column in range(2)]
    plan = PlanPanels((axes[0], axes[2], axes[1], axes[3]), film)
    return plan, StagePanels(axes[4], axes[5], film)


def figures_of(view: CycleView, index: int, count: int) -> str:
    """Lines with status, reason, solver and times of the cycle with this index of `count`."""
    command = view.observed.command
    told = command.diagnostics
    ahead = "" if told.time_to_go is None else f", {told.time_to_go:.2f} s to go"
    remarks = [
        word
        for word, holds in (
            ("not accepted", told.failed),
            ("sought twice", told.retried),
            ("deadline missed", told.deadline_missed),
        )
        if holds
    ]
    primal, dual = told.residuals
    return "\n".join(
        (
            f"cycle {index + 1} of {count}, {view.time:.2f} s: {command.status.value}",
            f"driven: {command.source.value}; objective: {told.objective.value}{ahead}",
            f"reason: {told.reason or '-'}",
            f"solver: {told.solver_status or 'no QP'}, {told.iterations} iterations, "
            f"residuals {primal:.1e}, {dual:.1e}" + "".join(f", {word}" for word in remarks),
            f"largest slack {1e3 * told.slack:.1f} mm, {len(view.planes.points)} active half-planes",
            f"prepare {told.prepare_ms:.1f} ms, feedback {told.feedback_ms:.1f} ms "
            f"(solver {told.solve_ms:.1f} ms), whole step {told.step_ms:.1f} ms",
        )
    )
