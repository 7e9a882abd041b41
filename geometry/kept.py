"""The directory in which compiled kernels are kept: the user's own, closed to all others.

What is kept there runs as soon as it is loaded, so whoever can write to it can run anything as this user.
Where the directory or a file belongs to somebody else, or others may write to it, nothing is read or written,
and that is logged: each process then compiles for itself. A directory that others may only read is closed.
"""

from __future__ import annotations

import logging
import os
import stat
import sys
from pathlib import Path
from tempfile import NamedTemporaryFile

_LOG = logging.getLogger(__name__)
_TOLD: set[str] = set()
"""What was refused: said once a process."""


def directory() -> Path:
    """Return where compiled kernels are kept: NUMBA_CACHE_DIR, or a directory for such files of the user's.

    Raises:
        RuntimeError: the user has no home directory.
    """
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen) / "rti-mpcc"
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local") / "rti-mpcc"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rti-mpcc"


def read(name: str) -> bytes:
    """Return the content of a file.

    Raises:
        OSError: it is not there, cannot be read, or is not the user's alone; RuntimeError: as `directory`.
    """
    file = _closed(directory()) / name
    with file.open("rb") as stream:
        _refuse_foreign(file, os.fstat(stream.fileno()))
        return stream.read()


def write(name: str, content: bytes) -> None:
    """Write a file whole or not at all. Raises as `read`."""
    where = directory()
    where.parent.mkdir(parents=True, exist_ok=True)
    where.mkdir(mode=0o700, exist_ok=True)
    with NamedTemporaryFile(dir=_closed(where), prefix=".", delete=False) as stream:
        try:
            stream.write(content)
            stream.close()
            os.replace(stream.name, where / name)
        except OSError:
            os.unlink(stream.name)
            raise


def _closed(where: Path) -> Path:
    """The directory, closed to all others."""
    found = where.stat()
    _refuse_foreign(where, found)
    if hasattr(os, "geteuid") and stat.S_IMODE(found.st_mode) & 0o077:
        where.chmod(0o700)
    return where


def _refuse_foreign(path: Path, found: os.stat_result) -> None:
    """Raise PermissionError for what others can have written."""
    if not hasattr(os, "geteuid"):
        return
    if found.st_uid != os.geteuid():
        problem = f"{path} belongs to another user"
    elif stat.S_IMODE(found.st_mode) & 0o022:
        problem = f"others may write to {path}"
    else:
        return
    if problem not in _TOLD:
        _TOLD.add(problem)
        _LOG.warning("compiled kernels are not kept: %s", problem)
    raise PermissionError(problem)
