"""The compiled kernels of this package, ready before the first cycle."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterable

from geometry import compiled, doors

_log = logging.getLogger(__name__)


def make_ready() -> int:
    """Load all kernels that are kept on this machine and compile the others; return how many these were.

    Compiling is told once, in a warning and with a bar on a terminal. After it the log says where the kernels
    are kept, or why they are not. Loading takes a fraction of a second, a second call nothing.
    """
    doors.prepare()
    missing = compiled.load()
    if not missing:
        return 0
    _log.warning("compiling %d kernels, this takes about a minute", missing)
    names: Iterable[str] = compiled.build()
    if sys.stderr.isatty():
        from rich.console import Console  # here: seldom needed, and not at once imported
        from rich.progress import track

        names = track(names, "compiling", total=missing, console=Console(stderr=True), transient=True)
    count = sum(1 for _ in names)
    if not compiled.not_kept():
        _log.info("the compiled kernels are kept in %s", compiled.directory())
    return count
