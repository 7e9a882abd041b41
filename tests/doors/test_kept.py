"""The directory of compiled kernels is the user's alone; what others can have written is not loaded."""

from __future__ import annotations

import logging
import os
import pickle
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numba.core import config

from geometry import compiled, kept
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


def plant(folder: Path) -> Path:
    """Put a pickle in the place of the kernel, with its checksum; the folder that it would make."""
    (file,) = folder.iterdir()
    made = folder.parent / "made"
    content = pickle.dumps(Planted(made))
    file.write_bytes(sha256(content).digest() + content)
    return made


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
