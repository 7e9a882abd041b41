"""Whether the tests notice each change of behaviour in `benchmarks/mutations.toml`.

    python -m benchmarks.mutate                # each edit against the test files that noticed it once
    python -m benchmarks.mutate --only WORDS   # the edits with WORDS in their description or file
    python -m benchmarks.mutate --all          # an edit that survived meets the whole fast suite, too

Prints one line an edit: the first test that fails, or "survived". Exit status: 0 all were noticed, 1 some
survived, 2 an edit has no place in the code any more.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from joblib import Parallel, delayed

from benchmarks.tables import ROOT, command_line
from rti_mpcc.simulation.batch import THREADS

FILE = Path(__file__).with_name("mutations.toml")
PACKAGES = ("geometry", "estimation", "rti_mpcc")
HANGS = 1800  # [s]; a test that lasts longer fails
SURVIVED, NO_PLACE, NO_TESTS = "survived", "no place in the code", "its tests cannot be run"
_FAILED = re.compile(r"^(?:FAILED|ERROR) (tests/\S+)", re.MULTILINE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Edit:
    """One change of behaviour.

    Attributes:
        what: the changed behaviour; file: its place; old, new: the code before and after.
        tests: files of tests/ that notice it.
    """

    what: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]


def edits() -> tuple[Edit, ...]:
    """All edits, in the order of the file."""
    rows = tomllib.loads(FILE.read_text(encoding="utf-8"))["edit"]
    return tuple(Edit(**{**row, "tests": tuple(row["tests"])}) for row in rows)


def place_of(edit: Edit, tree: Path) -> Path | None:
    """The file with the edit's old code: its own, or the only one of the packages; None: there is none."""
    own = tree / edit.file
    files = [own] if own.is_file() else []
    if not any(edit.old in file.read_text(encoding="utf-8") for file in files):
        files = [file for package in PACKAGES for file in sorted((tree / package).rglob("*.py"))]
    found = [file for file in files if file.read_text(encoding="utf-8").count(edit.old) == 1]
    return found[0] if len(found) == 1 else None


def failures(tree: Path, tests: Sequence[str], *options: str) -> list[str]:
    """The tests that fail in a tree, by their names; NO_TESTS where pytest ends without a verdict."""
    environment = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": str(tree), "MPLBACKEND": "Agg"}
    # The first test may compile an edited kernel: on a loaded machine that takes minutes, and is no verdict.
    pytest = ["pytest", "-q", "--tb=no", "-p", "no:cacheprovider", f"--timeout={HANGS}"]
    command = [sys.executable, "-m", *pytest, *options, *tests]
    done = subprocess.run(command, cwd=tree, env=environment, capture_output=True, text=True)
    if done.returncode == 0:
        return []
    return _FAILED.findall(done.stdout) or [NO_TESTS]


def noticed_by(edit: Edit, root: Path = ROOT, *, everything: bool = False) -> str:
    """The first test that fails with an edit of the files in `root`, or why there is none."""
    if place_of(edit, root) is None:
        return NO_PLACE
    with tempfile.TemporaryDirectory() as name:
        tree = edited(edit, root, Path(name) / "tree")
        tests = [f"tests/{each}" for each in edit.tests if (tree / "tests" / each).exists()]
        found = failures(tree, tests, "-x") if tests else []
        if everything and not found:
            found = failures(tree, ["tests"], "-x")
    return found[0] if found else SURVIVED


def edited(edit: Edit, root: Path, tree: Path) -> Path:
    """A copy of the files with an edit."""
    ignored = shutil.ignore_patterns(".*", "runs", "__pycache__", "build", "dist")
    shutil.copytree(root, tree, ignore=ignored)
    file = place_of(edit, tree)
    assert file is not None
    file.write_text(file.read_text(encoding="utf-8").replace(edit.old, edit.new), encoding="utf-8")
    return tree


def main() -> int:
    parser = command_line(__doc__, "python -m benchmarks.mutate")
    parser.add_argument("--only", metavar="WORDS", default="", help="only edits with WORDS in them")
    parser.add_argument("--all", action="store_true", help="run the whole fast suite for survivors")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="number of processes (default: 2)")
    asked = parser.parse_args()
    chosen = [edit for edit in edits() if asked.only in edit.what or asked.only in edit.file]
    work = (delayed(noticed_by)(edit, everything=asked.all) for edit in chosen)
    results = Parallel(n_jobs=asked.jobs, return_as="generator")(work)
    found = []
    for edit, result in zip(chosen, results, strict=True):
        found.append(result)
        print(f"{edit.what} ({edit.file}): {result}", flush=True)
    survived = sum(result == SURVIVED for result in found)
    broken = sum(result in (NO_PLACE, NO_TESTS) for result in found)
    print(f"{len(found) - survived - broken} of {len(found)} noticed")
    return 2 if broken else min(survived, 1)


if __name__ == "__main__":
    sys.exit(main())
