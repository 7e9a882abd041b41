"""Writes the tables of docs/campaigns.md from campaigns that were driven.

    rti-mpcc campaign --count 1000 --level nominal --seed 1 --out runs/nominal
    python -m benchmarks.tabulate_campaigns runs/nominal runs/noisy runs/nominal-separated

A row for each folder; how smooth the rides of each are; and for each one of another method or preset than the
first one's a comparison of the first one of its level with it, on the cases that both dock. Figures as in
report.json of `campaign-report`.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks.tables import ROOT, number, origin, replace_block, table, told
from rti_mpcc.report.campaign.figures import overall
from rti_mpcc.report.campaign.losses import losses
from rti_mpcc.report.campaign.pairs import compared, paired
from rti_mpcc.report.campaign.rows import Campaign, read_campaign
from rti_mpcc.report.campaign.words import COMFORT, TAIL, several
from rti_mpcc.simulation.campaign.settings import source_digest

COMMAND = "python -m benchmarks.tabulate_campaigns"
HEADER = [
    "level",
    "method, preset",
    "cases",
    "docked [%]",
    "95 % interval",
    "collisions",
    "least clearance [m]",
    "time to dock p50 / p95 [s]",
    "refused results driven",
    "cases with fallback",
    "not docked, or collided",
]
COMPARED = [
    "level",
    "compared with",
    "both dock of common",
    "only the first",
    "only the other",
    "time to dock, ratio p25 / p50 / p75",
    "∫a², ratio p50",
]


def row(campaign: Campaign) -> list[str]:
    """Of the first table."""
    figures, asked = overall(campaign), campaign.asked
    lost = [(index, group["outcome"]) for group in losses(campaign) for index in group["index"]]
    low, high = figures["success_interval"]
    return [
        asked.level.value,
        f"{asked.method}, {asked.preset}",
        f"{figures['cases']:,}",
        number(100.0 * figures["success_rate"], 2),
        f"{100.0 * low:.2f} to {100.0 * high:.2f}",
        str(figures["collisions"]),
        number(figures["min_clearance_m"], 3),
        f"{number(figures['time_to_dock_p50'], 1)} / {number(figures['time_to_dock_p95'], 1)}",
        str(figures["failures_driven"]),
        str(figures["fallback_cases"]),
        ", ".join(f"{index} {outcome}" for index, outcome in sorted(lost)) or "–",
    ]


def rides(campaigns: Sequence[Campaign]) -> str:
    """How smooth the rides are: a column for each campaign, percentiles and the largest."""
    columns = [overall(campaign) for campaign in campaigns]
    asked = [campaign.asked for campaign in campaigns]
    header = ["p50 / p95 / p99 / most", *(f"{it.level.value}, {it.method}, {it.preset}" for it in asked)]
    rows = [
        *(
            [f"peak {words} over comfort", *(several(it["comfort"][name], TAIL, 2) for it in columns)]
            for name, words in COMFORT.items()
        ),
        ["acceleration energy over the least", *(several(it["energy_ratio"], TAIL, 2) for it in columns)],
        ["time to dock over the one expected", *(several(it["time_ratio"], TAIL, 2) for it in columns)],
        ["cycles with a QP at its iteration limit [%]", *(_at_limit(it) for it in columns)],
    ]
    return table(header, rows)


def _at_limit(figures: dict[str, Any]) -> str:
    cycles = sum(figures["cycles_by_status"].values())
    return number(100.0 * figures["iteration_limit_cycles"] / cycles, 4)


def comparison(first: Campaign, other: Campaign) -> list[str]:
    """Of the second table."""
    figures: dict[str, Any] = compared(paired(first, other))
    times, energies = figures["ratios"]["time_to_dock_s"], figures["ratios"]["energy_to_dock.acceleration"]
    return [
        first.asked.level.value,
        f"{other.asked.method}, {other.asked.preset}",
        f"{figures['docked_both']:,} of {figures['common']:,}",
        str(figures["docked_first_only"]),
        str(figures["docked_second_only"]),
        " / ".join(number(times[name], 2) for name in ("p25", "p50", "p75")),
        number(energies["p50"], 2),
    ]


def tables(campaigns: Sequence[Campaign]) -> str:
    """All of them."""
    usual = campaigns[0].asked
    found = [table(HEADER, [row(campaign) for campaign in campaigns]), rides(campaigns)]
    rows = []
    for other in campaigns:
        if (other.asked.method, other.asked.preset) == (usual.method, usual.preset):
            continue
        same_level = (each for each in campaigns if each.asked.level is other.asked.level)
        rows.append(comparison(next(same_level), other))
    return "\n\n".join([*found, *([table(COMPARED, rows)] if rows else [])])


def main() -> None:
    parser = argparse.ArgumentParser(description="Writes the tables of docs/campaigns.md.")
    parser.add_argument("folders", type=Path, nargs="+")
    folders = parser.parse_args().folders
    campaigns = [read_campaign(folder) for folder in folders]
    sources = {campaign.settings["versions"]["source"] for campaign in campaigns}
    if sources != {source_digest()}:
        raise SystemExit(f"driven by other code than this: {', '.join(sorted(sources - {source_digest()}))}")
    text = f"{tables(campaigns)}\n\n{told(origin(COMMAND))}"
    replace_block(ROOT / "docs" / "campaigns.md", "campaigns", text)
    print(text)


if __name__ == "__main__":
    main()
