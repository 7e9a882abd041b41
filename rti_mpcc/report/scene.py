"""Scene: the plane from above at one cycle, with the plan and the half-planes that hold it."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import style
from rti_mpcc.report.axes import plane
from rti_mpcc.report.film import Film
from rti_mpcc.report.ground import (
    boundaries_of,
    draw_area,
    draw_boundaries,
    draw_path,
    drawn_outlines,
    path_lines,
)
from rti_mpcc.report.views import ActivePlanes, CycleView
from rti_mpcc.types import Array

MARGIN, AROUND = 1.0, 4.0
"""Room around all that is driven and stands there, and in an area around all that is driven [m]."""
PLANE, NORMAL = 0.7, 0.5
"""Half the drawn length of a half-plane's edge, and the length of its normal [m]."""
_BODIES = 6
"""Bodies drawn along the plan, the last one at its end."""
_WHEEL = 0.45
"""Half the drawn length of the bicycle's front wheel [m]."""


class Scene:
    """Axes on which path and boundaries or the area are drawn once, and all else where the cycle has it.

    Args:
        axes: to draw on, empty; film: whose cycles are shown.
    """

    def __init__(self, axes: Axes, film: Film) -> None:
        self.axes = axes
        self.film = film
        self._driven = np.array([view.pose for view in film.views])
        anew = any(view.observed.planned is not None for view in film.views)
        if film.area is not None:
            draw_area(axes, film.area)
        if film.path is not None and film.corridor is not None:
            if len(film.path.parts) > 1:
                others = {"color": style.GREY, "label": "corridor, other part"}
                draw_boundaries(axes, film.corridor, film.path, **others)
            told = {"color": style.PINK, "label": "earlier path"} if anew else {}
            draw_path(axes, film.path, **told)
        # What changes with the cycle: the active part's boundaries, and ways that are planned.
        in_area = film.area is not None
        self.walls = self._lines(style.BLACK, "" if in_area else "corridor")
        self.planned = self._lines(style.ORANGE, "path" if in_area else "path" if anew else "")
        self._add_bodies()
        self._add_lines()
        _lay_out(axes, film)
        self.show(0)

    def _add_bodies(self) -> None:
        views = self.film.views
        there = any(view.obstacles for view in views)
        self.obstacles = self._polygons(
            "obstacle" if there else "", facecolors=style.GREY, edgecolors=style.BLACK
        )
        self.plan_bodies = self._polygons(
            "body, predicted", facecolors="none", edgecolors=style.GREEN, linewidths=0.5
        )
        self.body = self._polygons("body", facecolors=style.SKY, edgecolors=style.BLUE, alpha=0.8)
        dotted = {"edgecolors": style.BLACK, "linewidths": 1.0, "linestyles": "dotted"}
        self.aim = self._polygons("pose aimed at", facecolors="none", **dotted)
        known = any(view.goal is not None for view in views)
        dashed = {"edgecolors": style.RED, "linewidths": 1.5, "linestyles": "dashed"}
        self.goal = self._polygons("goal" if known else "", facecolors="none", **dashed)

    def _lines(self, color: str, label: str) -> LineCollection:
        lines = LineCollection([], colors=color, linewidths=1.2, label=label or "_")
        self.axes.add_collection(lines, autolim=False)
        return lines

    def _polygons(self, label: str, **view: Any) -> PolyCollection:
        shapes = PolyCollection([], label=label or "_", **view)
        self.axes.add_collection(shapes, autolim=False)
        return shapes

    def _add_lines(self) -> None:
        axes = self.axes
        (self.driven,) = axes.plot([], [], color=style.BLUE, linewidth=1.5, label="rear axle, driven")
        (self.plan,) = axes.plot(
            [], [], color=style.GREEN, linewidth=1.5, marker=".", markersize=4.0, label="predicted"
        )
        (self.wheel,) = axes.plot([], [], color=style.BLACK, linewidth=2.5, solid_capstyle="butt")
        self.planes = LineCollection([], colors=style.PINK, linewidths=2.5, label="active half-plane")
        self.normals = LineCollection([], colors=style.PINK, linewidths=0.8)
        for lines in (self.planes, self.normals):
            axes.add_collection(lines, autolim=False)
            lines.set_zorder(3.0)

    @property
    def moving(self) -> list[Artist]:
        """What differs from cycle to cycle, in the order in which it is drawn."""
        bodies = [self.obstacles, self.plan_bodies, self.body, self.aim, self.goal]
        return [
            self.walls,
            self.planned,
            *bodies,
            self.driven,
            self.wheel,
            self.plan,
            self.planes,
            self.normals,
        ]

    def show(self, index: int) -> None:
        """Show the cycle with this index in the film."""
        view, vehicle = self.film.views[index], self.film.config.vehicle
        states = view.observed.command.trajectory.states
        self._show_course(view)
        self.obstacles.set_verts(drawn_outlines(view.obstacles))
        self.aim.set_verts(list(body_polygons(view.aim[None], vehicle)))
        goals = np.zeros((0, 3)) if view.goal is None else view.goal[None]
        self.goal.set_verts(list(body_polygons(goals, vehicle)))
        self.body.set_verts(list(body_polygons(view.pose[None], vehicle)))
        places = np.linspace(0, len(states) - 1, _BODIES + 1).round().astype(int)[1:]
        self.plan_bodies.set_verts(list(body_polygons(states[places], vehicle)))
        self.driven.set_data(*self._driven[: index + 1, :2].T)
        self.plan.set_data(states[:, 0], states[:, 1])
        self.wheel.set_data(*_front_wheel(view.pose, view.observed.state.delta, vehicle.wheelbase).T)
        edges, normals = plane_lines(view.planes)
        self.planes.set_segments(list(edges))
        self.normals.set_segments(list(normals))

    def _show_course(self, view: CycleView) -> None:
        """The boundaries that act, and the way that was planned: in place of a path all of them act."""
        corridor, planned = self.film.corridor, view.observed.planned
        if corridor is not None:
            part = view.observed.command.diagnostics.part
            acting = range(len(corridor.walls)) if planned is not None else (part,)
            self.walls.set_segments([line for k in acting for side in corridor.lines(k) for line in side])
        if planned is not None or corridor is not None:
            self.planned.set_segments([] if planned is None else path_lines(planned))


