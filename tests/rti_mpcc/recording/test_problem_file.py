"""QPs of failed cycles in files of their own."""

from __future__ import annotations

import logging
import shutil
from pathlib import Path

import numpy as np
import osqp
import pytest

from rti_mpcc.config import ControllerConfig, SolverSettings
from rti_mpcc.errors import RecordingError
from rti_mpcc.iteration import Solution
from rti_mpcc.planning import search
from rti_mpcc.recording import Recorder, load_problem, read_recording, replay
from rti_mpcc.simulation import docking_controller
from rti_mpcc.types import Reason
from tests.rti_mpcc.recording.recordings import FAILED, SCENARIO, drive, eventful, record

CYCLES = FAILED.stop
FILES = [f"qp_{cycle:06d}.npz" for cycle in FAILED]


def names(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a recording and the QPs of its failed cycles."""
    folder = tmp_path_factory.mktemp("failed")
    record(folder / "run.jsonl", CYCLES, eventful, dump_failed=folder / "qp")
    return folder


def test_the_qps_of_failed_cycles_are_written(run: Path) -> None:
    assert names(run / "qp") == FILES


def test_a_qp_comes_back_as_it_was(run: Path, tmp_path: Path) -> None:
    controller = docking_controller(SCENARIO)
    with Recorder(controller, tmp_path / "run.jsonl") as recorder:
        drive(recorder, range(CYCLES), eventful)
    problem, loaded = controller.problem(), load_problem(run / "qp" / FILES[-1])
    for name in ("gradient", "lower", "upper", "primal", "dual"):
        np.testing.assert_array_equal(getattr(loaded, name), getattr(problem, name))
    for name in ("cost", "constraints"):
        one, other = getattr(loaded, name), getattr(problem, name)
        assert one.shape == other.shape
        for item in ("data", "indices", "indptr"):
            np.testing.assert_array_equal(getattr(one, item), getattr(other, item))


def test_it_says_where_it_is_from(run: Path) -> None:
    command = read_recording(run / "run.jsonl").cycles[FAILED[0]].command
    assert command is not None
    with np.load(run / "qp" / FILES[0]) as content:
        assert int(content["cycle"]) == FAILED[0]
        assert str(content["status"]) == command.diagnostics.solver_status == "forced to fail"
        settings = SolverSettings.model_validate_json(str(content["settings"]))
    assert settings == SCENARIO.controller_config().solver


def test_osqp_solves_it_off_line(run: Path) -> None:
    problem = load_problem(run / "qp" / FILES[0])
    solver = osqp.OSQP()
    solver.setup(
        P=problem.cost,
        q=problem.gradient,
        A=problem.constraints,
        l=problem.lower,
        u=problem.upper,
        scaling=0,
        check_dualgap=False,
        verbose=False,
    )
    solver.warm_start(x=problem.primal, y=problem.dual)
    result = solver.solve(raise_error=False)
    assert result.info.status == "solved"
    row = problem.constraints @ result.x
    assert (row >= problem.lower - 1e-2).all()
    assert (row <= problem.upper + 1e-2).all()


def test_a_replay_writes_them_again(run: Path, tmp_path: Path) -> None:
    assert replay(run / "run.jsonl", dump_failed=tmp_path / "again").identical
    assert names(tmp_path / "again") == FILES
    for name in FILES:
        one, other = load_problem(run / "qp" / name), load_problem(tmp_path / "again" / name)
        np.testing.assert_array_equal(one.constraints.data, other.constraints.data)
        np.testing.assert_array_equal(one.dual, other.dual)


def test_a_folder_that_is_gone_does_not_stop_the_drive(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    folder = tmp_path / "qp"
    with (
        caplog.at_level(logging.ERROR),
        Recorder(docking_controller(SCENARIO), tmp_path / "run.jsonl", dump_failed=folder) as recorder,
    ):
        shutil.rmtree(folder)
        assert len(drive(recorder, range(CYCLES), eventful)) == CYCLES
    assert [message.split(":")[0] for message in caplog.messages] == [
        f"the QP of cycle {cycle} was not written" for cycle in FAILED
    ]


def test_a_mistake_of_the_program_leaves_no_qp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def mistaken(solution: Solution, config: ControllerConfig) -> str:
        raise KeyError("after the QP was solved")

    monkeypatch.setattr(search, "rejection_reason", mistaken)
    with Recorder(
        docking_controller(SCENARIO), tmp_path / "run.jsonl", dump_failed=tmp_path / "qp"
    ) as recorder:
        (command,) = drive(recorder, range(1))
    assert command.diagnostics.cause is Reason.MISTAKE
    assert command.diagnostics.failed
    assert names(tmp_path / "qp") == []


def test_other_files_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "file.npz"
    with pytest.raises(RecordingError, match=r"file\.npz: cannot be read, No such file"):
        load_problem(file)
    with pytest.raises(RecordingError, match="cannot be read, Is a directory"):
        load_problem(tmp_path)
    for content in (b"", b"words", b"PK\x03\x04 but no archive"):
        file.write_bytes(content)
        with pytest.raises(RecordingError, match=r"file\.npz: is not a QP of rti-mpcc"):
            load_problem(file)
    np.savez(file, q=np.zeros(3))
    with pytest.raises(RecordingError, match=r"file\.npz: is not a QP of rti-mpcc"):
        load_problem(file)
    np.save(tmp_path / "array.npy", np.zeros(3))
    with pytest.raises(RecordingError, match=r"array\.npy: is not a QP of rti-mpcc"):
        load_problem(tmp_path / "array.npy")
