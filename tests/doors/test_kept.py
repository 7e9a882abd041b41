"""The directory of compiled kernels is the user's alone; what others can have written is not loaded."""

from __future__ import annotations

import errno
import logging
import os
import pickle
import stat
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from numba.core import config

from geometry import compiled, kept
from rti_mpcc.cli import main
from rti_mpcc.kernels import make_ready

SOURCE = """
from __future__ import annotations
from geometry.compiled import Array1, kernel

@kernel
def doubled(values: Array1) -> float:
    return 2.0 * values[0]
"""
pytestmark = [
    pytest.mark.skipif(config.DISABLE_JIT, reason="there is nothing compiled"),
    pytest.mark.skipif(not hasattr(os, "geteuid"), reason="there are no owners"),
]


class Planted:
    """What makes a folder when it is unpickled."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[Callable[[str], None], tuple[str]]:
        return os.mkdir, (str(self.folder),)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where kernels are kept, not made yet."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(kept, "_TOLD", set())
    return tmp_path / "rti-mpcc"


@pytest.fixture
def declared(monkeypatch: pytest.MonkeyPatch) -> Callable[[], float]:
    """Declare the only kernel anew, as a new process does, and call it with 3."""

    def value() -> float:
        monkeypatch.setattr(compiled, "_KERNELS", [])
        module = ModuleType("declared")
        exec(SOURCE, module.__dict__)
        make_ready()
        return float(module.doubled(np.array([3.0])))

    return value


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def plant(folder: Path) -> Path:
    """Put a pickle in the place of the kernel, with its checksum; the folder that it would make."""
    (file,) = folder.iterdir()
    made = folder.parent / "made"
    content = pickle.dumps(Planted(made))
    file.write_bytes(sha256(content).digest() + content)
    return made


def test_the_directory_and_its_files_are_closed_to_others(
    folder: Path, declared: Callable[[], float]
) -> None:
    before = os.umask(0)
    try:
        assert declared() == 6.0
    finally:
        os.umask(before)
    (file,) = folder.iterdir()
    assert (mode(folder), mode(file)) == (0o700, 0o600)


def test_a_directory_that_others_could_read_is_closed_and_used(
    folder: Path, declared: Callable[[], float], caplog: pytest.LogCaptureFixture
) -> None:
    folder.mkdir(mode=0o755)
    folder.chmod(0o755)
    assert declared() == 6.0
    assert mode(folder) == 0o700
    assert len(list(folder.iterdir())) == 1
    assert compiled.not_kept() == ""


@pytest.mark.parametrize("others", [0o777, 0o770, 0o702])
def test_what_others_may_write_is_not_loaded_and_nothing_is_kept(
    folder: Path, declared: Callable[[], float], caplog: pytest.LogCaptureFixture, others: int
) -> None:
    declared()
    made = plant(folder)
    folder.chmod(others)
    content = [file.read_bytes() for file in folder.iterdir()]
    with caplog.at_level(logging.INFO):
        assert declared() == 6.0
    assert not made.exists()
    assert [file.read_bytes() for file in folder.iterdir()] == content
    assert caplog.messages.count(f"compiled kernels are not kept: others may write to {folder}") == 1
    assert not [message for message in caplog.messages if "kept in" in message]


@pytest.mark.parametrize("what", ["directory", "file"])
def test_what_belongs_to_somebody_else_is_not_loaded(
    folder: Path,
    declared: Callable[[], float],
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
    what: str,
) -> None:
    declared()
    made = plant(folder)
    (file,) = folder.iterdir()
    other = os.geteuid() + 1
    wrong = {"directory": folder, "file": file}[what]
    real = os.fstat if what == "file" else os.stat

    def owned(path: Any, *given: Any, **options: Any) -> os.stat_result:
        found = real(path, *given, **options)
        if (found.st_ino, found.st_dev) != (inode.st_ino, inode.st_dev):
            return found
        return os.stat_result((*found[:4], other, *found[5:]))

    inode = os.stat(wrong)
    monkeypatch.setattr(os, "fstat" if what == "file" else "stat", owned)
    with caplog.at_level(logging.WARNING):
        assert declared() == 6.0
    assert not made.exists()
    assert f"compiled kernels are not kept: {wrong} belongs to another user" in caplog.messages


def test_a_file_that_others_may_write_is_not_loaded(folder: Path, declared: Callable[[], float]) -> None:
    declared()
    made = plant(folder)
    (file,) = folder.iterdir()
    file.chmod(0o666)
    assert declared() == 6.0
    assert not made.exists()
    assert mode(file) == 0o600  # written anew
    assert compiled.not_kept() == ""


@pytest.fixture
def full(monkeypatch: pytest.MonkeyPatch) -> None:
    """No file can be put into its place: the disk is full."""

    def replace(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "replace", replace)


def test_what_is_not_kept_is_not_said_to_be(
    folder: Path, declared: Callable[[], float], full: None, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        assert declared() == 6.0
    assert not list(folder.iterdir())
    assert not [message for message in caplog.messages if "kept in" in message]
    (said,) = [message for message in caplog.messages if message.startswith("the compiled kernels are not")]
    assert "No space left on device" in said


@pytest.mark.usefixtures("full", "folder")
def test_the_command_says_that_nothing_is_kept(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(compiled, "_KERNELS", [])
    exec(SOURCE, ModuleType("declared").__dict__)
    for said in ("compiled 1 kernels", "all kernels are ready"):
        assert main(["warm"]) == 0
        assert capsys.readouterr().out.startswith(f"{said}, but they are not kept: ")
