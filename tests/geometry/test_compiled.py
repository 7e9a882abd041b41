"""Compiled kernels: signatures, and a directory of them that costs time at most whatever is wrong with it."""

from __future__ import annotations

import importlib.util
import logging
import os
import re
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, get_type_hints

import numpy as np
import pytest
from numba import config

from geometry import compiled
from geometry.arrays import Array
from rti_mpcc.cli import main
from rti_mpcc.kernels import make_ready
from tests.lists import acceptance

SOURCE = """
from __future__ import annotations
from geometry.compiled import Array2, Out2, inner, kernel

@inner
def times(x: float, y: float) -> float:
    return x * y

@kernel
def scaled(values: Array2, by: float, count: int, out: Out2) -> float:
    for i in range(count):
        for j in range(values.shape[1]):
            out[i, j] = 2.0 * times(values[i, j], by)
    return by
"""
ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif(config.DISABLE_JIT, reason="there is nothing compiled")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where kernels are kept, nothing yet."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "declared.py").write_text(SOURCE, encoding="utf-8")
    return tmp_path / "cache" / "rti-mpcc"


@pytest.fixture
def declared(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], ModuleType]:
    """Declares the only kernel anew, as a process has it that was just started."""

    def module() -> ModuleType:
        monkeypatch.setattr(compiled, "_KERNELS", [])
        spec = importlib.util.spec_from_file_location("declared", tmp_path / "declared.py")
        assert spec is not None
        assert spec.loader is not None
        found = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(found)
        return found

    return module


def value(module: ModuleType) -> float:
    """3 * 5 * 2, by the kernel."""
    out = np.zeros((1, 1))
    module.scaled(np.full((1, 1), 3.0), 5.0, 1, out)
    return float(out[0, 0])


def test_a_kernel_is_built_once_and_loaded_from_then_on(declared: Callable[[], ModuleType]) -> None:
    module = declared()
    assert compiled.load() == 1
    assert list(compiled.build()) == ["declared.scaled"]
    assert compiled.load() == 0
    assert value(module) == 30.0
    module = declared()
    assert compiled.load() == 0
    assert not list(compiled.build())
    assert value(module) == 30.0
    assert module.scaled.stats.cache_hits
    assert compiled.not_kept() == ""


def test_what_a_second_process_has_compiled_is_loaded(
    declared: Callable[[], ModuleType], tmp_path: Path
) -> None:
    module = declared()
    assert compiled.load() == 1
    helps = "import declared; from geometry import compiled; list(compiled.build(backwards=True))"
    paths = {"PYTHONPATH": os.pathsep.join((str(ROOT), str(tmp_path)))}
    with subprocess.Popen([sys.executable, "-c", helps], env={**os.environ, **paths}) as helper:
        while compiled.load():  # it begins with the last kernel
            assert helper.poll() is None
            time.sleep(0.1)
        helper.terminate()
    assert value(module) == 30.0
    assert not list(compiled.build())


def test_compiling_is_told_once(
    folder: Path, declared: Callable[[], ModuleType], caplog: pytest.LogCaptureFixture
) -> None:
    declared()
    with caplog.at_level(logging.INFO, logger="rti_mpcc"):
        assert make_ready() == 1
        assert make_ready() == 0
    told, then = caplog.messages
    assert told.startswith("compiling 1 kernels, ")
    assert then == f"the compiled kernels are kept in {compiled.directory()}"


class Terminal(StringIO):
    def isatty(self) -> bool:
        return True


def test_on_a_terminal_a_count_shows_how_far_it_is(declared: Callable[[], ModuleType]) -> None:
    declared()
    with redirect_stderr(Terminal()) as terminal:
        assert make_ready() == 1
    (shown,) = terminal.getvalue().split("\r")[1:]
    assert shown.rstrip() == "compiled 1 of 1 kernels: declared.scaled"
    assert shown.endswith("\n")


def test_a_kernel_that_nobody_built_is_built_where_it_is_called(declared: Callable[[], ModuleType]) -> None:
    closed, out = np.ones((2, 3)), np.zeros((2, 3))
    closed.setflags(write=False)
    module = declared()
    assert module.scaled(closed, 4, 2, out) == 4.0
    assert (out == 8.0).all()
    assert compiled.load() == 0
    with pytest.raises(TypeError):
        module.scaled(out, 4, 2, closed)


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize(
    "values",
    [np.ones((3, 4))[:, ::2], np.ones(3), np.ones((3, 2), dtype=np.int64), [[1.0, 2.0]]],
    ids=["strided", "one axis", "whole numbers", "a list"],
)
def test_other_arguments_than_declared_are_refused(
    declared: Callable[[], ModuleType], values: Array, first: bool
) -> None:
    module = declared()
    if not first:
        value(module)
    with pytest.raises(TypeError):
        module.scaled(values, 1.0, 1, np.zeros((3, 2)))
    assert value(module) == 30.0


@pytest.mark.parametrize("damaged", ["*.nbi", "*.nbc"])
@pytest.mark.parametrize("left", [0, 0.5])
def test_a_damaged_file_is_compiled_again(
    folder: Path, declared: Callable[[], ModuleType], damaged: str, left: float
) -> None:
    value(declared())
    (file,) = folder.rglob(damaged)
    whole = file.read_bytes()
    file.write_bytes(whole[: int(left * len(whole))])
    assert value(declared()) == 30.0
    module = declared()
    assert value(module) == 30.0
    assert module.scaled.stats.cache_hits  # it was repaired


