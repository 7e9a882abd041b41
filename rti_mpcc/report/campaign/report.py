"""The report of a campaign: all sections, and its files report.html and report.json."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rich.table import Table as ConsoleTable

from rti_mpcc.recording import Machine
from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.difficulty import COURSE, DISTURBANCES
from rti_mpcc.report.campaign.figures import overall
from rti_mpcc.report.campaign.losses import losses
from rti_mpcc.report.campaign.pairs import Pairs
from rti_mpcc.report.campaign.pairs_section import pairs_section, sentences
from rti_mpcc.report.campaign.sections import (
    difficulty_section,
    in_short,
    outcome_section,
    overall_table,
    settings_section,
    short_section,
)
from rti_mpcc.report.campaign.worst import worst_cases
from rti_mpcc.report.campaign.worst_section import worst_section
from rti_mpcc.report.content import Section, say
from rti_mpcc.report.page import html_page

PAGE, NUMBERS = "report.html", "report.json"
_DIFFICULTIES = (
    (COURSE, "course", "Against the course"),
    (DISTURBANCES, "disturbances", "Against what disturbs"),
)


class Report(NamedTuple):
    """What was written, its outcome in a few sentences, and its table for a terminal."""

    files: tuple[Path, ...]
    told: tuple[str, ...]
    table: ConsoleTable


def write_report(
    campaign: Campaign,
    folder: Path,
    *,
    pairs: Pairs | None = None,
    worst: int = 10,
    progress: Callable[[int, int], None] | None = None,
) -> Report:
    """Drive the worst cases again and write page and numbers into an existing folder. Raises OSError.

    Args:
        pairs: with another campaign, to compare with; worst: so many of the worst cases are shown;
        progress: told (done, in all) after each case that was driven again.
    """
    figures = {**overall(campaign), "losses": losses(campaign)}
    sections = [short_section(campaign, figures), outcome_section(campaign, figures)]
    numbers: dict[str, Any] = {**figures, "settings": campaign.settings, "difficulty": {}}
    for scales, name, title in _DIFFICULTIES:
        against = difficulty_section(campaign, scales, name=name, title=title)
        if against is not None:
            sections.append(against.section)
            numbers["difficulty"] |= against.told
    told = in_short(figures)
    if pairs is not None:
        comparison = pairs_section(pairs)
        sections.append(comparison.section)
        numbers["against"] = comparison.told
        told += sentences(pairs, comparison.told)
    if worst:
        shown = worst_section(campaign, worst_cases(campaign, worst), progress)
        sections.append(shown.section)
        numbers["worst"] = shown.told
    sections.append(_made(campaign))
    numbers |= {"told": told, "report_versions": Machine.here().versions}
    files = (folder / PAGE, folder / NUMBERS)
    files[0].write_text(html_page(f"Campaign {campaign.name}", sections), encoding="utf-8")
    text = json.dumps(numbers, indent=2, allow_nan=False, ensure_ascii=False)
    files[1].write_text(text + "\n", encoding="utf-8")
    return Report(files, tuple(told), console_table(campaign, figures))


def _made(campaign: Campaign) -> Section:
    """Settings, and what made the page."""
    section = settings_section(campaign.settings)
    versions = ", ".join(f"{name} {value}" for name, value in Machine.here().versions.items() if value)
    made = say(f"This page was made by `rti-mpcc campaign-report` with {versions}.")
    return Section(name=section.name, title=section.title, blocks=[*section.blocks, made])


def console_table(campaign: Campaign, figures: dict[str, Any]) -> ConsoleTable:
    """The figures of the campaign for a terminal."""
    settings = campaign.settings
    table = ConsoleTable(
        title=f"{campaign.name}: {settings['level']}, seed {settings['seed']}, method {settings['method']}, "
        f"preset {settings['preset']}",
        title_justify="left",
    )
    table.add_column("", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    for name, value in overall_table(figures).rows:
        table.add_row(name.replace("[", r"\["), value)
    return table
