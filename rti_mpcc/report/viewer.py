"""A window on a run or a recording: play it, go to any cycle, and see what the solver did there."""

from __future__ import annotations

from textwrap import fill
from typing import Any

from matplotlib.backend_bases import Event, KeyEvent
from matplotlib.figure import Figure
from matplotlib.widgets import Button, Slider

from rti_mpcc.errors import InputError
from rti_mpcc.report import style
from rti_mpcc.report.bars import WeightBars
from rti_mpcc.report.film import Film
from rti_mpcc.report.inside import figures_of, inside_panels
from rti_mpcc.report.overlay import Overlay
from rti_mpcc.report.scene import Scene

SIZE = (15.0, 8.5)
"""Of the window [inch]."""
TICK = 0.1
"""Time between two pictures while it plays [s]: of the clock on the wall, and of the run."""
KEYS = {"left": -1, "right": 1}
"""Keys that go a cycle on or back."""
FAR_KEYS = {"down": -1.0, "up": 1.0, "pagedown": -5.0, "pageup": 5.0}
"""Keys that go on or back in time [s]."""
_WIDTH = 80
"""Of a line of text."""
_PLAY, _PAUSE = "play", "pause"
_TAKEN = {" ", "home", "end", *KEYS, *FAR_KEYS}
_NO_WINDOW = "watch opens a window, for which there is no display here"


class Viewer:
    """Shows one cycle of a film at a time in a figure: scene, weights, the solver's inside.

    Args:
        film: what is shown; figure: to draw on, empty.
    """

    def __init__(self, film: Film, figure: Figure) -> None:
        self.film = film
        self.figure = figure
        self.index = 0
        self.playing = False
        self._lay_out()
        # Axes are artists, too: widgets are redrawn whole.
        widgets = [self.text, self.slider.ax, self.button.ax]
        moving = [*self.scene.moving, *self.bars.moving, *self.plan.lines, *self.stages.lines, *widgets]
        self._overlay = Overlay(figure, moving)
        self._timer: Any = figure.canvas.new_timer(interval=round(1e3 * TICK))
        self._timer.add_callback(self.tick)
        self.button.on_clicked(self._pressed)
        self.slider.on_changed(self._slid)
        figure.canvas.mpl_connect("key_press_event", self._key)
        figure.canvas.mpl_connect("close_event", self._closed)
        self._show(0)

    def _lay_out(self) -> None:
        figure, film = self.figure, self.film
        figure.suptitle(film.label, x=0.27)
        left = figure.add_gridspec(2, 1, left=0.09, right=0.45, bottom=0.22, top=0.93, height_ratios=(5, 1))
        self.scene = Scene(figure.add_subplot(left[0]), film)
        self.bars = WeightBars(figure.add_subplot(left[1]), [film])
        handles, labels = self.scene.axes.get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="lower left",
            bbox_to_anchor=(0.0, 0.085),
            ncols=5,
            frameon=False,
            fontsize="x-small",
        )
        right = figure.add_gridspec(1, 1, left=0.53, right=0.985, bottom=0.15, top=0.77)
        self.plan, self.stages = inside_panels(figure, right[0], film)
        self.text = figure.text(0.5, 0.985, "", va="top", family="monospace", fontsize="medium")
        self._add_widgets()

    def _add_widgets(self) -> None:
        figure, film = self.figure, self.film
        # One colour: a change of it when the mouse comes would redraw everything.
        self.button = Button(
            figure.add_axes((0.03, 0.03, 0.06, 0.045)), _PLAY, color=style.SKY, hovercolor=style.SKY
        )
        begin, end = float(film.times[0]), float(film.times[-1])
        self.slider = Slider(
            figure.add_axes((0.15, 0.03, 0.76, 0.045)),
            "time",
            begin,
            max(end, begin + 1e-3),
            valinit=begin,
            valfmt="%.2f s",
            color=style.BLUE,
            initcolor="none",
        )
        self.button.drawon = self.slider.drawon = False

    # -- what can be done -----------------------------------------------------------------------

    def go(self, time: float) -> None:
        """Show the cycle at this time [s], the first or last one if there is none."""
        self.slider.set_val(min(max(time, self.slider.valmin), self.slider.valmax))

    def step(self, cycles: int) -> None:
        """Go so many cycles on, or back."""
        self._pause()
        index = min(max(self.index + cycles, 0), len(self.film.views) - 1)
        # Of cycles at the same time the slider knows but one.
        self.slider.eventson = False
        self.go(float(self.film.times[index]))
        self.slider.eventson = True
        self._show(index)

    def toggle(self) -> None:
        """Play, from the begin if it is at the end; or pause."""
        if self.playing:
            self._pause()
            return
        if self.index == len(self.film.views) - 1:
            self.go(self.slider.valmin)
        self.playing = True
        self.button.label.set_text(_PAUSE)
        self._timer.start()
        self._overlay.update()

    def tick(self) -> None:
        """Go on while it plays; pause at the end."""
        if not self.playing:
            return
        self.go(float(self.slider.val) + TICK)
        if self.index == len(self.film.views) - 1:
            self._pause()

    # -- callbacks ------------------------------------------------------------------------------

    def _pause(self) -> None:
        self.playing = False
        self.button.label.set_text(_PLAY)
        self._timer.stop()
        self._overlay.update()

    def _pressed(self, _: Event) -> None:
        self.toggle()

    def _slid(self, time: float) -> None:
        self._show(self.film.at(time))

    def _key(self, event: Event) -> None:
        key = event.key if isinstance(event, KeyEvent) else None
        if key == " ":
            self.toggle()
        elif key in KEYS:
            self.step(KEYS[key])
        elif key in FAR_KEYS:
            self.go(float(self.slider.val) + FAR_KEYS[key])
        elif key in ("home", "end"):
            self.go(self.slider.valmin if key == "home" else self.slider.valmax)

    def _closed(self, _: Event) -> None:
        self.playing = False
        self._timer.stop()

    def _show(self, index: int) -> None:
        self.index = index
        view = self.film.views[index]
        self.scene.show(index)
        self.bars.show(view)
        self.plan.show(view)
        self.stages.show(view)
        lines = figures_of(view, index, len(self.film.views)).splitlines()
        self.text.set_text("\n".join(fill(line, _WIDTH, subsequent_indent="    ") for line in lines))
        self._overlay.update()


def require_window() -> None:
    """Raises InputError where matplotlib can open no window."""
    # Not at the top: pyplot looks for a display when it is loaded.
    import matplotlib.pyplot as plt

    try:
        figure = plt.figure()
    except Exception as error:  # each toolkit has its own for that there is no display
        told = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{_NO_WINDOW}: {told}") from error
    opens = figure.canvas.required_interactive_framework is not None
    plt.close(figure)
    if not opens:
        raise InputError(
            f"{_NO_WINDOW}: matplotlib's backend is {plt.get_backend()}, which only writes files"
        )


def watch(film: Film) -> Viewer:
    """Open a window on a film, and return when it is closed. Raises InputError where there is no display."""
    import matplotlib.pyplot as plt

    require_window()
    # The toolbar listens to some of the same keys.
    free: Any = {
        name: [key for key in plt.rcParams[name] if key not in _TAKEN]
        for name in plt.rcParams
        if name.startswith("keymap.")
    }
    with plt.rc_context(free):
        # Held until the window is closed: widgets nobody holds are deaf.
        viewer = Viewer(film, plt.figure(figsize=SIZE))
        plt.show()
    return viewer
