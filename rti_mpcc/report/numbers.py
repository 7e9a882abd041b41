"""Numbers for tables that people read."""

from __future__ import annotations


def number(value: float | None, digits: int) -> str:
    """A number for a table; what was never reached is a dash, what rounds to zero has no sign."""
    return "–" if value is None else f"{value:z.{digits}f}".replace("-", "−")


def counted(count: int, word: str) -> str:
    """A number of things by their word, which gets an s unless it is one."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