@pytest.mark.parametrize("place", ["", "/rti-mpcc"])
def test_a_directory_that_cannot_be_made_costs_the_time_to_compile(
    folder: Path, declared: Callable[[], ModuleType], place: str, caplog: pytest.LogCaptureFixture
) -> None:
    file = Path(f"{folder.parent}{place}")
    file.parent.mkdir(exist_ok=True)
    file.write_text("in the way", encoding="utf-8")
    module = declared()
    with caplog.at_level(logging.INFO):
        assert make_ready() == 1
    assert value(module) == 30.0
    (said,) = [each for each in caplog.messages if "kept" in each]
    assert said.startswith("compiled kernels are not kept: ")


def test_the_command_says_whether_kernels_are_kept(
    folder: Path, declared: Callable[[], ModuleType], capsys: pytest.CaptureFixture[str]
) -> None:
    declared()
    for said in ("compiled 1 kernels", "all kernels are ready"):
        assert main(["warm"]) == 0
        assert capsys.readouterr().out.startswith(f"{said}, kept in {folder}")
    folder.chmod(0o777)
    declared()
    assert main(["warm"]) == 0
    assert capsys.readouterr().out == (
        f"all kernels are ready, but they are not kept: others may write to {folder}\n"
    )


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="there are no owners")
def test_the_directory_is_the_users_alone(
    folder: Path, declared: Callable[[], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder.mkdir(parents=True)
    folder.chmod(0o755)
    assert value(declared()) == 30.0
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    before = [(file, file.read_bytes()) for file in sorted(folder.rglob("*.nb?"))]
    for others in (0o777, 0o770, 0o702):
        folder.chmod(others)
        module = declared()
        assert value(module) == 30.0
        assert not module.scaled.stats.cache_hits
        assert compiled.not_kept() == f"others may write to {folder}"
    folder.chmod(0o700)
    monkeypatch.setattr(os, "geteuid", lambda: folder.stat().st_uid + 1)
    assert value(declared()) == 30.0
    assert compiled.not_kept() == f"{folder} belongs to another user"
    assert [(file, file.read_bytes()) for file in sorted(folder.rglob("*.nb?"))] == before


def test_the_directory_is_the_one_for_such_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert compiled.user_directory() == tmp_path / "numba" / "rti-mpcc"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert compiled.user_directory() == tmp_path / "cache" / "rti-mpcc"
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert compiled.user_directory() == tmp_path / "local" / "rti-mpcc"


def test_without_a_home_directory_nothing_is_kept(
    declared: Callable[[], ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    def none() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", none)
    module = declared()
    assert make_ready() == 1
    assert value(module) == 30.0


@pytest.mark.parametrize(
    ("count", "environment"), [(2, {}), (1, {"NUMBA_DISABLE_JIT": "1"}), acceptance(4, {})]
)
def test_processes_share_a_directory_and_uncompiled_kernels_are_plain_python(
    folder: Path, tmp_path: Path, count: int, environment: dict[str, str]
) -> None:
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import numpy as np, declared; "
        "out = np.zeros((1, 1)); declared.scaled(np.full((1, 1), 3.0), 5.0, 1, out); "
        "print(out[0, 0], type(declared.scaled).__name__)"
    )
    started = [
        subprocess.Popen(
            [sys.executable, "-c", code], env=os.environ | environment, cwd=ROOT, stdout=subprocess.PIPE
        )
        for _ in range(count)
    ]
    kind = "function" if environment else "CPUDispatcher"
    assert [each.communicate(timeout=120)[0].decode() for each in started] == [f"30.0 {kind}\n"] * count


def test_each_record_that_a_kernel_takes_is_in_a_file_that_the_digest_knows() -> None:
    known = {str(file.relative_to(ROOT).with_suffix("")).replace(os.sep, ".") for file in compiled.sources()}
    records: set[str] = set()

    def look_at(hint: Any) -> None:
        if hasattr(hint, "_fields"):
            records.add(hint.__module__)
            for field in get_type_hints(hint).values():
                look_at(field)

    for each in compiled._KERNELS:
        for hint in get_type_hints(each.function).values():
            look_at(hint)
    assert "geometry.shape_grid" in records
    assert records <= known


def test_each_constant_that_a_kernel_reads_is_in_a_file_that_the_digest_knows() -> None:
    seen: set[FunctionType] = set()

    def look_at(function: Any) -> None:
        if function in seen:
            return
        seen.add(function)
        for name in function.__code__.co_names:
            read = function.__globals__.get(name)
            if hasattr(read, "py_func"):
                look_at(read.py_func)
            elif isinstance(read, int | float | tuple | np.ndarray):
                constants.add((function.__module__, name))

    constants: set[tuple[str, str]] = set()
    for each in compiled._KERNELS:
        look_at(each.function)
    assert len(constants) > 50
    sources = b"".join(compiled.sources().values()).decode()
    for module, name in constants:
        defined = rf"^(?=\w)[^(\n]*\b{name}\b[^(\n]*="
        assert name in ("inf", "pi") or re.search(defined, sources, re.MULTILINE), (module, name)
