"""What the figures of pages share: axes, legends, and pictures in memory."""

from __future__ import annotations

from collections.abc import Iterable
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rti_mpcc.report import style

PRINT_DPI = 160
"""Resolution of the pictures [dots/inch]."""
BESIDE: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (1.01, 1.0)}
BESIDE |= {"borderaxespad": 0.0, "frameon": False}
"""A legend to the right of its axes."""


def plane(axes: Axes) -> None:
    """Axes of the plane from above: equal, in metres."""
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    grid(axes)


def grid(axes: Axes) -> None:
    """A faint grid."""
    axes.grid(color=style.GREY, alpha=0.25, linewidth=0.5)


def legend_below(figure: Figure, *, columns: int = 4) -> None:
    """One legend for all axes, each label once, below them; the figure has to have a constrained layout."""
    look: dict[str, Any] = {"frameon": False, "fontsize": "small", "handlelength": 3.5}
    figure.legend(*entries_once(figure.axes), loc="outside lower center", ncols=columns, **look)


def entries_once(several: Iterable[Axes]) -> tuple[list[Artist], list[str]]:
    """Handles and labels for a legend of several axes, each label once."""
    found: dict[str, Artist] = {}
    for axes in several:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    return list(found.values()), list(found)


def png(figure: Figure) -> bytes:
    """The picture of a figure."""
    stream = BytesIO()
    save(figure, stream, dpi=PRINT_DPI)
    return stream.getvalue()


def save(figure: Figure, file: Path | BytesIO, *, dpi: int = style.DPI) -> None:
    """Write a figure as PNG. Raises OSError."""
    # Tight: the layout doesn't know the tick labels that the final size brings.
    figure.savefig(file, format="png", dpi=dpi, bbox_inches="tight")
