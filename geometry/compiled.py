"""Functions of plain loops that numba compiles: how they are declared, compiled, and kept on disk.

A `kernel` is called from Python; its annotations are its signature, and it has no other:

    @kernel
    def scaled(values: Array2, by: float, out: Out2) -> None: ...

What many of them take together may be a `record`, a NamedTuple. An `inner` is called from kernels only and
compiled into them. All are plain Python with NUMBA_DISABLE_JIT=1.

numba keeps what it compiled in a directory whose name is a digest of all source files that name
geometry.compiled: those with kernels, and those whose constants kernels read. What is kept there runs as soon
as it is loaded, so whoever can write to it can run anything as this user. Where the directory belongs to
somebody else, or others may write to it, nothing is read or written: each process then compiles for itself.
"""

from __future__ import annotations

import logging
import os
import shutil
import stat
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from functools import cache, wraps
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numba
from numba import config, types

from geometry.arrays import Array, Index

Array1: TypeAlias = Array
Array2: TypeAlias = Array
Array3: TypeAlias = Array
Array4: TypeAlias = Array
"""Numbers that a kernel reads, with so many axes, contiguous."""
Index1: TypeAlias = Index
Index2: TypeAlias = Index
Index3: TypeAlias = Index
Index4: TypeAlias = Index
"""The same of whole numbers."""
Out1: TypeAlias = Array
Out2: TypeAlias = Array
Out3: TypeAlias = Array
Out4: TypeAlias = Array
"""Arrays that a kernel writes into, or returns."""
IndexOut1: TypeAlias = Index

Function = TypeVar("Function", bound=Callable[..., Any])
Record = TypeVar("Record", bound=tuple[Any, ...])

_LOG = logging.getLogger(__name__)
_OPTIONS = {"nopython": True, "error_model": "numpy", "nogil": True}
_PACKAGES = ("geometry", "estimation", "rti_mpcc")


_TYPES: dict[str, types.Type] = {
    "None": types.void,
    "float": types.float64,
    "int": types.int64,
    "bool": types.boolean,
    **{f"Array{n}": types.Array(types.float64, n, "C", readonly=True) for n in (1, 2, 3, 4)},
    **{f"Index{n}": types.Array(types.int64, n, "C", readonly=True) for n in (1, 2, 3, 4)},
    **{f"Out{n}": types.Array(types.float64, n, "C") for n in (1, 2, 3, 4)},
    "IndexOut1": types.Array(types.int64, 1, "C"),
}


def _type_of(annotation: str) -> types.Type:
    if annotation.startswith("tuple["):
        return types.BaseTuple.from_types([_TYPES[each] for each in annotation[6:-1].split(", ")])
    return _TYPES[annotation]


def kernel(function: Function) -> Function:
    """Declare a function of plain loops, called from Python, with the signature that its annotations say."""
    if config.DISABLE_JIT:
        return function
    declared = _Kernel(function)
    _KERNELS.append(declared)

    @wraps(function)
    def call(*given: Any) -> Any:
        return declared.run(*given)

    declared.call = call
    return call  # type: ignore[return-value]


def inner(function: Function) -> Function:
    """Declare a function that only kernels call."""
    declared: Function = function if config.DISABLE_JIT else numba.jit(**_OPTIONS)(function)
    return declared


def record(declared: type[Record]) -> type[Record]:
    """Declare a NamedTuple that kernels take whole: its annotations are the types of its fields.

    The arrays that it is made of are read-only where it says so (Array1, Index2, ...).
    """
    named: list[Any] = list(declared.__annotations__.values())
    fields = [_TYPES[getattr(each, "__forward_arg__", each)] for each in named]
    alike = len(set(fields)) == 1  # numba tells these by another type
    _TYPES[declared.__name__] = (
        types.NamedUniTuple(fields[0], len(fields), declared) if alike else types.NamedTuple(fields, declared)
    )
    return declared


def sources() -> dict[Path, bytes]:
    """Return all source files that name geometry.compiled: with kernels, or with constants that they read."""
    root = Path(__file__).parents[1]
    files = sorted(file for package in _PACKAGES for file in (root / package).rglob("*.py"))
    read = {file: file.read_bytes() for file in files}
    return {file: source for file, source in read.items() if b"geometry.compiled" in source}


