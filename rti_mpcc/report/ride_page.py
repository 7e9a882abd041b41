"""page.html: every cycle of a ride in one file that opens by a double click, without a network.

The page draws the plane on a canvas and strip charts beside it; a slider, the arrow keys and the address
choose the cycle. Numbers are rounded to what can be seen: a minute of driving takes less than 300 kB.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any

import numpy as np
import shapely

from estimation import GoalEstimate, Judgement
from geometry import Pose2
from geometry.contacts import ACROSS, ALONG, APART, AT_X
from geometry.corridor import space_around
from geometry.free_space import contacts_in
from rti_mpcc.model.footprint import PIECES, body_of, body_polygons
from rti_mpcc.model.layout import PHI
from rti_mpcc.recording.moment import Moment
from rti_mpcc.report import draw
from rti_mpcc.report.page import rendered
from rti_mpcc.report.ride import Ride, Strip, clearance, commanded_jerk, motion_strips
from rti_mpcc.types import Array

SIMPLER, PLAN_SIMPLER = 0.01, 0.04
"""Lines of the surroundings, and plans, are shown with corners left out within this [m]."""
NEAR = 1.5  # half-planes of what is nearer to the body than this are shown [m]
MOST_PLANES = 4
CM, MRAD = 100.0, 1000.0
SIGMAS = 3.0


def ride_page(ride: Ride, summary: dict[str, Any]) -> str:
    """The page of a ride with moments. `summary`: its figures."""
    return rendered(
        "ride.html", ride.title, data=json.dumps(_data(ride), separators=(",", ":")), about=_about(summary)
    )


_Table = dict[Any, tuple[int, Any]]
"""Things that are kept once, with their index, by what tells one from another."""


def _place(table: _Table, thing: Any, key: Any = None) -> int | None:
    """The index of a thing in a table; None for None. `key`: in place of itself."""
    return None if thing is None else table.setdefault(key or thing, (len(table), thing))[0]


def _about(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """The figures above the scene, with their units."""
    found = [("docked", "yes" if summary["docked"] else "no")]
    for key, name, unit in (
        ("time_to_dock_s", "time to dock", "s"),
        ("min_clearance_m", "least clearance", "m"),
        ("distance_m", "distance", "m"),
    ):
        value = summary.get(key)
        found.append((name, "–" if value is None else f"{value:.2f} {unit}"))
    return found


def _data(ride: Ride) -> dict[str, Any]:
    origin = np.round(ride.moments[0].pose[:2]) if np.isfinite(ride.moments[0].pose).all() else np.zeros(2)
    texts, goals, outlines, routes = (_Table() for _ in range(4))
    rows, area = list[dict[str, Any]](), ride.area
    for moment in ride.moments:
        command, told = moment.command, moment.command.diagnostics
        goal = moment.goal
        true_goal = Pose2(*goal.tolist()) if goal is not None and np.isfinite(goal).all() else None
        moving = [_rounded([x - origin[0], y - origin[1], *rest], 2) for x, y, *rest in moment.moving]
        rows.append(
            {
                "status": _place(texts, command.status.value),
                "source": _place(texts, command.source.value),
                "reason": _place(texts, told.reason),
                "route": _place(routes, moment.route, id(moment.route)),
                "target": _place(goals, told.target),
                "setpoint": _place(goals, command.goal and command.goal.pose),
                "goal": _place(goals, true_goal),
                "ellipse": _ellipse(told.goal, origin),
                "obstacles": [_place(outlines, each, id(each)) for each in moment.obstacles],
                "moving": moving,
                "plan": _plan(moment),
                "planes": _half_planes(moment, ride),
            }
        )
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    walls = [] if ride.corridor is None else draw.boundaries_of(ride.corridor)
    poses = np.array([moment.pose for moment in ride.moments])
    return {
        "t": _rounded(ride.times, 3),
        "x": _rounded(poses[:, 0] - origin[0], 3),
        "y": _rounded(poses[:, 1] - origin[1], 3),
        "phi": _rounded(poses[:, 2], 4),
        "delta": _rounded([moment.state.delta for moment in ride.moments], 3),
        **columns,
        "texts": list(texts),
        "outlines": [_points(outline, origin) for _, outline in outlines.values()],
        "routes": [[_line(each, origin) for each in draw.path_lines(route)] for _, route in routes.values()],
        "poses": [_rounded([pose.x - origin[0], pose.y - origin[1], pose.phi], 4) for pose in goals],
        "origin": origin.tolist(),
        "body": _rounded(body_polygons(np.zeros((1, 3)), ride.config.vehicle)[0].ravel(), 3),
        "wheelbase": ride.config.vehicle.wheelbase,
        "area": area
        and {
            "boundary": None if area.boundary is None else _points(area.boundary, origin),
            "obstacles": [_points(each, origin) for each in area.obstacles],
        },
        "walls": [_line(each, origin) for each in walls],
        "docked_object": None if ride.docked_object is None else _points(ride.docked_object, origin),
        "detections": [
            [round(each.stamp, 3), each.accepted, *(_ellipse(each, origin) or ())]
            for each in ride.detections
            if each.pose is not None
        ],
        "colors": {status.value: color for status, color in draw.STATUS_COLORS.items()},
        "strips": _strips(ride),
        "simulated": ride.simulated,
    }


def _strips(ride: Ride) -> list[dict[str, Any]]:
    rows = ride.motion.rows_at(ride.times)
    shown = [(each, each.values[rows]) for each in motion_strips(ride)]
    spent = np.array([moment.command.diagnostics.step_ms for moment in ride.moments])
    of_cycles = commanded_jerk(ride), clearance(ride), Strip("time a cycle [ms]", spent)
    shown += [(each, each.values) for each in of_cycles]
    return [
        {"label": strip.label, "values": _rounded(values, 3), "comfort": strip.comfort, "limit": strip.limit}
        for strip, values in shown
    ]


def _plan(moment: Moment) -> list[int]:
    """x, y [cm] of the plan from the vehicle on, each from the one before, and its last heading [mrad]."""
    states = moment.command.trajectory.states
    if not np.isfinite(moment.pose).all():
        return []
    line = shapely.simplify(shapely.linestrings(states[:, :PHI] - moment.pose[:PHI]), PLAN_SIMPLER)
    steps = np.diff(np.round(CM * shapely.get_coordinates(line)).astype(int), axis=0, prepend=0)
    return [*steps.ravel().tolist(), round(MRAD * float(states[-1, PHI]))]


def _half_planes(moment: Moment, ride: Ride) -> list[list[int]]:
    """The nearest half-planes of the body's pieces, in its frame: a point of the edge [cm], 100 normals."""
    if moment.corridor is None or not np.isfinite(moment.pose).all():
        return []
    body, part = body_of(ride.config.vehicle, PIECES), moment.command.diagnostics.part
    space = space_around(moment.corridor, part)
    contacts = contacts_in(space, body, np.array(moment.pose[None]), within=NEAR, outward=0.0)[0]
    apart, normal = contacts[..., APART].ravel(), contacts[..., ALONG : ACROSS + 1].reshape(-1, 2)
    edge = contacts[..., AT_X:].reshape(-1, 2) - normal * np.where(np.isfinite(apart), apart, 0.0)[:, None]
    nearest = [k for k in np.argsort(apart)[:MOST_PLANES] if np.isfinite(apart[k])]
    return [[round(CM * float(value)) for value in (*edge[k], *normal[k])] for k in nearest]


