"""What studies share: the command line, Markdown tables in blocks of documents, the origin of figures."""

from __future__ import annotations

import argparse
import importlib.metadata
import json
import os
import platform
import re
import subprocess
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, NamedTuple

from rti_mpcc.report.text import figure
from rti_mpcc.report.text import number as number

ROOT = Path(__file__).parents[1]


class Column(NamedTuple):
    """A figure of `simulation.summary`, by its path in it, with its head and digits."""

    head: str
    path: str
    digits: int


TIMES = (
    Column("to tolerance [s]", "time_to_tolerance_s", 2),
    Column("to dock [s]", "time_to_dock_s", 2),
    Column("clearance [m]", "min_clearance_m", 2),
)
ENERGIES = (
    Column("∫a² [m²/s³]", "energy.acceleration", 2),
    Column("∫δ̇² [rad²/s]", "energy.steering_rate", 2),
    Column("∫a_lat² [m²/s³]", "energy.lateral_acceleration", 2),
)


def cells(run: Mapping[str, Any], columns: Sequence[Column]) -> list[str]:
    """Figures of a run, a dash where there is none."""
    return [number(figure(run, column.path), column.digits) for column in columns]


def heads(columns: Sequence[Column]) -> list[str]:
    """Of the columns."""
    return [column.head for column in columns]


def command_line(description: str | None, command: str) -> argparse.ArgumentParser:
    """The parser of a study, so that `--help` prints its module's docstring and drives nothing."""
    return argparse.ArgumentParser(
        prog=command, description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table; the first column is left-aligned, the others are right-aligned."""
    rule = ["---", *["---:"] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(row) + " |" for row in [header, rule, *rows])


def replace_block(file: Path, name: str, text: str) -> None:
    """Put `text` between `<!-- begin NAME -->` and `<!-- end NAME -->` of a document.

    Raises ValueError where the document has no such block.
    """
    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    head, found_begin, rest = file.read_text(encoding="utf-8").partition(begin)
    _, found_end, tail = rest.partition(end)
    if not (found_begin and found_end):
        raise ValueError(f"{file.name}: needs a block {begin} ... {end}")
    file.write_text(f"{head}{begin}\n{text}\n{end}{tail}", encoding="utf-8")


def publish(page: str, blocks: Mapping[str, str], *, docs: bool) -> None:
    """Print the texts of blocks by their names, and put them into a page of docs/ if they are to be there."""
    for name, text in blocks.items():
        print(f"{text}\n")
        if docs:
            replace_block(ROOT / "docs" / page, name, text)


def write_table(
    file: Path, name: str, header: Sequence[str], rows: Sequence[Sequence[str]], source: dict[str, Any]
) -> None:
    """Replace a block of a document by a table and the sentence of its origin."""
    replace_block(file, name, f"{table(header, rows)}\n\n{named(source)}")


def origin(command: str) -> dict[str, Any]:
    """What measured: command, commit, whether the tree differed from it, date, versions, cores."""
    return {
        "command": command,
        "commit": git("rev-parse", "--short", "HEAD") or "unknown",
        "changed": git("status", "--porcelain", "--", "geometry", "estimation", "rti_mpcc") != "",
        "date": datetime.now(UTC).date().isoformat(),
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in ("osqp", "piqp", "numpy", "scipy")},
        "cores": os.cpu_count(),
    }


def told(origin: dict[str, Any]) -> str:
    """The origin as a sentence."""
    machine = f"Python {origin['python']}, OSQP {origin['osqp']}, {origin['cores']} cores"
    return f"{named(origin)[:-1]} ({machine})."


def named(origin: dict[str, Any], done: str = "Measured") -> str:
    """The origin in short: command, commit and date, as `ORIGIN` reads them again."""
    changed = CHANGED if origin["changed"] else ""
    return f"{done} by `{origin['command']}` at commit {origin['commit']}{changed} on {origin['date']}."


CHANGED = " with local changes"
ORIGIN = re.compile(
    rf"(?P<done>Measured|Made) by `(?P<command>[^`]+)` at commit (?P<commit>\w+)(?P<changed>{CHANGED})?"
    r" on (?P<date>\d{4}-\d{2}-\d{2})"
)
"""The sentence of `named` in a document."""


def write_json(file: Path, content: dict[str, Any]) -> None:
    """Write figures for other programs."""
    file.write_text(json.dumps(content, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def git(*arguments: str, root: Path = ROOT) -> str | None:
    """What git prints in a folder; None if it fails, or is not there."""
    try:
        done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True)
    except FileNotFoundError:
        return None
    return None if done.returncode else done.stdout.strip()
