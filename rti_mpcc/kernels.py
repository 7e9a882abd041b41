"""The compiled kernels of this package, ready before the first cycle."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterable
from contextlib import suppress

from geometry import compiled

_log = logging.getLogger(__name__)


def make_ready() -> int:
    """Load all kernels that are kept on this machine and compile the others; return how many these were.

    Compiling is told once, in a warning and with a bar on a terminal. It takes seconds, loading a fraction of
    one, a second call nothing.
    """
    missing = compiled.load()
    if not missing:
        return 0
    where = ""
    with suppress(RuntimeError):
        where = f"; they are kept in {compiled.directory()}"
    _log.warning("compiling %d kernels, once on this machine, in about a minute%s", missing, where)
    names: Iterable[str] = compiled.build()
    if sys.stderr.isatty():
        from rich.console import Console  # here: seldom needed, and not at once imported
        from rich.progress import track

        names = track(names, "compiling", total=missing, console=Console(stderr=True), transient=True)
    return sum(1 for _ in names)
