"""Whether the controller does to the bit what it did at another commit, on this machine.

    python -m benchmarks.same BASE               # all runs, at BASE (a commit) and at HEAD (the working tree)
    python -m benchmarks.same BASE --only NAME   # the runs with NAME in their names
    python -m benchmarks.same --list             # the names of all runs

Compares commands (numbers), meanings (status, source, reason, docked, mission) and plans of every cycle; of a
run that differs it says which of them, and the first cycle. If none differs it prints the line for the
message of the commit that tells `benchmarks.fresh` so. Both sides drive the same random problems: BASE
generates their files, or HEAD where BASE cannot. At most 15 minutes on 2 cores.

A name that was changed on purpose goes into RENAMED. Exit status: 0 all the same, 1 something differs,
2 it could not be compared.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from hashlib import blake2b
from importlib.metadata import distributions
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track

from benchmarks.compare_speed import files_of
from benchmarks.same_drive import PARTS
from benchmarks.same_list import RUNS, Run
from benchmarks.tables import ROOT, command_line, git
from rti_mpcc.simulation.batch import THREADS

RENAMED: Mapping[str, str] = {
    "STANDS_AT_STAGING_POSE": "STANDS_AT_CUSP",
    "STANDS_BEFORE_SOMETHING": "STANDS_BEFORE_OBSTACLE",
    "LOOKS_SOON": "RETRIES_SOON",
    "TOLD_TO_STAND": "COMMANDED_TO_STAND",
    "PLANS_WAY": "PLANS_ROUTE",
    "NO_WAY": "NO_ROUTE",
    "MISTAKE": "INTERNAL_ERROR",
}
"""Name of a status, source, reason or mission result at BASE -> its name at HEAD."""

DRIVER, LIST = (Path(__file__).with_name(f"same_{name}.py") for name in ("drive", "list"))
Digests = dict[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """One of the two trees.

    Attributes:
        name: BASE or HEAD; python: its interpreter; tree: its files.
        renamed: name at this side -> name at HEAD.
    """

    name: str
    python: str
    tree: Path
    renamed: Mapping[str, str]

    def run(self, file: Path, *arguments: str, given: str) -> Iterator[str]:
        """Lines that a file of this directory prints, run with the tree. Raises SystemExit(2) if it fails."""
        environment = {**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONPATH": str(self.tree)}
        with tempfile.TemporaryFile("w+") as errors, tempfile.TemporaryFile("w+") as standard_input:
            standard_input.write(given)
            standard_input.seek(0)
            with subprocess.Popen(
                [self.python, "-P", str(file), *arguments],
                cwd=self.tree,
                env=environment,
                stdin=standard_input,
                stdout=subprocess.PIPE,
                stderr=errors,
                text=True,
            ) as process:
                assert process.stdout is not None
                try:
                    yield from process.stdout
                except BaseException:
                    process.terminate()
                    raise
            if process.returncode:
                errors.seek(0)
                raise CannotCompare(f"{self.name}: {(errors.read().strip() or 'it ended').splitlines()[-1]}")

    def drive(self, runs: Sequence[Run], problems: Path, jobs: int) -> Iterator[Digests]:
        """The digests of the runs, as they come."""
        given = [
            asdict(run) | {"scenario": run.scenario or str(problems / f"{run.name}.toml")} for run in runs
        ]
        lines = self.run(DRIVER, str(jobs), given=json.dumps({"runs": given, "renamed": dict(self.renamed)}))
        found = track(
            lines, total=len(runs), description=self.name, console=Console(stderr=True), transient=True
        )
        yield from map(json.loads, found)


class CannotCompare(Exception):
    """One of the sides cannot be driven."""


def python_of(tree: Path, folder: Path) -> str:
    """An interpreter that has the libraries of the tree: the present one, or one of a new environment."""
    wanted, present = (
        set(tomllib.loads((each / "pyproject.toml").read_text(encoding="utf-8"))["project"]["dependencies"])
        for each in (tree, ROOT)
    )
    if wanted <= present:
        return sys.executable
    python = folder / "bin" / "python"
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    subprocess.run([str(python), "-m", "pip", "install", "--quiet", *sorted(wanted)], check=True)
    return str(python)


def generate(sides: Sequence[Side], names: Sequence[str], problems: Path, jobs: int) -> None:
    """Write the files of the random problems that are missing, by the first side that can."""
    missing = [name for name in names if not (problems / f"{name}.toml").exists()]
    if not missing:
        return
    problems.mkdir(parents=True, exist_ok=True)
    failed = []
    for side in sides:
        try:
            list(side.run(LIST, str(problems), str(jobs), given="\n".join(missing)))
            return
        except CannotCompare as error:
            failed.append(str(error))
    raise CannotCompare("no random problems; " + "; ".join(failed))


def difference(base: Digests, head: Digests) -> str:
    """What differs between the digests of a run, in one line; "" where they are the same."""
    if "raised" in base or "raised" in head:
        return ", ".join(
            f"{name} raised {side['raised']}"
            for name, side in (("BASE", base), ("HEAD", head))
            if "raised" in side
        )
    parts = [name for name in PARTS if base[name] != head[name]]
    if not parts:
        return ""
    before, after = (
        [side["cycles"][i : i + 4] for i in range(0, len(side["cycles"]), 4)] for side in (base, head)
    )
    pairs = enumerate(zip(before, after, strict=False))
    first = next((i for i, (one, other) in pairs if one != other), min(len(before), len(after)))
    times = max(base["times"], head["times"], key=len)
    lengths = "" if len(before) == len(after) else f", {len(before)} cycles -> {len(after)}"
    return f"differs in {', '.join(parts)}, first in cycle {first} (t = {times[first]:.2f} s){lengths}"


def key_of(commit: str) -> str:
    """Of what was driven at a commit: the commit, this list, the driver, the installed libraries."""
    content = blake2b(DRIVER.read_bytes() + LIST.read_bytes() + sys.version.encode(), digest_size=6)
    for version in sorted(f"{each.name}=={each.version}" for each in distributions()):
        content.update(version.encode())
    return f"{commit[:12]}-{content.hexdigest()}"


def commit_of(base: str) -> str:
    """The full name of a commit. Raises CannotCompare for one that is not there."""
    if (found := git("rev-parse", "--verify", f"{base}^{{commit}}")) is None:
        raise CannotCompare(f"{base}: no commit of this repository")
    return found


def compare(base: str, runs: Sequence[Run], jobs: int, keep: Path | None) -> int:
    """Drive both sides, print what differs, and return the exit status. Raises CannotCompare."""
    commit = commit_of(base)
    with ExitStack() as stack:
        tree = stack.enter_context(files_of(commit))
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        kept = (keep or scratch) / key_of(commit)
        kept.mkdir(parents=True, exist_ok=True)
        there = Side(name="BASE", python=python_of(tree, scratch / "venv"), tree=tree, renamed=RENAMED)
        here = Side(name="HEAD", python=sys.executable, tree=ROOT, renamed={})
        problems = kept / "problems"
        generate((there, here), [run.name for run in runs if not run.scenario], problems, jobs)
        file = kept / "base.jsonl"
        lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
        digests = {found["name"]: found for found in map(json.loads, lines)}
        missing = [run for run in runs if run.name not in digests]
        for found in there.drive(missing, problems, jobs) if missing else ():
            digests[found["name"]] = found
            with file.open("a", encoding="utf-8") as out:
                out.write(json.dumps(found) + "\n")
        same = 0
        for found in here.drive(runs, problems, jobs):
            said = difference(digests[found["name"]], found)
            same += not said
            if said:
                print(f"{found['name']}: {said}", flush=True)
    print(f"{same} of {len(runs)} the same")
    if same == len(runs) == len(RUNS):
        print(f"Figures: unchanged since {commit[:10]} (benchmarks.same: {same} of {len(runs)})")
    return int(same < len(runs))


def main() -> int:
    parser = command_line(__doc__, "python -m benchmarks.same")
    parser.add_argument("base", nargs="?", metavar="BASE", help="commit to compare with")
    parser.add_argument("--only", metavar="NAME", default="", help="only runs with NAME in their names")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="number of processes (default: 2)")
    parser.add_argument(
        "--keep",
        type=Path,
        metavar="DIR",
        help="keep the problems and the digests of BASE in DIR, and reuse those that are there",
    )
    parser.add_argument("--list", action="store_true", help="print the names of all runs")
    asked = parser.parse_args()
    runs = [run for name, run in RUNS.items() if asked.only in name]
    if asked.list:
        print("\n".join(run.name for run in runs))
        return 0
    if not asked.base or not runs:
        print(
            "BASE is missing" if runs else f"--only {asked.only}: no run has this in its name",
            file=sys.stderr,
        )
        return 2
    try:
        return compare(asked.base, runs, max(asked.jobs, 1), asked.keep)
    except CannotCompare as error:
        print(error, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
