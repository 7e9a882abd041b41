"""One process at a time writes to a campaign's folder."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from rti_mpcc.errors import InputError

FILE = "campaign.lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder. The lock goes with the process, however that ends.

    Raises InputError while another one holds it.
    """
    with (folder / FILE).open("ab") as stream:
        try:
            _lock(stream)
        except OSError:
            raise InputError(f"{folder}: another process is running this campaign") from None
        yield


if sys.platform == "win32":
    import msvcrt

    def _lock(stream: BinaryIO) -> None:
        stream.seek(0)
        msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
else:
    import fcntl

    def _lock(stream: BinaryIO) -> None:
        fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
