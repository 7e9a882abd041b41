"""Output of a command on the terminal: progress, tables, lines, warnings."""

from __future__ import annotations

import logging
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

Advance = Callable[[float, float], None]
"""Called with the work done and all of it."""
_TABLE_WIDTH = 120


@contextmanager
def progress_bar(name: str, done: str) -> Iterator[Advance | None]:
    """On a terminal a bar, told by (done, in all), with `done` as its text; None elsewhere."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = TextColumn(name), BarColumn(), TextColumn(done), TimeElapsedColumn(), TimeRemainingColumn()
    with Progress(*columns, console=console, transient=True, refresh_per_second=4) as bar:
        task = bar.add_task("", total=None)
        yield lambda completed, total: bar.update(task, completed=completed, total=total)


def tell_tables(tables: Sequence[Table]) -> None:
    """Print tables. Piped into a file they keep their width: a guess of 80 columns would cut them."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=_TABLE_WIDTH)
    for table in tables:
        console.print(table)


def tell_lines(lines: Sequence[str]) -> None:
    """Print sentences as they are; what is code in a page has no backticks here."""
    console = Console(highlight=False)
    for line in lines:
        console.print(line.replace("`", ""), markup=False, soft_wrap=True)


def tell_written(files: Sequence[Path]) -> None:
    """Print which files were written."""
    tell_lines([f"written: {', '.join(map(str, files))}"])


@contextmanager
def warnings_on_stderr(program: str) -> Iterator[None]:
    """Show the package's log from warnings up while a command runs."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setLevel(logging.WARNING)
    handler.setFormatter(logging.Formatter(f"{program}: warning: %(message)s"))
    # The controller tells again what the check of the file has told with the file's name.
    handler.addFilter(lambda record: record.name != "rti_mpcc.planning.surroundings")
    logger = logging.getLogger("rti_mpcc")
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
