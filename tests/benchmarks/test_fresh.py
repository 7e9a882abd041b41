"""A figure that is older than the code fails; a commit that declares to change no figure ages none."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from benchmarks.fresh import COMMANDS, check, figures_of, measure
from benchmarks.pictures import PICTURES
from benchmarks.tables import ROOT, named

STUDY = "python -m benchmarks.measure_results"
DECLARED = "Refactored\n\nFigures: unchanged{} (benchmarks.same: 330 of 330)"
Printed = pytest.CaptureFixture[str]


class Repository:
    """A clone with a page; each commit changes one file."""

    def __init__(self, root: Path) -> None:
        self.root, self.changes = root, 0
        self.git("init", "--quiet")
        self.write("README.md", "")
        self.commit("rti_mpcc/docking.py")

    def git(self, *arguments: str) -> str:
        who = ("-c", "user.name=test", "-c", "user.email=test@example.org", "-c", "commit.gpgsign=false")
        done = subprocess.run(["git", *who, *arguments], cwd=self.root, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout.strip()

    def write(self, file: str, text: str) -> None:
        (self.root / file).parent.mkdir(parents=True, exist_ok=True)
        (self.root / file).write_text(text, encoding="utf-8")

    def commit(self, file: str, message: str = "Changed") -> str:
        self.changes += 1
        self.write(file, f"{self.changes}\n")
        self.git("add", "--all")
        self.git("commit", "--quiet", "-m", message)
        return self.git("rev-parse", "--short", "HEAD")

    def figure(
        self, commit: str, command: str = STUDY, done: str = "Measured", *, changed: bool = False
    ) -> None:
        """The page has one figure, of a commit."""
        origin = {"command": command, "commit": commit, "changed": changed, "date": "2026-11-28"}
        self.write(
            "docs/results.md", f"<!-- begin results -->\n{named(origin, done)}\n<!-- end results -->\n"
        )


@pytest.fixture
def repository(tmp_path: Path) -> Repository:
    """With a table of its first commit."""
    found = Repository(tmp_path)
    found.figure(found.git("rev-parse", "--short", "HEAD"))
    return found


def test_a_figure_is_out_of_date_once_the_code_changes(repository: Repository, capsys: Printed) -> None:
    assert check(repository.root) == 0
    assert "1 up to date, 0 out of date, 0 dated" in capsys.readouterr().out
    repository.commit("rti_mpcc/docking.py", "Brakes later")
    assert check(repository.root) == 1
    said = capsys.readouterr().out
    assert f"OUT OF DATE, 1 by {STUDY}" in said
    assert "Brakes later" in said
    repository.figure(repository.git("rev-parse", "--short", "HEAD"))
    assert check(repository.root) == 0


@pytest.mark.parametrize(
    "file", ["docs/using.md", "benchmarks/fresh.py", "rti_mpcc/cli/run.py", "tests/one.py"]
)
def test_what_a_table_does_not_measure_ages_none(repository: Repository, file: str) -> None:
    repository.commit(file)
    assert check(repository.root) == 0


def test_a_picture_shows_the_code_of_the_reports_too(repository: Repository) -> None:
    repository.commit("rti_mpcc/report/overview.py")
    assert check(repository.root) == 0
    repository.figure(repository.git("rev-parse", "--short", "HEAD~1"), "rti-mpcc run docking_behind", "Made")
    assert check(repository.root) == 1


def test_a_commit_that_declares_so_ages_none(repository: Repository) -> None:
    repository.commit("geometry/poses.py", DECLARED.format(""))
    assert check(repository.root) == 0
    repository.commit("geometry/poses.py")
    assert check(repository.root) == 1


def test_a_declaration_may_speak_for_earlier_commits(repository: Repository) -> None:
    base = repository.git("rev-parse", "--short", "HEAD")
    middle = repository.commit("geometry/poses.py")
    repository.commit("estimation/goal.py")
    assert check(repository.root) == 1
    repository.commit("geometry/paths.py", DECLARED.format(f" since {base}"))
    assert check(repository.root) == 0
    repository.figure(middle)  # not compared: what is unchanged since BASE may differ in between
    assert check(repository.root) == 1


@pytest.mark.parametrize(
    "said", ["Figures: unchanged", "Figures: unchanged since abcdef0 (so)", "unchanged (so)"]
)
def test_a_declaration_needs_its_proof_and_a_commit_that_exists(repository: Repository, said: str) -> None:
    repository.commit("geometry/poses.py", f"Refactored\n\n{said}")
    assert check(repository.root) == 1


def test_a_table_of_no_commit_is_out_of_date(repository: Repository, capsys: Printed) -> None:
    commit = repository.git("rev-parse", "--short", "HEAD")
    repository.figure(commit, changed=True)
    assert check(repository.root) == 1
    assert "local changes" in capsys.readouterr().out
    repository.figure(commit)
    page = repository.root / "docs" / "results.md"
    page.write_text(
        page.read_text() + "<!-- begin other -->\n| 1 |\n<!-- end other -->\n![](pictures/run.png)\n"
    )
    assert check(repository.root) == 1
    said = capsys.readouterr().out
    assert "docs/results.md: other: no command and commit" in said
    assert "docs/results.md: run.*, a picture: no command and commit" in said


def test_what_takes_long_is_dated_and_fails_nothing(repository: Repository, capsys: Printed) -> None:
    commit = repository.git("rev-parse", "--short", "HEAD")
    repository.figure(commit, "python -m benchmarks.optimum --seed 3")
    repository.commit("rti_mpcc/docking.py")
    assert check(repository.root) == 0
    said = capsys.readouterr().out
    assert f"commit {commit} of 2026-11-28: 1 later changes (needs hours)" in said


def test_without_the_commits_nothing_is_checked(
    repository: Repository, tmp_path_factory: pytest.TempPathFactory, capsys: Printed
) -> None:
    repository.commit("rti_mpcc/docking.py")
    assert check(repository.root) == 1
    shallow = tmp_path_factory.mktemp("shallow")
    repository.git("clone", "--quiet", "--depth", "1", f"file://{repository.root}", str(shallow))
    assert check(shallow) == 0
    (repository.root / ".git").rename(repository.root / "no_git")
    capsys.readouterr()
    assert check(repository.root) == 0
    assert "not checked" in capsys.readouterr().out


def test_a_commit_that_nobody_has_is_none(repository: Repository, capsys: Printed) -> None:
    known = repository.git("rev-parse", "--short", "HEAD")
    page = repository.root / "docs" / "results.md"
    other = page.read_text().replace("results -->", "other -->").replace(known, "abcdef0")
    page.write_text(page.read_text() + other)
    assert check(repository.root) == 1
    assert "no such commit before HEAD" in capsys.readouterr().out


def test_only_what_is_out_of_date_is_measured_again(repository: Repository, capsys: Printed) -> None:
    command = "python -m study"
    repository.figure(repository.git("rev-parse", "--short", "HEAD"), command)
    repository.write("study.py", "open('driven', 'a').write('x')")
    driven = repository.root / "driven"
    assert measure(repository.root, (command,), everything=False) == 0
    assert not driven.exists()
    assert measure(repository.root, (command,), everything=True) == 0
    repository.commit("rti_mpcc/docking.py")
    assert measure(repository.root, (command,), everything=False) == 0
    assert driven.read_text() == "xx"
    repository.write("study.py", "raise SystemExit(3)")
    assert measure(repository.root, (command,), everything=False) == 1
    assert "exit status 3" in capsys.readouterr().out


def test_each_figure_of_the_docs_is_written_by_a_known_command() -> None:
    found, without = figures_of(ROOT)
    assert without == []
    assert {figure.written_by for figure in found if not figure.needs} <= set(COMMANDS)
    written = {(figure.page, figure.block) for figure in found}
    assert {(picture.page, picture.block) for picture in PICTURES} <= written
