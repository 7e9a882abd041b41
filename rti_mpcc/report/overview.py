"""The plane from above: route, corridor or area, the driven body each second, the goal and its detections."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from geometry import Pose2
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.report import draw
from rti_mpcc.report.ride import Ride

_WIDEST, _HIGHEST, _LOWEST = 6.5, 8.5, 2.5  # bounds on the size of the axes [inch]
_BESIDE, _ABOVE = 3.2, 1.1  # room for labels, legend and title [inch]
_ARROWS = 6  # arrows of the direction of motion, evenly along what was driven


def overview_figure(ride: Ride) -> Figure:
    """Route, corridor or static obstacles, obstacles that came, body each second and at the end, goals.

    The true goal is drawn at its last place, and at each one before it moved; the detected goals are dots at
    the place of the rear axle. Axes are equal, in metres; the legend stands outside of the data.
    """
    figure = Figure(layout="constrained")
    axes = figure.add_subplot()
    if ride.area is not None:
        draw.area(axes, ride.area)
    if ride.path is not None and ride.corridor is not None:
        draw.lines(axes, draw.boundaries_of(ride.corridor), draw.BLACK, "corridor")
    draw.outlines(axes, ride.obstacles)
    routes = [route for _, route in ride.routes]
    for place, route in enumerate(routes[:-1]):
        draw.lines(axes, draw.path_lines(route), draw.PINK, "_" if place else "earlier route")
    for route in routes[-1:]:
        draw.lines(axes, draw.path_lines(route), draw.ORANGE, "path" if routes == [ride.path] else "route")
    motion, vehicle = ride.motion, ride.config.vehicle
    rows = np.searchsorted(motion.times, np.arange(motion.times[0], ride.end, 1.0))
    poses = motion.poses[np.unique([*rows, len(motion.times) - 1])]
    draw.bodies(axes, poses, vehicle, draw.BLUE, "body each second", linewidths=0.6)
    axes.plot(*motion.poses[:, :2].T, color=draw.BLUE, linewidth=1.5, label="rear axle, driven")
    _draw_motion(axes, ride)
    draw.bodies(axes, poses[-1], vehicle, draw.BLUE, "body at the end", facecolors=draw.SKY, alpha=0.6)
    _draw_goals(axes, ride)
    _draw_steps(axes, ride)
    draw.plane(axes)
    show_ride(axes, ride)
    # A wide course gets a low picture and a tall one a high picture.
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    scale = min(_WIDEST / (right - left), _HIGHEST / (top - bottom))
    height = max(scale * (top - bottom), _LOWEST)
    figure.set_size_inches(scale * (right - left) + _BESIDE, height + _ABOVE)
    axes.set_autoscale_on(False)  # a wild detection may lie far outside
    for accepted, name, color, marker in (
        (True, "detection, accepted", draw.GREEN, "."),
        (False, "detection, rejected", draw.RED, "x"),
    ):
        known = [each.pose for each in ride.detections if each.accepted is accepted and each.pose is not None]
        if known:
            x, y = np.array([(pose.x, pose.y) for pose in known]).T
            axes.scatter(x, y, s=10.0, color=color, marker=marker, linewidths=0.8, label=name, zorder=3)
    axes.set_title(f"{ride.title}: {ride.end:.1f} s in all")
    figure.legend(*draw.entries_once([axes]), loc="outside right upper", frameon=False, markerscale=1.5)
    return figure


def _draw_motion(axes: Axes, ride: Ride) -> None:
    """The body at the start with its heading, and the direction of motion along what was driven."""
    motion, vehicle = ride.motion, ride.config.vehicle
    start = motion.poses[0]
    if np.isfinite(start).all():
        draw.bodies(axes, start, vehicle, draw.BLACK, "body at the start, heading", linewidths=1.0)
        draw.heading(axes, Pose2(*start.tolist()), vehicle, draw.BLACK)
    steps = np.abs(np.nan_to_num(motion.v[:-1])) * np.diff(motion.times)
    driven = np.append(0.0, np.cumsum(steps))
    if driven[-1] < vehicle.front:  # it has hardly moved
        return
    rows = np.searchsorted(driven, driven[-1] * (np.arange(_ARROWS) + 0.5) / _ARROWS)
    x, y, phi = motion.poses[rows].T
    sign = np.sign(motion.v[rows])
    look: dict[str, Any] = {"color": draw.BLUE, "label": "direction of motion", "zorder": 4}
    look |= {"angles": "xy", "pivot": "mid", "width": 0.004, "scale": 40.0}
    look |= {"headwidth": 5.0, "headlength": 6.0, "headaxislength": 6.0}
    axes.quiver(x, y, sign * np.cos(phi), sign * np.sin(phi), **look)


def show_ride(axes: Axes, ride: Ride) -> None:
    """Show all that was driven, the goals, and along a path the corridor and all obstacles."""
    planned = [] if ride.planned_goal is None else [ride.planned_goal[None]]
    poses = np.concatenate([ride.motion.poses, ride.motion.goals[[0, -1]], *planned])
    points = [body_polygons(poses[np.isfinite(poses).all(axis=1)], ride.config.vehicle).reshape(-1, 2)]
    if ride.path is not None and ride.corridor is not None:
        points += [*draw.boundaries_of(ride.corridor), *draw.path_lines(ride.path), *ride.obstacles]
    draw.show_driven(axes, np.concatenate(points), ride.area)


def _draw_goals(axes: Axes, ride: Ride) -> None:
    goals, vehicle = ride.motion.goals, ride.config.vehicle
    dashed = {"linewidths": 1.5, "linestyles": ["dashed"]}
    if np.isfinite(goals[-1]).all():
        moved = goals[np.flatnonzero((goals[1:] != goals[:-1]).any(axis=1))]
        draw.bodies(axes, moved, vehicle, draw.RED, "goal before it moved", linewidths=0.5)
        draw.bodies(axes, goals[-1], vehicle, draw.RED, "goal", **dashed)
    elif ride.moments and (known := ride.moments[-1].command.goal):  # of a recording: the controller's
        draw.bodies(axes, known.pose, vehicle, draw.RED, "goal setpoint", **dashed)
    if ride.planned_goal is not None:
        look = {"linewidths": 1.2, "linestyles": [(0.0, (2.0, 1.0))]}
        draw.bodies(axes, ride.planned_goal, vehicle, draw.PINK, "planned goal", **look)


def _draw_steps(axes: Axes, ride: Ride) -> None:
    docked = [] if ride.docked_object is None else [ride.docked_object]
    draw.outlines(axes, docked, "docked object", draw.PINK, zorder=1.5)
    ends = [step.end for step in ride.steps if step.end is not None]
    poses = ride.motion.poses[ride.motion.rows_at(ends)]
    label, vehicle = "body at the end of a step", ride.config.vehicle
    draw.bodies(axes, poses, vehicle, draw.GREEN, label, linewidths=1.4, zorder=3)
