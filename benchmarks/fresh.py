"""Whether the tables and pictures of the docs are those of the present code; measures them anew.

    python -m benchmarks.fresh             # says which are out of date
    python -m benchmarks.fresh --measure   # `make figures`: runs the commands whose figures are
    python -m benchmarks.fresh --measure --all   # runs all of these commands

A figure is out of date if a commit after its own changed files that it measures. A commit that changes no
figure says so by a line at the end of its message, after a run of `benchmarks.same`, which prints this line:

    Figures: unchanged since BASE (benchmarks.same: 330 of 330)

It counts for all commits from BASE up to this one, for figures of BASE and of earlier commits. Without
`since BASE` it counts for this one commit. In brackets stands what shows it. `benchmarks.same` compares
commands and plans: a change of metrics or of pictures needs a new measurement.

What takes longer is measured with each release (`DATED`): its age is printed, and fails nothing. Exit status:
0 nothing is out of date, 1 something is, or a command failed.
"""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from time import monotonic

from benchmarks.tables import ORIGIN, ROOT, command_line, git
from rti_mpcc.simulation.batch import THREADS

PACKAGES = ("geometry", "estimation", "rti_mpcc")
SHOWN = ("rti_mpcc/report", "rti_mpcc/cli", "rti_mpcc/recording")
"""What tables do not measure: it shows and keeps what was driven."""
MEASURED: Mapping[str, Sequence[str]] = {
    "Measured": (*PACKAGES, *(f":!{path}" for path in SHOWN)),
    "Made": (*PACKAGES, "examples", ":!rti_mpcc/cli", ":!rti_mpcc/recording"),
}
"""The files that a figure measures, as git names them: those of tables, and those of pictures."""
COURSES = "python -m benchmarks.measure_courses"
PICTURES = "python -m benchmarks.pictures"
COMMANDS = (
    "python -m benchmarks.document_behaviour",
    PICTURES,
    "python -m benchmarks.measure_results",
    "python -m benchmarks.measure_detections",
    "python -m benchmarks.measure_deviations",
    "python -m benchmarks.measure_faults",
    "python -m benchmarks.measure_obstacles",
    *(f"{COURSES} --seed {seed} --count 24 --within course --presets default paper" for seed in (1, 2, 3)),
    f"{COURSES} --seed 1 --count 48 --within campaign --presets default",
)
"""What `make figures` runs, in this order: an hour at most on two cores."""
DATED: Mapping[str, str] = {
    "docking_noisy --seed 3 --page": "a browser",
    "benchmarks.tabulate_campaigns": "hours",
    "benchmarks.optimum": "hours",
    "benchmarks.measure_missions": "half an hour",
    "benchmarks.foreign_faults": "half an hour",
    "benchmarks.measure_speed": "an idle machine",
    "benchmarks.worst_cycles": "an idle machine",
    "benchmarks.fleet": "an idle machine",
    "benchmarks.measure_narrow": "an idle machine",
    "benchmarks.measure_planner": "an idle machine",
    "benchmarks.measure_solver": "an idle machine",
}
"""Part of a command -> what it needs that `make figures` has not. Measured with each release."""
TESTED = ("diagram", "transitions", "statuses", "constants")
"""Blocks that a test compares with the code."""
BLOCK = re.compile(r"<!-- begin (\w+) -->\n(.*?)<!-- end \1 -->", flags=re.DOTALL)
PICTURE = re.compile(r"!\[[^\]]*\]\([^)\s]*?(\w+)\.(?:png|jpg)\)")
DECLARED = re.compile(r"unchanged(?: since (?P<base>\w+))? \(.+\)")
"""The value of a line `Figures:` of a commit's message."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A table or picture of a document.

    Attributes:
        page: its document, relative to the root; block: its name in it.
        done: "Measured" (a table) or "Made" (a picture).
        command: that wrote it; commit, date: of the code, and when.
        changed: whether the code differed from that commit.
    """

    page: str
    block: str
    done: str
    command: str
    commit: str
    date: str
    changed: bool

    @property
    def needs(self) -> str:
        """What its command needs that `make figures` has not, or ""."""
        return next((needs for part, needs in DATED.items() if part in self.command), "")

    @property
    def written_by(self) -> str:
        """The command of `COMMANDS` that writes it."""
        return PICTURES if self.done == "Made" and not self.needs else self.command


def documents(root: Path) -> Iterator[Path]:
    """README and all pages."""
    yield root / "README.md"
    yield from sorted((root / "docs").rglob("*.md"))


def figures_of(root: Path) -> tuple[list[Figure], list[str]]:
    """All figures of the documents, and what has no origin."""
    found, without = [], []
    for page in documents(root):
        text, name = page.read_text(encoding="utf-8"), page.relative_to(root).as_posix()
        blocks = dict(BLOCK.findall(text))
        without += [f"{name}: {one}.*, a picture" for one in PICTURE.findall(text) if one not in blocks]
        for block, content in blocks.items():
            if origin := ORIGIN.search(content):
                told = origin.groupdict()
                changed = told.pop("changed") is not None
                found.append(Figure(page=name, block=block, changed=changed, **told))
            elif block not in TESTED:
                without.append(f"{name}: {block}")
    return found, without


