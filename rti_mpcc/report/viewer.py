"""A window on a ride: the scene and the strip charts, at the time of a slider."""

from __future__ import annotations

from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.widgets import Slider

from rti_mpcc.errors import InputError
from rti_mpcc.report import style
from rti_mpcc.report.axes import legend_below
from rti_mpcc.report.ride import Ride
from rti_mpcc.report.scene import Scene
from rti_mpcc.report.timeline import MOTION, strip_charts

_WIDTH = 80
"""Letters in a line of text."""


class Viewer:
    """Shows one moment of a ride at a time in an empty figure."""

    def __init__(self, figure: Figure, ride: Ride) -> None:
        self.ride, self.index, self._figure = ride, 0, figure
        figure.set_size_inches(15.0, 8.5)
        parts: Any = figure.subfigures(2, 1, height_ratios=(12, 1))  # its stub knows one subfigure
        left, right = parts[0].subfigures(1, 2)
        self.scene = Scene(left.subplots(), ride)
        legend_below(left)
        charts = right.subplots(MOTION, 1, sharex=True)
        strip_charts(charts, ride, {})
        self.text = right.suptitle("", fontsize="medium")
        self.cursors = [
            axes.axvline(ride.moments[0].time, color=style.BLACK, linewidth=1.0) for axes in charts
        ]
        times = np.unique([moment.time for moment in ride.moments])
        place = parts[1].add_axes((0.1, 0.3, 0.75, 0.5))
        last = max(times[-1], times[0] + 1e-3)
        self.slider = Slider(place, "time", times[0], last, valinit=times[0], valstep=times, valfmt="%.2f s")
        self.slider.on_changed(lambda time: self.show(ride.at(time)))
        self.show(0)

    def show(self, index: int) -> None:
        """Show the moment with this index."""
        self.index, moment = index, self.ride.moments[index]
        self.scene.show(index)
        for cursor in self.cursors:
            cursor.set_xdata([moment.time, moment.time])
        told = moment.command.diagnostics
        line = f"cycle {index + 1} of {len(self.ride.moments)}, {told.step_ms:.1f} ms"
        self.text.set_text(f"{line}\n{fill(told.reason, _WIDTH)}")
        self._figure.canvas.draw_idle()


def open_window() -> Figure:
    """An empty window, which `watch` shows. Raises InputError where matplotlib can open none."""
    # Not at the top: pyplot looks for a display when it is loaded.
    import matplotlib.pyplot as plt

    problem = f"matplotlib's backend is {plt.get_backend()}, which only writes files"
    try:
        figure = plt.figure(layout="constrained")
        opens = figure.canvas.required_interactive_framework is not None
    except Exception as error:  # each toolkit has its own type for a missing display
        opens, problem = False, " ".join(str(error).split()) or type(error).__name__
    if not opens:
        raise InputError(f"watch opens a window, which needs a display: {problem}")
    return figure


def watch(figure: Figure, ride: Ride) -> Any:
    """Show a ride in a window, and return when it is closed."""
    import matplotlib.pyplot as plt

    viewer = Viewer(figure, ride)
    plt.show()
    return viewer  # held until here: a slider that nobody holds does nothing
