"""Bars that show the effective weights of a cycle."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.artist import Artist
from matplotlib.axes import Axes

from rti_mpcc.report import style
from rti_mpcc.report.film import Film
from rti_mpcc.report.views import CycleView
from rti_mpcc.types import EffectiveWeights


class WeightBars:
    """One bar for each effective weight of the plan's first stage.

    Args:
        axes: to draw on, empty; films: all that are shown together, the axis reaches beyond their largest
            weight.
    """

    def __init__(self, axes: Axes, films: Sequence[Film]) -> None:
        names = [name for name, _ in style.WEIGHTS]
        colors = [color for _, color in style.WEIGHTS]
        self.bars = axes.barh(range(len(names)), [0.0] * len(names), color=colors, height=0.7)
        shown = [view.observed.command.diagnostics.weights for film in films for view in film.views]
        largest = max(max(values_of(weights)) for weights in shown)
        # From 0 to 1e5: linear below 1, so that a weight that is switched off still shows.
        axes.set_xscale("symlog", linthresh=1.0)
        axes.set_xlim(0.0, 10.0 * max(1.0, largest))
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_yticks(range(len(names)), names)
        axes.set_xlabel("effective weights of the first stage, goal's of the last")
        axes.grid(axis="x", color=style.GREY, alpha=0.25, linewidth=0.5)

    @property
    def moving(self) -> list[Artist]:
        """What differs from cycle to cycle."""
        return list(self.bars.patches)

    def show(self, view: CycleView) -> None:
        """Show the weights of this cycle."""
        values = values_of(view.observed.command.diagnostics.weights)
        for bar, value in zip(self.bars.patches, values, strict=True):
            bar.set_width(value)


def values_of(weights: EffectiveWeights) -> tuple[float, ...]:
    """The weights in the order of `style.WEIGHTS`."""
    return weights.lag, weights.contouring, weights.progress_reward, weights.goal_position
