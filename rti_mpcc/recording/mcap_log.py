"""Cycles as an MCAP file for Foxglove and Rerun: poses, plan, goal, surroundings, reasons, diagnostics.

Topics: /tf, /plan, /goal, /detections, /body (corners of the body; Rerun draws no SceneUpdate), /scene, /log,
and /diagnostics as JSON. The settings are an attachment. Foxglove: docs/foxglove-layout.json.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterable
from importlib import import_module
from math import cos, isfinite, sin
from os import PathLike
from types import SimpleNamespace
from typing import Any, Self

import numpy as np

from geometry import Area, ReferencePath
from geometry.errors import check_extra
from rti_mpcc.config import ControllerConfig
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.recording.moment import Moment, moment_of, widened, wrapped
from rti_mpcc.types import Array, Command, Status, VehicleState

_log = logging.getLogger(__name__)

WORLD, VEHICLE = "world", "rear_axle"
PLAN_STEP = 7  # stages of a plan from one pose of /plan to the next
MOST_TIME = 2**63 - 1
RED, BLUE, ORANGE, GREY = (0.84, 0.37, 0.0), (0.0, 0.45, 0.7), (0.9, 0.62, 0.0), (0.55, 0.55, 0.55)
_LEVELS = {
    **dict.fromkeys((Status.FAILED, Status.STALLED, Status.GOAL_REJECTED, Status.GOAL_BEHIND), "ERROR"),
    **dict.fromkeys((Status.BLOCKED, Status.GOAL_LOST, Status.SEARCHING), "WARNING"),
}
"""Levels of /log, of other statuses INFO."""
_MESSAGES = (
    *("FrameTransform", "Log", "PackedElementField", "PointCloud"),
    *("PoseInFrame", "PosesInFrame", "SceneUpdate"),
)
_JSON_SCHEMA = b'{"type":"object"}'
_UNTURNED = {"orientation": {"w": 1.0}}
_TOLD = ("time_to_go", "disturbance", "steering_offset", "slack", "iterations", "step_ms", "feedback_ms")
"""Diagnostics that keep their names in /diagnostics."""


def mcap_libraries() -> SimpleNamespace:
    """The writer and the message types; loaded at the first call. Raises MissingExtraError without them."""
    check_extra("mcap", "an MCAP file needs", "mcap", "mcap_protobuf", "foxglove_schemas_protobuf")
    import foxglove_schemas_protobuf as schemas
    from mcap.writer import Writer
    from mcap_protobuf.schema import register_schema

    modules = {name: import_module(f"{schemas.__name__}.{name}_pb2") for name in _MESSAGES}
    messages = {name: getattr(module, name) for name, module in modules.items()}
    return SimpleNamespace(Writer=Writer, register_schema=register_schema, **messages)


class McapLog:
    """Writes cycles of a controller or a mission to an MCAP file.

        with McapLog("ride.mcap") as log:
            command = controller.step(state, now=now)
            log.write(controller, state, command, now)

    Writing never stops the vehicle: if it fails, `problem` says why, and nothing more is written.

    Raises MissingExtraError without the extra `mcap`, OSError if the file cannot be made.
    """

    def __init__(self, file: str | PathLike[str]) -> None:
        self._types = mcap_libraries()
        self._stream: Any = open(file, "wb")  # noqa: SIM115
        self._writer = self._types.Writer(self._stream)
        self._writer.start(profile="", library="rti-mpcc")
        self._channels: dict[str, int] = {}
        self._shown: dict[str, Any] = {}  # what /scene and /log told last
        self._sequence, self.problem = 0, ""

    def write(self, controller: object, state: VehicleState, command: Command, now: float) -> None:
        """Write the cycle at `now` [s] that the controller has just made. Never raises for what it writes."""
        if not self.problem:
            config = wrapped(controller)[-1].config
            self.write_moment(moment_of(controller, state, command, now), config)

    def write_moment(self, moment: Moment, config: ControllerConfig) -> None:
        """Write a cycle of a ride; `config`: of its controller."""
        if self.problem:
            return
        try:
            self._write(moment, config)
        except Exception as error:
            self.problem = " ".join(str(error).split()) or type(error).__name__
            _log.error("the MCAP file has ended, it cannot be written: %s", self.problem)

    def close(self) -> None:
        """Write the index, without which some readers are slow. Raises OSError."""
        if self._stream.closed:
            return
        try:
            self._writer.finish()
        except Exception:
            if not self.problem:
                raise
        finally:
            self._stream.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- one cycle ------------------------------------------------------------------------------------

    def _write(self, moment: Moment, config: ControllerConfig) -> None:
        stamp = min(max(round(1e9 * moment.time), 0), MOST_TIME) if isfinite(moment.time) else 0
        if self._sequence == 0:
            data = config.model_dump_json(indent=2).encode()
            self._writer.add_attachment(stamp, stamp, "config.json", "application/json", data)
        self._sequence += 1
        types, command = self._types, moment.command
        x, y, phi = moment.pose.tolist()
        if isfinite(x + y + phi):
            moved = {"translation": {"x": x, "y": y}, "rotation": _turned(phi)}
            transform = types.FrameTransform(parent_frame_id=WORLD, child_frame_id=VEHICLE, **moved)
            self._send("/tf", transform, stamp)
            self._send("/body", self._cloud(body_polygons(moment.pose[None], config.vehicle)[0]), stamp)
        self._send_poses("/plan", command.trajectory.states[::PLAN_STEP, :3].tolist(), stamp)
        if command.goal is not None:
            pose = command.goal.pose
            goal = types.PoseInFrame(frame_id=WORLD, pose=_placed(pose.x, pose.y, pose.phi))
            self._send("/goal", goal, stamp)
        found = [each.pose for each in command.diagnostics.detections if each.pose is not None]
        if found:
            self._send_poses("/detections", [(pose.x, pose.y, pose.phi) for pose in found], stamp)
        self._scene(moment, config, stamp)
        self._say(moment, stamp)
        self._diagnose(moment, stamp)

    def _cloud(self, corners: Array) -> Any:
        """Corners (k, 2) [m] as a cloud of points on the ground."""
        number = self._types.PackedElementField.FLOAT32
        fields = [{"name": name, "offset": 4 * place, "type": number} for place, name in enumerate("xyz")]
        points = np.zeros((len(corners), 3), "<f4")
        points[:, :2] = corners
        return self._types.PointCloud(
            frame_id=WORLD, point_stride=12, pose=_UNTURNED, fields=fields, data=points.tobytes()
        )

    def _scene(self, moment: Moment, config: ControllerConfig, stamp: int) -> None:
        """The body in each cycle; surroundings, route and obstacles where they have changed."""
        scene = self._types.SceneUpdate()
        if not self._shown.get("body"):
            self._shown["body"] = True
            corners = body_polygons(np.zeros((1, 3)), config.vehicle)[0]
            _add_lines(scene, "body", _closed([corners]), BLUE, stamp, VEHICLE)
        corridor, route = moment.corridor, moment.route
        area = None if corridor is None else corridor.area
        walls = () if corridor is None or area is not None else corridor.walls
        boundaries = (line for each in walls for line in (*each.left, *each.right))
        parts: list[tuple[str, object, tuple[float, float, float], Callable[[], list[Array]]]] = [
            ("area", area, GREY, lambda: _rings(area)),
            # Obstacles make the tuple of a corridor's walls anew, not the walls.
            ("corridor", walls[0] if walls else None, GREY, lambda: list(boundaries)),
            ("route", route, ORANGE, lambda: _route(route)),
            ("obstacles", moment.obstacles, RED, lambda: _closed(widened(moment.obstacles))),
        ]
        for name, key, color, lines in parts:
            if self._shown.get(name) is key:
                continue
            self._shown[name] = key
            if drawn := lines():
                _add_lines(scene, name, drawn, color, stamp)
            else:
                scene.deletions.add(id=name).timestamp.FromNanoseconds(stamp)
        if scene.entities or scene.deletions:
            self._send("/scene", scene, stamp)

    def _say(self, moment: Moment, stamp: int) -> None:
        """Status and reason, where they have changed."""
        command = moment.command
        text = f"{command.status.value}: {command.diagnostics.reason}"
        if self._shown.get("said") == text:
            return
        self._shown["said"] = text
        level = _LEVELS.get(command.status, "INFO")
        self._send("/log", self._types.Log(level=level, message=text, name="rti_mpcc"), stamp)

    def _diagnose(self, moment: Moment, stamp: int) -> None:
        command, state, told = moment.command, moment.state, moment.command.diagnostics
        figures = {
            "speed": state.v,
            "steering": state.delta,
            "acceleration_commanded": command.acceleration,
            "steering_rate_commanded": command.steering_rate,
            "speed_setpoint": command.speed,
            "steering_setpoint": command.steering,
            "progress": told.theta,
            **{name: getattr(told, name) for name in _TOLD},
            "status": command.status.value,
            "source": command.source.value,
            "docked": command.docked,
            "hold": command.hold,
        }
        finite = {name: None if value != value else value for name, value in figures.items()}
        if "/diagnostics" not in self._channels:
            schema = self._writer.register_schema("rti_mpcc.Diagnostics", "jsonschema", _JSON_SCHEMA)
            self._channels["/diagnostics"] = self._writer.register_channel("/diagnostics", "json", schema)
        self._add("/diagnostics", json.dumps(finite).encode(), stamp)

    # -- messages -------------------------------------------------------------------------------------

    def _send_poses(self, topic: str, poses: Iterable[Iterable[float]], stamp: int) -> None:
        placed = [_placed(*pose) for pose in poses]
        self._send(topic, self._types.PosesInFrame(frame_id=WORLD, poses=placed), stamp)

    def _send(self, topic: str, message: Any, stamp: int) -> None:
        if topic != "/scene":  # its entities have a time each
            message.timestamp.FromNanoseconds(stamp)
        if topic not in self._channels:
            schema = self._types.register_schema(self._writer, type(message))
            self._channels[topic] = self._writer.register_channel(topic, "protobuf", schema)
        self._add(topic, message.SerializeToString(), stamp)

    def _add(self, topic: str, data: bytes, stamp: int) -> None:
        self._writer.add_message(self._channels[topic], stamp, data, stamp, self._sequence)


def _turned(heading: float) -> dict[str, float]:
    return {"z": sin(0.5 * heading), "w": cos(0.5 * heading)}


def _placed(x: float, y: float, heading: float) -> dict[str, Any]:
    return {"position": {"x": x, "y": y}, "orientation": _turned(heading)}


def _add_lines(
    scene: Any, name: str, lines: Iterable[Array], color: Any, stamp: int, frame: str = WORLD
) -> None:
    """An entity of polylines (k, 2) [m] in a frame; that of the vehicle moves with it."""
    entity = scene.entities.add(id=name, frame_id=frame, frame_locked=frame == VEHICLE)
    entity.timestamp.FromNanoseconds(stamp)
    look = {"thickness": 0.04, "pose": _UNTURNED, "color": dict(zip("rgba", (*color, 1.0), strict=True))}
    for line in lines:
        entity.lines.add(points=[{"x": x, "y": y} for x, y in np.asarray(line).tolist()], **look)


def _rings(area: Area | None) -> list[Array]:
    if area is None:
        return []
    return _closed([*([] if area.boundary is None else [area.boundary]), *area.obstacles])


def _route(route: ReferencePath | None) -> list[Array]:
    return [] if route is None else [np.stack([at.x, at.y], axis=-1) for at in route.sample(0.3)]


def _closed(rings: Iterable[Array]) -> list[Array]:
    return [np.concatenate([ring, ring[:1]]) for ring in rings]