def plane_lines(planes: ActivePlanes) -> tuple[Array, Array]:
    """Edges and normals of half-planes as line segments (k, 2, 2) [m]."""
    along = np.stack([-planes.normals[:, 1], planes.normals[:, 0]], axis=-1)
    ends = planes.points[:, None] + PLANE * np.array([-1.0, 1.0])[:, None] * along[:, None]
    normals = planes.points[:, None] + NORMAL * np.array([0.0, 1.0])[:, None] * planes.normals[:, None]
    return ends, normals


def _front_wheel(pose: Array, delta: float, wheelbase: float) -> Array:
    """(2, 2) ends of the bicycle's front wheel [m]."""
    x, y, phi = pose.tolist()
    centre = np.array([x + wheelbase * np.cos(phi), y + wheelbase * np.sin(phi)])
    half = _WHEEL * np.array([np.cos(phi + delta), np.sin(phi + delta)])
    return np.stack([centre - half, centre + half])


def extent(film: Film) -> tuple[float, float, float, float]:
    """Left, right, bottom, top of all that a scene has to show [m]."""
    vehicle = film.config.vehicle
    found = [pose for view in film.views for pose in (view.pose, view.goal, view.aim) if pose is not None]
    poses = np.array(found)
    bodies = body_polygons(poses[np.isfinite(poses).all(axis=1)], vehicle).reshape(-1, 2)
    lines: list[Array] = []
    if film.path is not None and film.corridor is not None:
        lines = [*boundaries_of(film.corridor, film.path), *path_lines(film.path)]
    obstacles = {id(outline): outline for view in film.views for outline in view.obstacles}
    points = np.concatenate([bodies, *lines, *obstacles.values()])
    room = MARGIN if film.area is None else AROUND
    (left, bottom), (right, top) = points.min(axis=0) - room, points.max(axis=0) + room
    return float(left), float(right), float(bottom), float(top)


def _lay_out(axes: Axes, film: Film) -> None:
    left, right, bottom, top = extent(film)
    axes.set_autoscale_on(False)
    plane(axes)
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
