"""Writes the tables of docs/campaigns.md from studies that were driven.

    python -m benchmarks.campaign --count 1000 --level nominal --seed 1 --out runs/nominal
    python -m benchmarks.tabulate_campaigns runs/nominal runs/noisy runs/nominal-separated

A row for each folder, and how smooth the rides of each are: figures as in its report.json. Two methods or
versions are compared case by case by `benchmarks.compare_campaigns`. With `--difficulty` it prints how often
the cases of each folder docked, and how soon, against each quantity that was drawn.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from benchmarks.tables import ROOT, command_line, number, origin, replace_block, table, told
from rti_mpcc.report.campaign import COMFORT, OVER_GAIN, read_table, several
from rti_mpcc.report.text import in_words

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
    "rejected solutions driven",
    "cycles with fallback",
    "not docked, or collided",
]
BINS = 4
"""Of a quantity that was drawn, with about as many cases each."""


def named(figures: dict[str, Any]) -> list[str]:
    asked = figures["settings"]
    return [asked["level"], f"{asked['method']}, {asked['preset']}"]


def row(folder: Path, figures: dict[str, Any]) -> list[str]:
    """Of the first table."""
    rows = read_table(folder)
    lost = rows[~rows["docked"] | rows["crossed"]]["outcome"].items()
    low, high = figures["success_interval"]
    return [
        *named(figures),
        f"{figures['cases']:,}",
        number(100.0 * figures["success_rate"], 2),
        f"{100.0 * low:.2f} to {100.0 * high:.2f}",
        str(figures["collisions"]),
        number(figures["min_clearance_m"], 3),
        f"{number(figures['time_to_dock_p50'], 1)} / {number(figures['time_to_dock_p95'], 1)}",
        str(figures["failures_driven"]),
        str(figures["fallback_cycles"]),
        ", ".join(f"{index} {outcome}" for index, outcome in lost) or "–",
    ]


def rides(columns: Sequence[dict[str, Any]]) -> str:
    """How smooth the rides are: a column for each study, percentiles and the largest."""
    header = ["p50 / p95 / p99 / most", *(", ".join(named(figures)) for figures in columns)]
    words = {
        "energy_ratio": "acceleration energy over the least",
        "time_ratio": "time to dock over the expected time",
    }
    rows = [
        [f"peak {in_words(name)} over comfort", *(several(each["comfort"][name]) for each in columns)]
        for name in (*COMFORT, OVER_GAIN)
    ]
    rows += [[said, *(several(each[name]) for each in columns)] for name, said in words.items()]
    rows.append(
        ["cycles with a QP solved by the interior point [%]", *(_by_interior_point(each) for each in columns)]
    )
    return table(header, rows)


def driven(reports: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """The origin of studies that were driven at one commit. Raises SystemExit for more than one."""
    asked = [each["settings"] for each in reports]
    commits = {each.get("commit") for each in asked}
    if len(commits) > 1 or None in commits:
        raise SystemExit(f"driven at commits {sorted(map(str, commits))}: must be one, run the others again")
    changed, date = any(each["changed"] for each in asked), max(each["date"] for each in asked)
    return {**origin(COMMAND), "commit": commits.pop(), "changed": changed, "date": date}


def _by_interior_point(figures: dict[str, Any]) -> str:
    cycles = sum(figures["cycles_by_status"].values())
    return number(100.0 * figures["interior_point_cycles"] / cycles, 4)


def difficulty(rows: pd.DataFrame) -> pd.DataFrame:
    """Cases, docked, collisions and median time to dock by each random quantity that varies."""
    tables = {}
    for name in map(str, rows):
        values = rows[name]
        if not name.startswith(("course.", "disturbances.")) or values.map(str).nunique() < 2:
            continue
        if pd.api.types.is_numeric_dtype(values) and values.nunique() > BINS:
            values = pd.qcut(values, BINS, duplicates="drop")
        tables[name] = rows.groupby(values.map(str)).agg(
            cases=("docked", "size"),
            docked=("docked", "sum"),
            collisions=("crossed", "sum"),
            time_to_dock_s=("time_to_dock", "median"),
        )
    return pd.concat(tables)


def main() -> None:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("folders", type=Path, nargs="+")
    parser.add_argument("--difficulty", action="store_true", help="only print tables by each random quantity")
    asked = parser.parse_args()
    if asked.difficulty:
        for folder in asked.folders:
            print(folder, difficulty(read_table(folder)).to_string(), sep="\n")
        return
    reports = [json.loads((folder / "report.json").read_text(encoding="utf-8")) for folder in asked.folders]
    rows = [row(folder, figures) for folder, figures in zip(asked.folders, reports, strict=True)]
    text = f"{table(HEADER, rows)}\n\n{rides(reports)}\n\n{told(driven(reports))}"
    replace_block(ROOT / "docs" / "campaigns.md", "campaigns", text)
    print(text)


if __name__ == "__main__":
    main()
