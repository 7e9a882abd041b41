"""Functions of plain loops that numba compiles: how they are declared, compiled, and kept on disk.

A `kernel` is called from Python; its annotations are its signature, and it has no other:

    @kernel
    def scaled(values: Array2, by: float, out: Out2) -> None: ...

What many of them take together may be a `record`, a NamedTuple.

An `inner` is called from kernels only and compiled into them. Both are plain Python with NUMBA_DISABLE_JIT=1.

What is compiled is kept in a directory that is the user's alone (geometry.kept), one file a kernel. A file's
name says all that its content depends on: the byte code of the kernel and of all it calls, the constants that
they read, Python, numba, processor. It is written beside and then moved into place, and read only if its
checksum holds: a damaged file costs the time to compile. The checksum is no protection from who may write.
(numba's own cache looks at one source file only, and raises if its files are damaged or can't be written.)
"""

from __future__ import annotations

import logging
import pickle
import sys
from collections.abc import Callable, Iterator
from hashlib import sha256
from types import CodeType, FunctionType, ModuleType
from typing import Any, TypeAlias, TypeVar

import numba
import numpy as np
from llvmlite import __version__ as llvm_version
from numba import types
from numba.core import config, serialize
from numba.core.caching import _Cache
from numba.core.compiler import CompileResult

from geometry import kept
from geometry.arrays import Array, Index
from geometry.kept import directory as directory

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
"""Arrays that a kernel writes into."""
IndexOut1: TypeAlias = Index
IndexOut2: TypeAlias = Index

Function = TypeVar("Function", bound=Callable[..., Any])
Record = TypeVar("Record", bound=tuple[Any, ...])

_LOG = logging.getLogger(__name__)
_CHECKSUM = sha256().digest_size
_OPTIONS = {"nopython": True, "error_model": "numpy", "nogil": True}


def _array(of: types.Type, axes: int, *, written: bool = False) -> types.Array:
    return types.Array(of, axes, "C", readonly=not written)


_TYPES: dict[str, types.Type] = {
    "None": types.void,
    "float": types.float64,
    "int": types.int64,
    "bool": types.boolean,
    **{f"tuple[{', '.join(['float'] * n)}]": types.UniTuple(types.float64, n) for n in range(2, 7)},
    **{f"Array{n}": _array(types.float64, n) for n in (1, 2, 3, 4)},
    **{f"Out{n}": _array(types.float64, n, written=True) for n in (1, 2, 3, 4)},
    **{f"Index{n}": _array(types.int64, n) for n in (1, 2, 3, 4)},
    **{f"IndexOut{n}": _array(types.int64, n, written=True) for n in (1, 2)},
}


def kernel(function: Function) -> Function:
    """Declare a function of plain loops, called from Python, with the signature that its annotations say."""
    if config.DISABLE_JIT:
        return function
    compiled: Any = numba.jit(**_OPTIONS)(function)
    _KERNELS.append(_Kernel(compiled))
    declared: Function = compiled
    return declared


def inner(function: Function) -> Function:
    """Declare a function that only kernels call."""
    if config.DISABLE_JIT:
        return function
    declared: Function = numba.jit(**_OPTIONS)(function)
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


def load() -> int:
    """Load all declared kernels that are on disk. Return how many are missing; `build` compiles those."""
    return sum(not each.load() for each in _KERNELS)


def build() -> Iterator[str]:
    """Compile, one by one, the kernels that are not loaded, and keep them on disk. Yields their names."""
    for each in _KERNELS:
        if not each.ready:
            each.compile()
            yield each.name


def not_kept() -> str:
    """Return why what was compiled in this process is not on disk, or ""."""
    return next((each.problem for each in _KERNELS if each.problem), "")


