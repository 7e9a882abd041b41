"""The same random cases driven by several versions of this program, side by side.

    python -m benchmarks.campaign --count 1000 --level hard --seed 9931 --out runs/hard   # with each version
    python -m benchmarks.compare_campaigns before=runs/hard-before after=runs/hard-after ...

Of one level and seed the cases count that all its folders have; peaks, times and energies are those of the
cases that all of them dock. Prints a table, and how the times to dock compare with those of the first one.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.tables import number, table
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.campaign import read_rows
from rti_mpcc.simulation.campaign_row import CaseOutcome
from rti_mpcc.types import Array

HEADER = [
    "level and seed, version",
    "cases",
    "docked",
    "least clearance [m]",
    "peak a over comfort, p50, p95, most",
    "time over expected, p50, p95, most",
    "∫a², sum [m²/s³]",
    "∫δ̇², sum [rad²/s]",
    "not docked",
]
LONGER = (0.9, 1.1)
"""So many times as long a case takes a different time."""


class Driven(NamedTuple):
    """A campaign: the version that drove it, its level and seed, the rows by the number of the case, and
    whether they are scenes without a path."""

    version: str
    level: str
    seed: int
    rows: dict[int, Any]
    scenes: bool = False

    @property
    def of(self) -> str:
        """What has to be the same of campaigns that are compared."""
        return f"{'scenes, ' if self.scenes else ''}{self.level} of {self.seed}"

    def among(self, cases: set[int]) -> Driven:
        """The same with these cases only."""
        return self._replace(rows={case: self.rows[case] for case in sorted(cases)})


def read(named: str) -> Driven:
    """The campaign that VERSION=FOLDER names. Raises InputError where it names none."""
    version, found, folder = named.partition("=")
    if not found:
        raise InputError(f"{named}: must be VERSION=FOLDER")
    settings = json.loads((Path(folder) / "report.json").read_text(encoding="utf-8"))["settings"]
    rows = {row["index"]: row for row in read_rows(Path(folder)) if row["figures"] is not None}
    return Driven(version, settings["level"], settings["seed"], rows, settings["problems"] == "scenes")


def side_by_side(campaigns: Sequence[Driven]) -> list[list[Driven]]:
    """Those of one level and seed together, with the cases that all of them have."""
    groups = [
        list(group) for _, group in groupby(sorted(campaigns, key=lambda each: each.of), lambda d: d.of)
    ]
    return [
        [each.among(set.intersection(*(set(d.rows) for d in group))) for each in group] for group in groups
    ]


def docked(row: Any) -> bool:
    return CaseOutcome(row["outcome"]) is CaseOutcome.DOCKED


def line(driven: Driven, group: Sequence[Driven]) -> list[str]:
    """Of the table, for one of a group of the same cases."""
    rows = list(driven.rows.values())
    good = [row["figures"] for case, row in driven.rows.items() if all(docked(d.rows[case]) for d in group)]
    peaks = [each["peak"]["acceleration"] / each["comfort"]["acceleration"] for each in good]
    # How long a way takes that is planned only then is not known before.
    known = [each for each in good if each["expected_time_s"] is not None]
    times = [each["time_to_dock_s"] / each["expected_time_s"] for each in known]
    energy = {name: sum(each["energy_to_dock"][name] for each in good) for name in good[0]["energy_to_dock"]}
    return [
        f"{driven.of}, {driven.version}",
        f"{len(rows):,}",
        f"{sum(map(docked, rows)):,}",
        number(min(row["figures"]["min_clearance_m"] for row in rows), 3),
        _spread(peaks),
        _spread(times) if times else "–",
        number(energy["acceleration"], 1),
        number(energy["steering_rate"], 1),
        ", ".join(str(case) for case, row in driven.rows.items() if not docked(row)) or "–",
    ]


def _spread(values: Sequence[float]) -> str:
    return ", ".join(number(float(each), 2) for each in (*np.percentile(values, (50, 95)), max(values)))


def times_of(first: Driven, other: Driven) -> Array:
    """Times to dock of the cases (n,) that both dock, over those of the first."""
    pairs = [(first.rows[case], row) for case, row in other.rows.items()]
    both = [[each["figures"]["time_to_dock_s"] for each in pair] for pair in pairs if all(map(docked, pair))]
    found: Array = np.array([after / before for before, after in both])
    return found


def sentence(first: Driven, other: Driven) -> str:
    """How the times to dock compare."""
    ratios, (shorter, longer) = times_of(first, other), LONGER
    return (
        f"- {first.of}: of {len(ratios):,} cases that both dock, {other.version} takes "
        f"{number(float(np.median(ratios)), 3)} times as long as {first.version} (median; mean "
        f"{number(float(ratios.mean()), 3)}), in {int((ratios > longer).sum())} more than {longer}, "
        f"in {int((ratios < shorter).sum())} less than {shorter} times as long."
    )


def text(campaigns: Sequence[Driven]) -> str:
    """The table and the sentences."""
    groups = side_by_side(campaigns)
    rows = [line(each, group) for group in groups for each in group]
    told = [sentence(group[0], other) for group in groups for other in group[1:]]
    return "\n\n".join([table(HEADER, rows), "\n".join(told)])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("campaigns", nargs="+", metavar="VERSION=FOLDER")
    asked = parser.parse_args()
    try:
        print(text([read(each) for each in asked.campaigns]))
    except InputError as error:
        raise SystemExit(str(error)) from None


if __name__ == "__main__":
    main()
