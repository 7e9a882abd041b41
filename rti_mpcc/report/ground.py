"""What stands still in a picture of the plane from above: the path and the boundaries."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from geometry import Corridor, ReferencePath
from rti_mpcc.report import style
from rti_mpcc.types import Array

_PATH_SPACING = 0.1
"""Spacing of the drawn path [m]."""


def draw_boundaries(
    axes: Axes,
    corridor: Corridor,
    path: ReferencePath,
    *,
    color: str = style.BLACK,
    label: str = "corridor",
) -> None:
    """The boundaries of all parts."""
    _add_lines(axes, boundaries_of(corridor, path), color=color, label=label)


def draw_path(axes: Axes, path: ReferencePath) -> None:
    """The path, each of its parts."""
    _add_lines(axes, path_lines(path), color=style.ORANGE, label="path")


def boundaries_of(corridor: Corridor, path: ReferencePath) -> list[Array]:
    """Polylines (k, 2) [m]."""
    return [line for part in range(len(path.parts)) for side in corridor.lines(part) for line in side]


def path_lines(path: ReferencePath) -> list[Array]:
    """One polyline (k, 2) [m] a part."""
    return [np.stack([at.x, at.y], axis=-1) for at in path.sample(_PATH_SPACING)]


def _add_lines(axes: Axes, lines: Iterable[Array], *, color: str, label: str) -> None:
    drawn = list(lines)
    if drawn:
        axes.add_collection(LineCollection(drawn, colors=color, linewidths=1.2, label=label))
