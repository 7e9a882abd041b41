"""What the tests of pages share: a parser that wants every tag closed, and keeps what a browser fetches."""

from __future__ import annotations

from html.parser import HTMLParser
from pathlib import Path

from benchmarks.pictures import browser


class Wellformed(HTMLParser):
    """Every tag is closed in its turn; keeps what a browser would fetch, and the cells of tables."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.fetched: list[str] = []
        self.text: list[str] = []
        self._caption = 0
        self.tables: list[tuple[str, list[list[str]]]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in ("meta", "img", "input"):
            self.open.append(tag)
        if tag == "table":
            self.tables.append((" ".join("".join(self.text[self._caption :]).split()), []))
        elif tag == "tr":
            self.tables[-1][1].append([])
        elif tag in ("th", "td"):
            self.tables[-1][1][-1].append("")
        elif ("class", "caption") in attrs:
            self._caption = len(self.text)
        self.fetched += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)
        if {"th", "td"} & set(self.open):
            self.tables[-1][1][-1][-1] += data

    def rows_below(self, caption: str) -> list[list[str]]:
        """Cells of the one table whose caption begins so behind its number, its heads first."""
        (found,) = [rows for told, rows in self.tables if told.partition(". ")[2].startswith(caption)]
        return found


def parsed(page: str) -> Wellformed:
    parser = Wellformed()
    parser.feed(page)
    parser.close()
    assert parser.open == []
    return parser


def browsed(page: Path, folder: Path, cycle: str = "") -> str:
    """The page as a browser has it in the end, without an error on its console."""
    flags = "--disable-gpu --disable-dev-shm-usage --enable-logging=stderr --dump-dom"
    done = browser(*flags.split(), f"--user-data-dir={folder / 'profile'}", f"{page.as_uri()}{cycle}")
    assert "CONSOLE" not in done.stderr
    return done.stdout