class _Kernel:
    """A declared kernel: numba's dispatcher of it, which takes its one signature only."""

    def __init__(self, dispatcher: Any) -> None:
        self.function: FunctionType = dispatcher.py_func
        self.name = f"{self.function.__module__}.{self.function.__qualname__}"
        annotations = dict(self.function.__annotations__)
        result = _TYPES[annotations.pop("return")]
        self.signature = result(*(_TYPES[each] for each in annotations.values()))
        self._dispatcher = dispatcher
        self._file = _File(self)
        dispatcher._cache = self._file
        dispatcher._compile_for_args = self._first_call

    @property
    def ready(self) -> bool:
        """Whether it is compiled, or loaded."""
        return bool(self._dispatcher.overloads)

    @property
    def problem(self) -> str:
        """Why it is not on disk, or ""."""
        return self._file.problem

    def load(self) -> bool:
        """Load it if it is on disk; return whether it is ready."""
        if not self.ready and self._file.read():
            self.compile()
        return self.ready

    def compile(self) -> Any:
        """Load or compile it; return the entry point. Other types than declared are refused from then on."""
        entry_point = self._dispatcher.compile(self.signature)
        self._dispatcher.disable_compile()
        return entry_point

    def _first_call(self, *given: Any) -> Any:
        """What the dispatcher asks for where it has nothing for the types of the arguments `given`."""
        convertible = self._dispatcher.targetctx.typing_context.can_convert
        kinds = [self._dispatcher.typeof_pyval(each) for each in given]
        wanted = self.signature.args
        if len(kinds) != len(wanted) or any(map(lambda a, b: convertible(a, b) is None, kinds, wanted)):
            raise TypeError(f"{self.name} takes {wanted}, not {tuple(kinds)}.")
        return self.compile()


class _File(_Cache):  # type: ignore[misc]
    """Where numba's dispatcher looks for its kernel, and leaves it."""

    def __init__(self, of: _Kernel) -> None:
        self._kernel = of
        self._content: bytes | None = None
        self.problem = ""

    @property
    def cache_path(self) -> str:
        return str(directory())

    def read(self) -> bool:
        """Read the file; return whether there is one and its checksum holds."""
        try:
            content = kept.read(self._name())
        except FileNotFoundError:
            return False
        except (OSError, RuntimeError) as error:
            self.problem = str(error)
            return False
        whole = sha256(content[_CHECKSUM:]).digest() == content[:_CHECKSUM]
        self._content = content[_CHECKSUM:] if whole else None
        return whole

    def load_overload(self, sig: Any, target_context: Any) -> CompileResult | None:
        if self._content is None and not self.read():
            return None
        content, self._content = self._content, None
        target_context.refresh()
        try:
            return CompileResult._rebuild(target_context, *pickle.loads(content or b""))
        except Exception as error:  # whatever it is: it can be compiled
            _LOG.info("%s is compiled again: what was kept of it does not load (%r)", self._name(), error)
            return None

    def save_overload(self, sig: Any, data: CompileResult) -> None:
        content = serialize.dumps(data._reduce())
        try:
            kept.write(self._name(), sha256(content).digest() + content)
            self.problem = ""
        except (OSError, RuntimeError) as error:
            self.problem = str(error)
            _LOG.info("%s can't be kept on disk: %s", self._kernel.name, error)

    def enable(self) -> None:
        """Nothing to do: it is always used."""

    def disable(self) -> None:
        """Not asked for."""

    def flush(self) -> None:
        """Nothing is held back."""

    def _name(self) -> str:
        codegen = self._kernel._dispatcher.targetctx.codegen()
        by = (sys.version, numba.__version__, llvm_version, np.__version__, codegen.magic_tuple(), _OPTIONS)
        parts = [repr(by), str(self._kernel.signature), *_content_of(self._kernel.function, set())]
        digest = sha256("\n".join(parts).encode()).hexdigest()[:32]
        return f"{self._kernel.name}-{digest}"


def _content_of(function: FunctionType, seen: set[FunctionType]) -> Iterator[str]:
    """All that the machine code of a function depends on: byte code, constants read, functions called."""
    seen.add(function)
    yield from _code(function.__code__)
    known = function.__globals__
    for name in sorted(known.keys() & set(function.__code__.co_names)):
        value = known[name]
        called = getattr(value, "py_func", None)
        if called is not None:
            if called not in seen:
                yield from _content_of(called, seen)
        elif isinstance(value, np.ndarray):
            yield f"{name}: {value.dtype} {value.shape} {value.tobytes()!r}"
        else:
            yield f"{name}: {value.__name__ if isinstance(value, ModuleType) else value!r}"


def _code(code: CodeType) -> Iterator[str]:
    yield repr((code.co_code, code.co_names, code.co_varnames))
    for each in code.co_consts:
        if isinstance(each, CodeType):
            yield from _code(each)
        else:
            yield repr(each)


_KERNELS: list[_Kernel] = []