def _ellipse(goal: GoalEstimate | Judgement | None, origin: Array) -> list[float | None] | None:
    """Of the goal, by all detections or by one: centre, half axes at three sigma [m] and angle [rad]."""
    if goal is None or goal.pose is None or goal.covariance is None:
        return None
    values, vectors = np.linalg.eigh(goal.covariance[:2, :2])
    half = SIGMAS * np.sqrt(np.maximum(values, 0.0))
    angle = float(np.arctan2(vectors[1, 1], vectors[0, 1]))
    return _rounded([goal.pose.x - origin[0], goal.pose.y - origin[1], half[1], half[0], angle], 3)


def _line(line: Array, origin: Array) -> list[float | None]:
    return _points(shapely.get_coordinates(shapely.simplify(shapely.linestrings(line), SIMPLER)), origin)


def _points(points: Array, origin: Array) -> list[float | None]:
    return _rounded((np.asarray(points) - origin).ravel(), 2)


def _rounded(values: Iterable[float | None], digits: int) -> list[float | None]:
    """Rounded numbers, whole ones without a point; None: not finite."""
    found: list[float | None] = []
    for value in values:
        near = round(float(value), digits) if value is not None and np.isfinite(value) else None
        found.append(int(near) if near is not None and near == int(near) else near)
    return found
