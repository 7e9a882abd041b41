"""Compiled kernels: signatures, and a directory of them that costs time at most whatever is wrong with it."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from numba.core import config

from geometry import compiled
from geometry.arrays import Array

SOURCE = """
from __future__ import annotations
from geometry.compiled import Array2, Out2, inner, kernel

FACTOR = {factor}

@inner
def times(x: float, y: float) -> float:
    return {product}

@kernel
def scaled(values: Array2, by: float, count: int, out: Out2) -> float:
    for i in range(count):
        for j in range(values.shape[1]):
            out[i, j] = FACTOR * times(values[i, j], by)
    return by
"""
ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.skipif(config.DISABLE_JIT, reason="there is nothing compiled")


class Declared:
    """A module with a kernel, as a process has it that was just begun."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, factor: str = "2.0", product: str = "x * y") -> None:
        monkeypatch.setattr(compiled, "_KERNELS", [])
        self.module = ModuleType("declared")
        exec(SOURCE.format(factor=factor, product=product), self.module.__dict__)

    @property
    def kernel(self) -> Callable[..., float]:
        found: Callable[..., float] = self.module.scaled
        return found

    def value(self) -> float:
        """3 * 5 and what is made of it by the kernel."""
        out = np.zeros((1, 1))
        self.kernel(np.full((1, 1), 3.0), 5.0, 1, out)
        return float(out[0, 0])


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where kernels are kept, nothing yet."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    return tmp_path / "rti-mpcc"


def files(kept: Path) -> list[Path]:
    return sorted(kept.iterdir()) if kept.is_dir() else []


