"""How long a cycle takes here and at another commit, in one run: what the machine does meanwhile meets both.

    python -m benchmarks.compare_speed [COMMIT] [--rounds 5] [--scenarios NAME ...]

Drives the scenarios in closed loop, in turn with the files as they are here and with those of COMMIT (by
default the one before HEAD), each time in a process of its own. A ratio is of two drives that follow one
another; below 1 this is faster. Nothing is written.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from benchmarks.tables import ROOT, command_line, table
from rti_mpcc.simulation import builtin_names
from rti_mpcc.simulation.batch import THREADS
from rti_mpcc.types import Array

PERCENTILES = (50, 95, 99)
SCENARIOS = ("docking_behind", "docking_full_course", "docking_moving_goal")
DRIVE = Path(__file__).with_name("timed_drive.py")


def parsed() -> argparse.Namespace:
    parser = command_line(__doc__, "python -m benchmarks.compare_speed")
    parser.add_argument("commit", nargs="?", default="HEAD~1")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--scenarios", nargs="+", choices=builtin_names(), default=SCENARIOS)
    return parser.parse_args()


@contextmanager
def files_of(commit: str) -> Iterator[Path]:
    """A directory with the files of a commit.

    Raises SystemExit for one that is not there.
    """
    with tempfile.TemporaryDirectory() as name:
        packed = subprocess.run(["git", "archive", commit], cwd=ROOT, capture_output=True)
        if packed.returncode:
            raise SystemExit(f"{commit}: {packed.stderr.decode().strip()}")
        subprocess.run(["tar", "-x"], cwd=name, input=packed.stdout, check=True)
        yield Path(name)


def percentiles(tree: Path, scenarios: Sequence[str]) -> Array:
    """Of the time of a cycle with the files of a tree [ms]."""
    drive = [sys.executable, "-P", str(DRIVE), *scenarios]
    environment = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": str(tree)}
    done = subprocess.run(drive, cwd=tree, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{tree}: {done.stderr.strip().splitlines()[-1]}")
    found: Array = np.percentile(json.loads(done.stdout), PERCENTILES)
    return found


def rows(here: Array, there: Array, commit: str) -> list[list[str]]:
    """Of a table, from the percentiles (rounds, 3) of both [ms]."""
    ratios = here / there
    middle = [f"{value:.3f}" for value in np.median(ratios, axis=0)]
    ends = [f"{least:.3f} to {most:.3f}" for least, most in zip(ratios.min(0), ratios.max(0), strict=True)]
    return [
        ["here [ms]", *(f"{value:.2f}" for value in np.median(here, axis=0))],
        [f"{commit} [ms]", *(f"{value:.2f}" for value in np.median(there, axis=0))],
        ["ratio", *middle],
        ["ratios of all rounds", *ends],
    ]


def main() -> None:
    asked = parsed()
    here: list[Array] = []
    there: list[Array] = []
    with files_of(asked.commit) as other:
        for tree in (ROOT, other):  # whatever is done once only
            percentiles(tree, asked.scenarios[:1])
        for i in range(max(asked.rounds, 1)):
            pair = [(ROOT, here), (other, there)]
            for tree, found in pair if i % 2 else reversed(pair):
                found.append(percentiles(tree, asked.scenarios))
            print(f"round {i + 1}: p50 {here[-1][0]:.2f} ms here, {there[-1][0]:.2f} ms there", flush=True)
    print(table(["cycle, medians", "p50", "p95", "p99"], rows(np.array(here), np.array(there), asked.commit)))


if __name__ == "__main__":
    main()
