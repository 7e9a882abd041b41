"""One cycle of a ride: the plane with the plan, effective weights, the camera's picture."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from io import BytesIO
from operator import itemgetter
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from PIL import Image

from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.model.layout import X, Y
from rti_mpcc.recording.moment import Moment, widened
from rti_mpcc.report import draw
from rti_mpcc.report.overview import show_ride
from rti_mpcc.report.ride import Ride
from rti_mpcc.types import Array

_BODIES = 6  # bodies drawn along the plan, the last one at its end
_WHEEL = np.array([-0.45, 0.45])  # ends of the bicycle's front wheel as it is drawn, along the wheel [m]


class Scene:
    """Empty axes with the surroundings drawn once, and a moment of the ride.

    `moving` are the artists that change, in the order in which they are drawn.
    """

    def __init__(self, axes: Axes, ride: Ride) -> None:
        self.axes, self.ride = axes, ride
        self.moving: list[Artist] = []
        replanned = ride.path is not None and len(ride.routes) > 1
        if ride.area is not None:
            draw.area(axes, ride.area)
        if ride.path is not None and ride.corridor is not None:
            if len(ride.path.parts) > 1:
                draw.lines(axes, draw.boundaries_of(ride.corridor), draw.GREY, "corridor, other segment")
            color, label = (draw.PINK, "earlier route") if replanned else (draw.ORANGE, "path")
            draw.lines(axes, draw.path_lines(ride.path), color, label)
        self.walls = self._lines(draw.BLACK, "corridor" if ride.area is None else "_")
        self.route = self._lines(draw.ORANGE, "route" if ride.path is None or replanned else "_")
        there = "obstacle" if any(moment.obstacles for moment in ride.moments) else "_"
        self.obstacles = self._shapes(there, draw.BLACK, facecolors=draw.GREY)
        self.plan_bodies = self._shapes("body, predicted", draw.GREEN, linewidths=0.5)
        self.body = self._shapes("body", draw.BLUE, facecolors=draw.SKY, alpha=0.8)
        self.target = self._shapes("end of the segment", draw.BLACK, linestyles="dotted")
        known = "goal" if any(moment.goal is not None for moment in ride.moments) else "_"
        self.goal = self._shapes(known, draw.RED, linewidths=1.5, linestyles="dashed")
        self.driven, self.wheel, self.plan = axes.plot([], [], [], [], [], [])
        self.driven.set(color=draw.BLUE, linewidth=1.5, label="rear axle, driven")
        self.wheel.set(color=draw.BLACK, linewidth=2.5, solid_capstyle="butt")
        self.plan.set(color=draw.GREEN, linewidth=1.5, marker=".", markersize=4.0, label="predicted")
        self.status = axes.text(0.5, 1.01, "", transform=axes.transAxes, ha="center", va="bottom")
        self.moving += [self.driven, self.wheel, self.plan, self.status]
        axes.set_title(ride.title, pad=20.0)
        draw.plane(axes)
        show_ride(axes, ride)
        self._driven = np.array([moment.pose[:2] for moment in ride.moments])

    def _lines(self, color: str, label: str) -> LineCollection:
        lines = LineCollection([], colors=color, label=label, linewidths=1.2)
        self.axes.add_collection(lines, autolim=False)
        self.moving.append(lines)
        return lines

    def _shapes(self, label: str, color: str, **look: Any) -> PolyCollection:
        shapes = PolyCollection([], label=label, edgecolors=color, **{"facecolors": "none"} | look)
        self.axes.add_collection(shapes, autolim=False)
        self.moving.append(shapes)
        return shapes

    def show(self, index: int) -> None:
        """Show the moment with this index."""
        moment, vehicle, given = self.ride.moments[index], self.ride.config.vehicle, self.ride.corridor
        states, target = moment.command.trajectory.states, moment.command.diagnostics.target
        in_area = moment.corridor is not None and moment.corridor.area is not None
        planned = moment.route if in_area else None
        self.route.set_segments([] if planned is None else draw.path_lines(planned))
        if given is not None:  # on a planned route all its boundaries act
            active = (moment.command.diagnostics.part,) if planned is None else None
            self.walls.set_segments(draw.boundaries_of(given, active))
        self.obstacles.set_verts(widened(moment.obstacles))
        places = np.linspace(0, len(states) - 1, _BODIES + 1).round().astype(int)[1:]
        for shapes, poses in (
            (self.plan_bodies, states[places]),
            (self.body, moment.pose[None]),
            (self.target, np.array([[target.x, target.y, target.phi]])),
            (self.goal, np.zeros((0, 3)) if moment.goal is None else moment.goal[None]),
        ):
            shapes.set_verts(list(body_polygons(poses, vehicle)))
        self.driven.set_data(*self._driven[: index + 1].T)
        self.plan.set_data(states[:, X], states[:, Y])
        x, y, phi = moment.pose.tolist()
        turned = phi + moment.state.delta
        front = x + vehicle.wheelbase * np.cos(phi), y + vehicle.wheelbase * np.sin(phi)
        self.wheel.set_data(front[0] + _WHEEL * np.cos(turned), front[1] + _WHEEL * np.sin(turned))
        self.status.set_text(status_line(moment))


def status_line(moment: Moment) -> str:
    """Time, status and source of a cycle."""
    command = moment.command
    step = "" if command.mission is None else f"{command.mission.kind}, "
    return f"{moment.time:.1f} s: {step}{command.status.value} ({command.source.value})"


class WeightBars:
    """One bar for each effective weight, up to the `largest` of all that are shown."""

    def __init__(self, axes: Axes, largest: float) -> None:
        names, colors = zip(*draw.WEIGHTS, strict=True)
        self.moving = list(axes.barh(range(len(names)), [0.0] * len(names), color=colors, height=0.7).patches)
        # From 0 to 1e5: linear below 1, so that a weight that is switched off still shows.
        axes.set_xscale("symlog", linthresh=1.0)
        axes.set_xlim(0.0, 10.0 * max(1.0, largest))
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_yticks(range(len(names)), names)
        axes.set_xlabel("effective weights")
        axes.grid(axis="x", color=draw.GREY, alpha=0.25, linewidth=0.5)

    def show(self, moment: Moment) -> None:
        """Show the weights of this cycle."""
        for bar, value in zip(self.moving, moment.weights, strict=True):
            bar.set_width(value)


class CameraView:
    """The last picture of the camera; frames: (stamp [s], JPEG file), at least one, in order of time."""

    def __init__(self, axes: Axes, frames: Sequence[tuple[float, bytes]]) -> None:
        self._frames = frames
        axes.set_axis_off()
        axes.set_title("camera")
        self._image = axes.imshow(self._picture(0), alpha=0.0)
        self._word = axes.text(0.5, 0.5, "", transform=axes.transAxes, ha="center", va="center")
        self.moving: list[Artist] = [self._image, self._word]

    def _picture(self, place: int) -> Array:
        return np.asarray(Image.open(BytesIO(self._frames[place][1])))

    def show(self, time: float) -> None:
        """Show the last picture at this time [s]."""
        place = bisect_right(self._frames, time, key=itemgetter(0)) - 1
        self._image.set_alpha(float(place >= 0))
        self._image.set_data(self._picture(max(place, 0)))
        self._word.set_text("no picture yet" if place < 0 else "")
