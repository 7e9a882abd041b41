"""An MCAP file holds each cycle, as a reader of its own finds it, and never stops the vehicle."""

from __future__ import annotations

import json
import sys
from math import atan2
from pathlib import Path
from typing import Any

import mcap.decoder
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from rti_mpcc import Command, MissingExtraError, VehicleState
from rti_mpcc.recording import McapLog
from rti_mpcc.simulation import docking_controller
from tests.rti_mpcc.recording.recordings import SCENARIO

CYCLES = 12


class Json(mcap.decoder.DecoderFactory):
    def decoder_for(self, message_encoding: str, _: object) -> Any:
        return json.loads if message_encoding == "json" else None


class Log:
    """What a reader finds: messages and their times [ns] by topic, attachments."""

    def __init__(self, file: Path) -> None:
        self.topics: dict[str, list[Any]] = {}
        self.stamps: dict[str, list[int]] = {}
        with file.open("rb") as stream:
            reader = make_reader(stream, decoder_factories=[DecoderFactory(), Json()])
            for _, channel, message, decoded in reader.iter_decoded_messages():
                self.stamps.setdefault(channel.topic, []).append(message.log_time)
                self.topics.setdefault(channel.topic, []).append(decoded)
            self.attachments = {each.name: each.data for each in reader.iter_attachments()}


def heading(quaternion: Any) -> float:
    return 2.0 * atan2(quaternion.z, quaternion.w)


Written = tuple[Log, list[tuple[VehicleState, Command]]]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """A wall comes in the middle."""
    file = tmp_path_factory.mktemp("mcap") / "ride.mcap"
    controller, made = docking_controller(SCENARIO), []
    with McapLog(file) as log:
        for k in range(CYCLES):
            state = VehicleState(x=0.01 * k, y=0.0, phi=0.1, v=0.2, delta=0.0)
            wall = [[[-9.0, 8.0], [-8.0, 8.0], [-8.0, 9.0]]] if k >= 6 else []
            command = controller.step(state, now=1.0 + 0.05 * k, obstacles=wall)
            log.write(controller, state, command, 1.0 + 0.05 * k)
            made.append((state, command))
    assert log.problem == ""
    return Log(file), made


def test_each_cycle_has_its_pose_its_plan_and_its_figures(written: Written) -> None:
    log, made = written
    assert log.stamps["/tf"] == [round(1e9 * (1.0 + 0.05 * k)) for k in range(CYCLES)]
    for k, (state, command) in enumerate(made):
        transform, plan, told = (log.topics[name][k] for name in ("/tf", "/plan", "/diagnostics"))
        assert (transform.parent_frame_id, transform.child_frame_id) == ("world", "rear_axle")
        assert (transform.translation.x, transform.translation.y) == (state.x, state.y)
        assert heading(transform.rotation) == pytest.approx(state.phi)
        assert transform.timestamp.seconds == 1
        first, last = command.trajectory.states[[0, -1]]
        assert (plan.poses[0].position.x, plan.poses[0].position.y) == (first[0], first[1])
        assert (plan.poses[-1].position.x, plan.poses[-1].position.y) == (last[0], last[1])
        assert told["acceleration_commanded"] == command.acceleration
        assert told["status"] == command.status.value
        assert len(log.topics["/body"][k].data) == 4 * 3 * 4


def test_the_surroundings_are_told_where_they_change(written: Written) -> None:
    log, _ = written
    first, second = log.topics["/scene"]
    assert {"body", "corridor", "route"} <= {entity.id for entity in first.entities}
    assert [entity.id for entity in second.entities] == ["obstacles"]
    (line,) = second.entities[0].lines
    assert [(point.x, point.y) for point in line.points] == [
        (-9.0, 8.0),
        (-8.0, 8.0),
        (-8.0, 9.0),
        (-9.0, 8.0),
    ]
    assert log.stamps["/scene"] == [log.stamps["/tf"][0], log.stamps["/tf"][6]]


def test_reasons_are_a_log_and_the_settings_an_attachment(written: Written) -> None:
    log, made = written
    assert log.topics["/log"][0].message.startswith(made[0][1].status.value)
    assert json.loads(log.attachments["config.json"])["cycle"] == 0.05


def test_odd_numbers_are_written_or_left_out(tmp_path: Path) -> None:
    controller = docking_controller(SCENARIO)
    nowhere = VehicleState(float("nan"), 0.0, 0.0, float("nan"), 0.0)
    with McapLog(tmp_path / "odd.mcap") as log:
        for now in (float("nan"), -1.0, 0.1):
            log.write(controller, nowhere, controller.step(nowhere, now=now), now)
    assert log.problem == ""
    found = Log(tmp_path / "odd.mcap")
    assert "/tf" not in found.topics
    assert [each["speed"] for each in found.topics["/diagnostics"]] == [None] * 3


def test_a_file_that_cannot_be_written_never_raises(tmp_path: Path) -> None:
    controller = docking_controller(SCENARIO)
    state = VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0)
    command = controller.step(state, now=0.0)
    log = McapLog(tmp_path / "full.mcap")
    log.write(controller, state, None, 0.0)  # type: ignore[arg-type]
    assert log.problem
    log.write(controller, state, command, 0.1)
    log.close()
    log.close()
    with pytest.raises(OSError, match="No such file"):
        McapLog(tmp_path / "nowhere" / "ride.mcap")


def test_without_the_extra_it_says_which(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mcap", None)
    with pytest.raises(
        MissingExtraError, match=r"^an MCAP file needs mcap, which is not installed: pip install '\.\[mcap\]'"
    ):
        McapLog(tmp_path / "ride.mcap")
    assert not (tmp_path / "ride.mcap").exists()