@cache
def _digest() -> str:
    return sha256(b"".join(sources().values())).hexdigest()[:16]


def user_directory() -> Path:
    """Return where compiled kernels are kept: NUMBA_CACHE_DIR, or a directory for such files of the user's.

    Raises:
        RuntimeError: the user has no home directory.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen) / "rti-mpcc"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "rti-mpcc"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rti-mpcc"


def directory() -> Path:
    """Return where the kernels of these sources are kept. Raises as `user_directory`."""
    return user_directory() / _digest()


def _make_private(where: Path) -> None:
    """Make a directory, or close one, so that only the user can read it and write to it. Raises OSError."""
    where.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not hasattr(os, "geteuid"):
        return
    found = where.stat()
    if found.st_uid != os.geteuid():
        raise PermissionError(f"{where} belongs to another user")
    if stat.S_IMODE(found.st_mode) & 0o022:
        raise PermissionError(f"others may write to {where}")
    where.chmod(0o700)


def load() -> int:
    """Load the declared kernels that are on disk. Return how many are missing; `build` compiles those."""
    with suppress(OSError, RuntimeError):  # of a directory that cannot be read
        for each in _KERNELS:
            if not each.compiled and each.mark().exists():
                each.ready()
    return sum(not each.compiled for each in _KERNELS)


def build() -> Iterator[str]:
    """Compile, one by one, the kernels that are not loaded, and keep them on disk. Yields their names.

    Those that another process has compiled meanwhile are loaded.
    """
    for each in _KERNELS:
        if not each.compiled:
            each.ready()
            yield each.name


def modules() -> list[str]:
    """Return the names of the modules that declare kernels."""
    return list(dict.fromkeys(each.function.__module__ for each in _KERNELS))


def help_build(declaring: Iterable[str]) -> None:
    """Compile the kernels of modules for another process that does, too: from the last one on.

    What is on disk is left out, so that both meet halfway.
    """
    for name in declaring:
        import_module(name)
    for each in reversed(_KERNELS):
        if not each.mark().exists():
            each.ready()


def not_kept() -> str:
    """Return why what was compiled in this process is not on disk, or ""."""
    return next((each.problem for each in _KERNELS if each.problem), "")


class _Kernel:
    """A declared kernel; `run` compiles it, or loads it, when it is first called."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.name = f"{function.__module__}.{function.__qualname__}"
        self.run: Callable[..., Any] = self._first
        self.call: Callable[..., Any] = function
        self.compiled, self.problem = False, ""
        self.function = function

    def mark(self) -> Path:
        """A file that says that this kernel is on disk."""
        return directory() / self.name

    def ready(self) -> None:
        """Load or compile it for the types that its annotations say; it refuses others."""
        annotations = dict(self.function.__annotations__)
        result = _type_of(annotations.pop("return"))
        signature = result(*(_type_of(each) for each in annotations.values()))
        try:
            self.run = self._cached(signature)
            with suppress(OSError):
                self.mark().touch()
        except Exception as error:
            if not not_kept():
                _LOG.warning("compiled kernels are not kept: %s", error)
            self.problem = str(error)
            self.run = numba.jit(signature, **_OPTIONS)(self.function)
        self.compiled = True
        # From then on all modules that have it call it directly: that is faster than by way of `call`.
        name = self.function.__name__
        ours = (vars(module) for at, module in sys.modules.items() if at.startswith(_PACKAGES))
        for names in (self.function.__globals__, *ours):
            if names.get(name) is self.call:
                names[name] = self.run

    def _cached(self, signature: Any) -> Any:
        _make_private(user_directory())
        before, config.CACHE_DIR = config.CACHE_DIR, str(directory())
        try:
            return numba.jit(signature, cache=True, **_OPTIONS)(self.function)
        except (OSError, RuntimeError):
            raise
        except Exception:  # numba raises whatever comes of reading a damaged file
            shutil.rmtree(directory(), ignore_errors=True)
            return numba.jit(signature, cache=True, **_OPTIONS)(self.function)
        finally:
            config.CACHE_DIR = before

    def _first(self, *given: Any) -> Any:
        self.ready()
        return self.run(*given)


_KERNELS: list[_Kernel] = []
