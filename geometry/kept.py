"""The directory in which compiled kernels are kept: the user's own, closed to all others.

What is kept there runs as soon as it is loaded, so whoever can write to it can run anything as this user.
Where it belongs to somebody else, or others may write to it, nothing is read or written: each process then
compiles for itself. A directory that others may only read is closed.
"""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path


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


def private(where: Path) -> None:
    """Make a directory, or close one, so that only the user can read it and write to it.

    Raises:
        OSError: it cannot be made, belongs to another user, or others could have written to it.
    """
    where.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not hasattr(os, "geteuid"):
        return
    found = where.stat()
    if found.st_uid != os.geteuid():
        raise PermissionError(f"{where} belongs to another user")
    if stat.S_IMODE(found.st_mode) & 0o022:
        raise PermissionError(f"others may write to {where}")
    where.chmod(0o700)
