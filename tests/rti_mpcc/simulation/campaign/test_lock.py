"""One process at a time runs a campaign."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from rti_mpcc.errors import InputError
from rti_mpcc.simulation.campaign.lock import locked

HOLD = """
import sys
from pathlib import Path
from rti_mpcc.simulation.campaign.lock import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def refused(folder: Path) -> None:
    with pytest.raises(InputError, match="another process is running this campaign"), locked(folder):
        pass


def test_a_second_one_is_refused_and_a_later_one_is_not(tmp_path: Path) -> None:
    for _ in range(2):
        with locked(tmp_path):
            refused(tmp_path)


def test_the_lock_goes_with_its_process(tmp_path: Path) -> None:
    command = [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None
        assert holder.stdout.readline() == "held\n"
        refused(tmp_path)
        holder.kill()
    with locked(tmp_path):
        pass
