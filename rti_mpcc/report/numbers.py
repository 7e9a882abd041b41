"""Figures by their paths, and numbers and words for tables that people read."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def figure(figures: Mapping[str, Any], path: str) -> float | None:
    """The figure at a path in a summary, such as "energy.acceleration"; None where there is none."""
    found: Any = figures
    for name in path.split("."):
        found = (found or {}).get(name)
    return None if found is None else float(found)


def number(value: float | None, digits: int) -> str:
    """A number for a table; what was never reached is a dash, what rounds to zero has no sign."""
    return "–" if value is None or value != value else f"{value:z.{digits}f}".replace("-", "−")


def percent(share: float) -> str:
    """A share in percent; nothing but the whole is rounded to 100 %, nothing but none to 0."""
    told = number(100.0 * share, 2)
    if share < 1.0 and told == "100.00":
        return "99.99 %"
    return "0.01 %" if share > 0.0 and told == "0.00" else f"{told} %"


def counted(count: int, word: str) -> str:
    """A number of things by their word, which gets an s unless it is one."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"


def in_words(name: str) -> str:
    """A name of the program for people."""
    return name.replace("_", " ")
