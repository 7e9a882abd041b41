"""How long a cycle takes here and at another commit, in one run: what the machine does meanwhile meets both.

    python -m benchmarks.compare_speed [COMMIT] [--rounds 5] [--scenarios NAME ...]

Drives the scenarios in closed loop, in turn with the files as they are here and with those of COMMIT (by
default the one before HEAD), each time in a process of its own. The drives of all rounds are the same, so of
each cycle the least time of all rounds counts: what else the machine does can only lengthen it. A ratio below
1 says that this is faster. Nothing is written.
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

from benchmarks.tables import ROOT, command_line, git, table
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
    with tempfile.TemporaryDirectory() as folder:
        packed, tree = Path(folder, "files.tar"), Path(folder, "tree")
        if git("archive", f"--output={packed}", commit) is None:
            raise SystemExit(f"{commit}: no commit of this repository")
        tree.mkdir()
        subprocess.run(["tar", "-xf", packed], cwd=tree, check=True)
        yield tree


def times(tree: Path, scenarios: Sequence[str]) -> Array:
    """(n,) of the cycles of one round with the files of a tree [ms]."""
    drive = [sys.executable, "-P", str(DRIVE), *scenarios]
    environment = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": str(tree)}
    done = subprocess.run(drive, cwd=tree, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{tree}: {done.stderr.strip().splitlines()[-1]}")
    return np.array(json.loads(done.stdout))


def least(rounds: Sequence[Array]) -> Array:
    """(n,) least time of each cycle [ms], as far as all rounds go."""
    shortest = min(len(each) for each in rounds)
    return np.asarray(np.min([each[:shortest] for each in rounds], axis=0))


def rows(here: Sequence[Array], there: Sequence[Array], commit: str) -> list[list[str]]:
    """Of a table, from the times of the cycles of all rounds [ms]."""
    ours, theirs = (np.percentile(least(rounds), PERCENTILES) for rounds in (here, there))
    each = np.array([[np.percentile(of, PERCENTILES) for of in rounds] for rounds in (here, there)])
    ratios = each[0] / each[1]
    return [
        ["here [ms]", *(f"{value:.2f}" for value in ours)],
        [f"{commit} [ms]", *(f"{value:.2f}" for value in theirs)],
        ["ratio", *(f"{value:.3f}" for value in ours / theirs)],
        [
            "ratios of single rounds",
            *(f"{low:.3f} to {high:.3f}" for low, high in zip(ratios.min(0), ratios.max(0), strict=True)),
        ],
    ]


def main() -> None:
    asked = parsed()
    here: list[Array] = []
    there: list[Array] = []
    with files_of(asked.commit) as other:
        for tree in (ROOT, other):  # whatever is done once only
            times(tree, asked.scenarios[:1])
        for i in range(max(asked.rounds, 1)):
            pair = [(ROOT, here), (other, there)]
            for tree, found in pair if i % 2 else reversed(pair):
                found.append(times(tree, asked.scenarios))
            ours, theirs = (float(np.median(rounds[-1])) for rounds in (here, there))
            print(f"round {i + 1}: p50 {ours:.2f} ms here, {theirs:.2f} ms there", flush=True)
    print(table(["cycle, least time of all rounds", "p50", "p95", "p99"], rows(here, there, asked.commit)))


if __name__ == "__main__":
    main()
