"""What a page is made of: sections of paragraphs, tables and pictures, as values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from benchmarks.tables import Column


@dataclass(frozen=True, slots=True, kw_only=True)
class Paragraph:
    """Text; what stands between two backticks is code, a letter with an index (q_c, q_N^e) a symbol.

    `verdict`: computed from the runs.
    """

    text: str
    verdict: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Cells as text; the first column holds the names of the rows.

    Attributes:
        caption: stands over it.
        heads: (k,) of the columns.
        rows: of k cells each.
        worded: columns that hold words, by index, besides the first: they are aligned to the left.
        sentences: columns that hold whole sentences, by index: they get room.
        group: so many rows belong together, 0: no groups.
    """

    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    worded: Sequence[int] = ()
    sentences: Sequence[int] = ()
    group: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A picture in a file.

    Attributes:
        name: of the file, without .png.
        png: what is in the file.
        caption: stands below it; told: what is on it, for who cannot see it.
    """

    name: str
    png: bytes
    caption: str
    told: str


Block = Paragraph | Table | Picture


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """One experiment.

    Attributes:
        name: anchor in the page, and key of `figures` in the JSON file.
        title: of the section.
        blocks: in order.
        figures: all measured numbers in it, for JSON.
    """

    name: str
    title: str
    blocks: Sequence[Block]
    figures: Any = None


def say(text: str) -> Paragraph:
    """A paragraph of prose."""
    return Paragraph(text=text)


def found(text: str) -> Paragraph:
    """A paragraph whose numbers come from the runs."""
    return Paragraph(text=text, verdict=True)


PAPER = (
    Column("T [s]", "time_to_tolerance_s", 2),
    Column("reversals", "direction_changes", 0),
    Column("rms δ [rad]", "rms.steering", 3),
    Column("rms δ̇ [rad/s]", "rms.steering_rate", 3),
    Column("rms a [m/s²]", "rms.acceleration", 3),
    Column("rms a_lat [m/s²]", "rms.lateral_acceleration", 3),
)
"""In the order of the paper's tables."""


BEYOND = (
    Column("dock [s]", "time_to_dock_s", 2),
    Column("clearance [m]", "min_clearance_m", 2),
    Column("∫δ̇² [rad²/s]", "energy.steering_rate", 3),
    Column("∫a² [m²/s³]", "energy.acceleration", 3),
    Column("∫a_lat² [m²/s³]", "energy.lateral_acceleration", 3),
)
