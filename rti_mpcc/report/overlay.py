"""Overlay: what moves, drawn over a kept picture of what stands still. All of a figure takes too long."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.artist import Artist
from matplotlib.backend_bases import DrawEvent, Event
from matplotlib.figure import Figure


class Overlay:
    """Redraws the moving artists of a figure alone.

    Where the canvas cannot keep a picture all is drawn. Figures that are saved have the moving artists too.

    Args:
        figure: with its canvas; moving: artists of it, in the order in which they are drawn, above all else.
    """

    def __init__(self, figure: Figure, moving: Sequence[Artist]) -> None:
        # The stubs leave out what only some canvases have.
        self._canvas: Any = figure.canvas
        self._figure = figure
        self._moving = tuple(moving)
        self._still: Any = None
        for artist in self._moving:
            artist.set_animated(True)
        figure.canvas.mpl_connect("draw_event", self._drawn)

    def update(self) -> None:
        """Draw the moving artists anew."""
        if self._still is None:
            self._canvas.draw_idle()
            return
        self._canvas.restore_region(self._still)
        for artist in self._moving:
            self._figure.draw_artist(artist)
        self._canvas.blit(self._figure.bbox)

    def _drawn(self, event: Event) -> None:
        """All the rest was drawn, on the canvas or into a file."""
        assert isinstance(event, DrawEvent)
        if self._canvas.supports_blit and not self._canvas.is_saving():
            self._still = self._canvas.copy_from_bbox(self._figure.bbox)
        for artist in self._moving:
            artist.draw(event.renderer)
