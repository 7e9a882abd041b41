"""What is done before the first cycle: the compiled kernels, and the garbage collector."""

from __future__ import annotations

import gc
import logging
import subprocess
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext

from geometry import compiled, validation

_log = logging.getLogger(__name__)
_WIDTH = 79  # of a line on a terminal
_FEW = 8  # kernels that are compiled sooner than a second process has started


def make_ready(*, second_process: bool = False) -> int:
    """Load all kernels that are kept on this machine and compile the others; return how many these were.

    Args:
        second_process: another Python process compiles some of them. For programs that Python itself runs:
            `sys.executable` must be an interpreter.

    A warning, and a count on a terminal, announce the compilation. Then the log says where the kernels are
    kept, or why they are not. Loading takes a fraction of a second, a second call nothing.
    """
    validation.prepare()
    missing = compiled.load()
    if not missing:
        return 0
    _log.warning("compiling %d kernels, this takes about half a minute", missing)
    names: Iterable[str] = compiled.build()
    if sys.stderr.isatty():
        names = _counted(names, missing)
    with _helping() if second_process and missing > _FEW else nullcontext():
        count = sum(1 for _ in names)
    if not compiled.not_kept():
        _log.info("the compiled kernels are kept in %s", compiled.directory())
    return count


def _counted(names: Iterable[str], total: int) -> Iterator[str]:
    """The same names; one line on stderr counts and shows them."""
    try:
        for count, name in enumerate(names, 1):
            sys.stderr.write(f"\r{f'compiled {count} of {total} kernels: {name}':<{_WIDTH}.{_WIDTH}}")
            sys.stderr.flush()
            yield name
    finally:
        sys.stderr.write("\n")


@contextmanager
def _helping() -> Iterator[None]:
    """With a process that compiles from the last kernel on; it is ended with the block."""
    helps = f"import {', '.join(compiled.modules())}; from geometry import compiled; "
    command = [sys.executable, "-c", helps + "list(compiled.build(backwards=True))"]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as helper:
        try:
            yield
        finally:
            helper.terminate()


def prepare_process() -> None:
    """Collect garbage once, and exclude all present objects from later collections (`gc.freeze`).

    Call it after the controller is made and before its first cycle: else a collection in one of the first
    cycles looks through all objects of the libraries, in about a tenth of a second. Garbage collection stays
    on for all later objects, and a frozen object is released as usual when its last reference goes. It may be
    called again for another controller: it first collects the frozen objects that only refer to one another.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()