def test_a_kernel_is_built_once_and_loaded_from_then_on(kept: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    declared = Declared(monkeypatch)
    assert compiled.load() == 1
    assert list(compiled.build()) == ["declared.scaled"]
    assert compiled.load() == 0
    assert not list(compiled.build())
    assert len(files(kept)) == 1
    assert declared.value() == 30.0

    declared = Declared(monkeypatch)
    assert compiled.load() == 0
    assert not list(compiled.build())
    assert declared.value() == 30.0


def test_a_kernel_that_nobody_built_is_built_where_it_is_called(
    kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert Declared(monkeypatch).value() == 30.0
    assert compiled.load() == 0


@pytest.mark.parametrize(("factor", "product"), [("7.0", "x * y"), ("2.0", "x + y")])
def test_what_was_kept_of_another_source_is_not_loaded(
    kept: Path, monkeypatch: pytest.MonkeyPatch, factor: str, product: str
) -> None:
    Declared(monkeypatch).value()
    changed = Declared(monkeypatch, factor, product)
    assert compiled.load() == 1
    assert changed.value() == (105.0 if product == "x * y" else 16.0)


def test_arrays_may_be_closed_to_writing_where_they_are_read(
    kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    values, out = np.ones((2, 3)), np.zeros((2, 3))
    values.setflags(write=False)
    assert Declared(monkeypatch).kernel(values, 4, 2, out) == 4.0
    assert (out == 8.0).all()


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize(
    "values",
    [np.ones((3, 4))[:, ::2], np.ones(3), np.ones((3, 2), dtype=np.int64), [[1.0, 2.0]]],
    ids=["strided", "one axis", "whole numbers", "a list"],
)
def test_other_arguments_than_declared_are_refused(
    kept: Path, monkeypatch: pytest.MonkeyPatch, values: Array, first: bool
) -> None:
    declared = Declared(monkeypatch)
    if not first:
        declared.value()
    with pytest.raises(TypeError):
        declared.kernel(values, 1.0, 1, np.zeros((3, 2)))
    assert declared.value() == 30.0


def test_an_array_closed_to_writing_is_refused_where_it_is_written(
    kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed = np.zeros((3, 2))
    closed.setflags(write=False)
    with pytest.raises(TypeError):
        Declared(monkeypatch).kernel(np.ones((3, 2)), 1.0, 1, closed)


@pytest.mark.parametrize(
    "damage",
    [
        lambda content: b"",
        lambda content: content[: len(content) // 2],
        lambda content: content[:-1] + bytes([content[-1] ^ 1]),
        lambda content: sha256(b"not a kernel").digest() + b"not a kernel",
        lambda content: content[:40] + content[40:].replace(b"declared", b"d3clared"),
    ],
    ids=["empty", "truncated", "a bit flipped", "something else with its checksum", "renamed"],
)
def test_a_damaged_file_is_compiled_again(
    kept: Path, monkeypatch: pytest.MonkeyPatch, damage: Callable[[bytes], bytes]
) -> None:
    Declared(monkeypatch).value()
    (file,) = files(kept)
    whole = file.read_bytes()
    file.write_bytes(damage(whole))
    declared = Declared(monkeypatch)
    compiled.load()
    assert declared.value() == 30.0

    Declared(monkeypatch)
    assert compiled.load() == 0  # it was mended


@pytest.mark.parametrize("where", ["a file", "below a file", "a folder of that name"])
def test_a_directory_that_cannot_be_written_costs_the_time_to_compile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    kept = tmp_path / "rti-mpcc"
    if where == "a folder of that name":
        Declared(monkeypatch).value()
        (file,) = files(kept)
        file.unlink()
        file.mkdir()
    elif where == "a file":
        kept.write_text("in the way")
    else:
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "folder"))
        (tmp_path / "file").write_text("in the way")
    declared = Declared(monkeypatch)
    assert compiled.load() == 1
    assert declared.value() == 30.0
    assert not [each for each in files(kept) if each.name.startswith(".")]


def test_without_a_home_directory_nothing_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    def none() -> Path:
        raise RuntimeError("Could not determine home directory.")

    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", none)
    assert Declared(monkeypatch).value() == 30.0


def test_the_directory_is_the_one_for_such_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "numba"))
    assert compiled.directory() == tmp_path / "numba" / "rti-mpcc"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    assert compiled.directory() == tmp_path / "cache" / "rti-mpcc"
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert compiled.directory() == tmp_path / "local" / "rti-mpcc"


def processes(code: str, count: int, **environment: str) -> list[str]:
    """What `count` processes print that run the same at once."""
    begun = [
        subprocess.Popen(
            [sys.executable, "-c", code],
            env=os.environ | environment,
            cwd=ROOT,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(count)
    ]
    told = [each.communicate(timeout=120) for each in begun]
    assert not any(each.returncode for each in begun), told
    return [out for out, _ in told]


def test_many_processes_share_a_directory(tmp_path: Path) -> None:
    module = tmp_path / "declared.py"
    module.write_text(SOURCE.format(factor="2.0", product="x * y"))
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import numpy as np, declared; "
        "from geometry import compiled; compiled.load(); list(compiled.build()); "
        "out = np.zeros((1, 1)); declared.scaled(np.full((1, 1), 3.0), 5.0, 1, out); print(out[0, 0])"
    )
    told = processes(code, 4, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
    assert told == ["30.0\n"] * 4
    (kept,) = (tmp_path / "kept" / "rti-mpcc").glob("declared.*")
    assert kept.stat().st_size > 0


def test_uncompiled_the_functions_are_plain_python(tmp_path: Path) -> None:
    module = tmp_path / "declared.py"
    module.write_text(SOURCE.format(factor="2.0", product="x * y"))
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import numpy as np, declared, types; "
        "assert type(declared.scaled) is types.FunctionType; "
        "from geometry import compiled; assert compiled.load() == 0; "
        "out = np.zeros((1, 1)); declared.scaled(np.full((1, 1), 3.0), 5.0, 1, out); print(out[0, 0])"
    )
    assert processes(code, 1, NUMBA_DISABLE_JIT="1") == ["30.0\n"]