@dataclass(frozen=True)
class History:
    """The commits of a repository.

    Attributes:
        root: a folder of it.
    """

    root: Path

    def git(self, *arguments: str) -> str | None:
        """What git prints there; None if it fails, or is not there."""
        return git(*arguments, root=self.root)

    def knows(self, commit: str) -> bool:
        """Whether HEAD comes after this commit, or is it."""
        return self.git("merge-base", "--is-ancestor", commit, "HEAD") is not None

    @property
    def shallow(self) -> bool:
        """Whether a part of it is missing."""
        return self.git("rev-parse", "--is-shallow-repository") != "false"

    @cached_property
    def declared(self) -> list[tuple[str, str | None]]:
        """Each commit that declares that figures are unchanged, and since which."""
        lines = self.git("log", "--format=%H %(trailers:key=Figures,valueonly,unfold,separator=%x20)", "HEAD")
        pairs = (line.partition(" ")[::2] for line in (lines or "").splitlines())
        found = ((commit, DECLARED.fullmatch(said.strip())) for commit, said in pairs)
        return [(commit, match["base"]) for commit, match in found if match]

    def excused(self, commit: str) -> set[str]:
        """Commits that change no figure of `commit`."""
        found = set()
        for declaring, base in self.declared:
            if base is None:
                found.add(declaring)
            elif self.git("merge-base", "--is-ancestor", commit, base) is not None:
                found |= set((self.git("rev-list", f"{base}..{declaring}") or "").split())
        return found

    def changes(self, commit: str, paths: Sequence[str]) -> list[str]:
        """The commits after `commit` that changed the paths, latest first, but for those excused."""
        later = (self.git("log", "--format=%H", f"{commit}..HEAD", "--", *paths) or "").split()
        excused = self.excused(commit) if later else set()
        return [each for each in later if each not in excused]

    def same(self, commit: str, paths: Sequence[str]) -> bool:
        """Whether the files of the paths are those of `commit`."""
        return self.git("diff", "--quiet", commit, "--", *paths) is not None

    def title(self, commit: str) -> str:
        """Short name and first line of the message."""
        return self.git("log", "-1", "--format=%h %s", commit) or commit


def out_of_date(figure: Figure, history: History) -> tuple[str, str]:
    """Why, or "", and the latest change."""
    if figure.changed:
        return "the code had local changes", ""
    if not history.knows(figure.commit):
        return "" if history.shallow else "no such commit before HEAD", ""
    later = history.changes(figure.commit, MEASURED[figure.done])
    return (f"{len(later)} later changes", f", the last: {history.title(later[0])}") if later else ("", "")


def check(root: Path = ROOT) -> int:
    """Print what is out of date, and the age of what is dated; returns the exit status."""
    history, (found, without) = History(root), figures_of(root)
    if not any(history.knows(figure.commit) for figure in found):
        print("figures: not checked, as this is not a clone with their commits")
        return 0
    dated, fresh, old = Counter[str](), 0, Counter[str]()
    for figure in found:
        why, later = out_of_date(figure, history)
        written = f"{figure.written_by}, commit {figure.commit} of {figure.date}"
        if figure.needs:
            dated[f"{written}: {why or 'nothing changed'} (needs {figure.needs})"] += 1
        elif why:
            old[f"{written}: {why}{later}"] += 1
        else:
            fresh += 1
    for lines, kind in ((dated, "dated"), (old, "OUT OF DATE")):
        for line, count in lines.items():
            print(f"{kind}, {count} by {line}")
    for each in without:
        print(f"OUT OF DATE, {each}: no command and commit")
    print(f"figures: {fresh} up to date, {old.total() + len(without)} out of date, {dated.total()} dated")
    if history.shallow:
        print("figures of commits that this shallow clone does not have: not checked")
    return int(bool(old or without))


def measure(root: Path, commands: Sequence[str] = COMMANDS, *, everything: bool) -> int:
    """Run the commands, or those whose figures are not of the present files; returns the exit status."""
    history, failed = History(root), []
    for command in commands:
        mine = [each for each in figures_of(root)[0] if each.written_by == command]
        if not everything and mine and all(_present(each, history) for each in mine):
            print(f"== {command}: measured already", flush=True)
            continue
        begun = monotonic()
        program, *arguments = shlex.split(command)
        assert program == "python"
        environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
        done = subprocess.run([sys.executable, *arguments], cwd=root, env=environment)
        print(f"== {command}: {monotonic() - begun:.0f} s, exit status {done.returncode}", flush=True)
        failed += [command] * (done.returncode != 0)
    print(f"failed: {failed or 'none'}")
    return int(bool(failed))


def _present(figure: Figure, history: History) -> bool:
    return not figure.changed and history.same(figure.commit, MEASURED[figure.done])


def main() -> int:
    parser = command_line(__doc__, "python -m benchmarks.fresh")
    parser.add_argument(
        "--measure", action="store_true", help="run the commands whose figures are out of date"
    )
    parser.add_argument("--all", action="store_true", help="with --measure: run all commands")
    asked = parser.parse_args()
    return measure(ROOT, everything=asked.all) if asked.measure else check()


if __name__ == "__main__":
    sys.exit(main())
