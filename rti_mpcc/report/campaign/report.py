"""The report of a campaign: report.html, by the template campaign.html, and report.json."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from math import degrees
from pathlib import Path
from typing import Any, NamedTuple

from rich.table import Table as ConsoleTable

from rti_mpcc.recording import Machine
from rti_mpcc.report.campaign import difficulty, pictures
from rti_mpcc.report.campaign.figures import overall
from rti_mpcc.report.campaign.losses import losses
from rti_mpcc.report.campaign.pairs import RATIOS, Pairs, compared, sentences
from rti_mpcc.report.campaign.rows import Campaign
from rti_mpcc.report.campaign.words import in_short, overall_rows, several
from rti_mpcc.report.campaign.worst import shown, told, worst_cases
from rti_mpcc.report.page import rendered

PAGE, NUMBERS = "report.html", "report.json"
_DIFFICULTIES = {
    "course": ("the course", difficulty.COURSE),
    "scene": ("the scene", difficulty.SCENE),
    "disturbances": ("what disturbs", difficulty.DISTURBANCES),
}
_OF_OTHERS = {True: "course", False: "scene"}
"""What there is none of in a campaign of scenes, and in one of courses."""
Progress = Callable[[int, int], None]


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
    progress: Progress | None = None,
) -> Report:
    """Drive the worst cases again and write page and numbers into an existing folder. Raises OSError.

    Args:
        pairs: with another campaign, to compare with; worst: so many of the worst cases are shown;
        progress: told (done, in all) after each case that was driven again.
    """
    figures = {**overall(campaign), "losses": losses(campaign)}
    said, versions = in_short(figures), Machine.here().versions
    names = [name for name in _DIFFICULTIES if name != _OF_OTHERS[campaign.of_scenes]]
    difficulties = list(filter(None, (_difficulty(campaign, name) for name in names)))
    kinds = difficulty.kinds(campaign.rows)
    against = _against(pairs)
    cases = _worst(campaign, worst, progress)
    page = rendered(
        "campaign.html",
        f"Campaign {campaign.name}",
        campaign=campaign,
        settings=campaign.settings,
        figures=figures,
        said=said,
        overall=overall_rows(figures),
        spread=pictures.spread_figure(campaign.rows),
        difficulties=difficulties,
        kinds=kinds,
        **against,
        **cases,
        versions=versions,
        degree=degrees(1.0),
        several=several,
        named=_named,
    )
    sentences_told = [*said, *against["compared"]]
    numbers = {
        **figures,
        "settings": campaign.settings,
        "difficulty": {
            scale.column: difficulty.told(table) for one in difficulties for scale, table in one["bins"]
        },
        **({"kinds": kinds} if kinds else {}),
        **({} if pairs is None else {"against": against["against"]}),
        **({"worst": cases["worst"]} if worst else {}),
        "told": sentences_told,
        "report_versions": versions,
    }
    files = (folder / PAGE, folder / NUMBERS)
    files[0].write_text(page, encoding="utf-8")
    text = json.dumps(numbers, indent=2, allow_nan=False, ensure_ascii=False)
    files[1].write_text(text + "\n", encoding="utf-8")
    return Report(files, tuple(sentences_told), console_table(campaign, figures))


def _difficulty(campaign: Campaign, name: str) -> dict[str, Any] | None:
    """Success and time over the scales of one kind; None where none varies."""
    rows, (title, scales) = campaign.rows, _DIFFICULTIES[name]
    bins = [(scale, difficulty.bins(rows, scale)) for scale in difficulty.varying(rows, scales)]
    if not bins:
        return None
    success, time = pictures.success_figure(rows, bins), pictures.time_figure(bins)
    return {"name": name, "title": title, "bins": bins, "success": success, "time": time}


def _against(pairs: Pairs | None) -> dict[str, Any]:
    """The comparison, where there is one."""
    if pairs is None:
        return {"pairs": None, "against": None, "compared": []}
    figures = compared(pairs)
    return {
        "pairs": pairs,
        "against": figures,
        "compared": sentences(pairs, figures),
        "against_picture": pictures.pairs_figure(pairs),
        "ratios": RATIOS,
        "lost": sorted(figures["lost_by_first"] + figures["lost_by_second"]),
    }


def _worst(campaign: Campaign, count: int, progress: Progress | None) -> dict[str, Any]:
    """The worst cases, driven again as the page is written."""
    if not count:
        return {"worst": None}
    cases = told(campaign, worst_cases(campaign.rows, count))
    return {"worst": cases, "shown": shown(campaign, cases, progress)}


def _named(values: Mapping[str, str | None]) -> str:
    return ", ".join(f"{name} {value}" for name, value in values.items() if value)


def console_table(campaign: Campaign, figures: dict[str, Any]) -> ConsoleTable:
    """The figures of the campaign for a terminal."""
    settings = campaign.settings
    table = ConsoleTable(
        title=f"{campaign.name}: {settings['problems']}, {settings['level']}, seed {settings['seed']}, "
        f"method {settings['method']}, preset {settings['preset']}",
        title_justify="left",
    )
    table.add_column("", no_wrap=True)
    table.add_column("value", justify="right", no_wrap=True)
    for name, value in overall_rows(figures):
        table.add_row(name.replace("[", r"\["), value)
    return table
