"""Functions of plain loops that numba compiles: how they are declared, compiled, and kept on disk.

A `kernel` is called from Python; its annotations are its signature, and it has no other:

    @kernel
    def scaled(values: Array2, by: float, out: Out2) -> None: ...

Several arguments together may be a NamedTuple with such annotations. A kernel may call others. An `inner` is
called from kernels only and compiled into them. All are plain Python with NUMBA_DISABLE_JIT=1.

numba keeps compiled kernels in a directory whose name is a digest of all source files that name
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
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, wraps
from hashlib import sha256
from pathlib import Path
from typing import Annotated, Any, TypeAlias, TypeVar, get_args, get_type_hints

import numba
from numba import config, types

from geometry.arrays import Array, Index


def _read(numbers: types.Type, axes: int) -> types.Type:
    return types.Array(numbers, axes, "C", readonly=True)


Array1: TypeAlias = Annotated[Array, _read(types.float64, 1)]
Array2: TypeAlias = Annotated[Array, _read(types.float64, 2)]
Array3: TypeAlias = Annotated[Array, _read(types.float64, 3)]
Array4: TypeAlias = Annotated[Array, _read(types.float64, 4)]
"""Numbers that a kernel reads, with so many axes, contiguous."""
Index1: TypeAlias = Annotated[Index, _read(types.int64, 1)]
Index2: TypeAlias = Annotated[Index, _read(types.int64, 2)]
Index3: TypeAlias = Annotated[Index, _read(types.int64, 3)]
Index4: TypeAlias = Annotated[Index, _read(types.int64, 4)]
"""Whole numbers that a kernel reads."""
Out1: TypeAlias = Annotated[Array, types.float64[::1]]
Out2: TypeAlias = Annotated[Array, types.float64[:, ::1]]
Out3: TypeAlias = Annotated[Array, types.float64[:, :, ::1]]
Out4: TypeAlias = Annotated[Array, types.float64[:, :, :, ::1]]
IndexOut1: TypeAlias = Annotated[Index, types.int64[::1]]
"""Arrays that a kernel writes into, or returns."""

Function = TypeVar("Function", bound=Callable[..., Any])

_LOG = logging.getLogger(__name__)
_OPTIONS = {"nopython": True, "error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True}
_PACKAGES = ("geometry", "estimation", "rti_mpcc")
_SCALARS = {type(None): types.void, float: types.float64, int: types.int64, bool: types.boolean}


def kernel(function: Function) -> Function:
    """Declare a function of plain loops, called from Python, with the signature that its annotations say."""
    if config.DISABLE_JIT:
        return function

    @wraps(function)
    def call(*given: Any) -> Any:
        return declared.ready()(*given)

    declared = _Kernel(function, call)
    _KERNELS.append(declared)
    return call  # type: ignore[return-value]


def inner(function: Function) -> Function:
    """Declare a function that only kernels call: numba compiles no door for Python to it."""
    declared: Function = numba.jit(no_cpython_wrapper=True, **_OPTIONS)(function)
    return declared


@inner
def copy_row(values: Array, out: Array) -> None:
    """Copy a row (n,) into another one. With `out[:] = values` numba compiles a check of both shapes, and
    the text of its message: that takes longer than most kernels."""
    for k in range(len(out)):
        out[k] = values[k]


@inner
def copy_rows(values: Array, out: Array) -> None:
    """Copy the first rows (n, m) into as many others, see `copy_row`."""
    for k in range(len(out)):
        copy_row(values[k], out[k])


@cache
def _type_of(hint: Any) -> types.Type:
    """The type that numba has for an annotation."""
    if metadata := getattr(hint, "__metadata__", ()):
        return metadata[0]
    if hint in _SCALARS:
        return _SCALARS[hint]
    named = get_type_hints(hint, include_extras=True) if hasattr(hint, "_fields") else {}
    fields = [_type_of(each) for each in (named.values() or get_args(hint))]
    if not named:
        return types.BaseTuple.from_types(fields)
    if len(set(fields)) == 1:  # numba tells these by another type
        return types.NamedUniTuple(fields[0], len(fields), hint)
    return types.NamedTuple(fields, hint)


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

    Raises RuntimeError if the user has no home directory.
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
        for each in _missing():
            if each.mark().exists():
                each.ready()
    return len(_missing())


def build(*, backwards: bool = False) -> Iterator[str]:
    """Compile, one by one, the kernels that are not loaded, and keep them on disk. Yields their names.

    Those that another process has compiled meanwhile are loaded: one that does so backwards meets this one
    halfway.
    """
    for each in _missing()[:: -1 if backwards else 1]:
        if not each.compiled:
            each.ready()
            yield each.name


def modules() -> list[str]:
    """Return the names of the modules that declare kernels."""
    return list(dict.fromkeys(each.function.__module__ for each in _KERNELS))


def not_kept() -> str:
    """Return why what was compiled in this process is not on disk, or ""."""
    return next((each.problem for each in _KERNELS if each.problem), "")


class _Kernel:
    """A declared kernel; `call` stands in its place until it is compiled or loaded."""

    def __init__(self, function: Callable[..., Any], call: Callable[..., Any]) -> None:
        self.name = f"{function.__module__}.{function.__qualname__}"
        self.function, self.call = function, call
        self.compiled: Callable[..., Any] | None = None
        self.problem = ""

    def mark(self) -> Path:
        """A file that says that this kernel is on disk."""
        return directory() / self.name

    def ready(self) -> Callable[..., Any]:
        """Return it, compiled for the types that its annotations say; it refuses others."""
        if self.compiled is not None:
            return self.compiled
        called = {id(self.function.__globals__.get(name)) for name in self.function.__code__.co_names}
        for each in _KERNELS:
            if id(each.call) in called:
                each.ready()
        hints = get_type_hints(self.function, include_extras=True)
        result = _type_of(hints.pop("return"))
        signature = result(*map(_type_of, hints.values()))
        try:
            compiled: Callable[..., Any] = self._cached(signature)
            with suppress(OSError):
                self.mark().touch()
        except Exception as error:
            if not not_kept():
                _LOG.warning("compiled kernels are not kept: %s", error)
            self.problem = str(error)
            compiled = numba.jit(signature, **_OPTIONS)(self.function)
        self.compiled = compiled
        # From then on all modules that have it call it directly: that is faster than by way of `call`.
        ours = (vars(module) for at, module in sys.modules.items() if at.startswith(_PACKAGES))
        for names in (self.function.__globals__, *ours):
            if names.get(self.function.__name__) is self.call:
                names[self.function.__name__] = compiled
        return compiled

    def _cached(self, signature: Any) -> Any:
        _make_private(user_directory())
        before, config.CACHE_DIR = config.CACHE_DIR, str(directory())
        compile_ = numba.jit(signature, cache=True, **_OPTIONS)
        try:
            return compile_(self.function)
        except (OSError, RuntimeError):
            raise
        except Exception:  # numba raises whatever comes of reading a damaged file
            shutil.rmtree(directory(), ignore_errors=True)
            return compile_(self.function)
        finally:
            config.CACHE_DIR = before


_KERNELS: list[_Kernel] = []


def _missing() -> list[_Kernel]:
    return [each for each in _KERNELS if each.compiled is None]
