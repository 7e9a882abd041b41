"""The page of the report: the sections in `sections.html`, in the frame that the package's own pages have."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.reproduction.content import Section
from rti_mpcc.report.page import rendered


def html_page(title: str, sections: Sequence[Section]) -> str:
    """The whole page: title, table of contents, sections. Tables and figures are numbered in order."""
    return rendered("sections.html", title, Path(__file__).parent, given=sections)
