"""The same drawn cases driven by several versions of this program, side by side.

    python -m benchmarks.campaign --count 1000 --level hard --seed 9931 --out runs/hard   # with each version
    python -m benchmarks.compare_campaigns before=runs/hard-before after=runs/hard-after ...

Of one level and seed the cases count that all its folders have; peaks, times and energies are those of the
cases that all of them dock. Prints a table, and how the times to dock compare with those of the first one.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import reduce
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import pandas as pd

from benchmarks.tables import command_line, number, table
from rti_mpcc.errors import InputError
from rti_mpcc.report.campaign import read_table

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
    """A campaign: the version that drove it, what it is of, and its table, see `read_table`."""

    version: str
    of: str
    rows: pd.DataFrame


def read(named: str) -> Driven:
    """The campaign that VERSION=FOLDER names. Raises InputError where it names none."""
    version, found, folder = named.partition("=")
    if not found:
        raise InputError(f"{named}: must be VERSION=FOLDER")
    settings = json.loads((Path(folder) / "report.json").read_text(encoding="utf-8"))["settings"]
    scenes = "scenes, " if settings["problems"] == "scenes" else ""
    rows = read_table(Path(folder))
    driven = rows[rows["peak.acceleration"].notna()]  # to its end
    return Driven(version, f"{scenes}{settings['level']} of {settings['seed']}", driven)


def side_by_side(campaigns: Sequence[Driven]) -> list[list[Driven]]:
    """Those of one level and seed together, with the cases that all of them have."""
    found = []
    for _, group in groupby(sorted(campaigns, key=lambda each: each.of), lambda each: each.of):
        own = list(group)
        common = reduce(pd.Index.intersection, (each.rows.index for each in own))
        found.append([each._replace(rows=each.rows.loc[common]) for each in own])
    return found


def docked_by_all(group: Sequence[Driven]) -> pd.Series[bool]:
    """Whether all campaigns of the same cases dock a case."""
    return pd.concat([each.rows["docked"] for each in group], axis=1).all(axis=1)


def line(driven: Driven, group: Sequence[Driven]) -> list[str]:
    """Of the table, for one of a group of the same cases."""
    rows, good = driven.rows, driven.rows[docked_by_all(group)]
    energies = [good[f"figures.energy_to_dock.{name}"].sum() for name in ("acceleration", "steering_rate")]
    return [
        f"{driven.of}, {driven.version}",
        f"{len(rows):,}",
        f"{rows['docked'].sum():,}",
        number(rows["min_clearance_m"].min(), 3),
        _spread(good["over_comfort.acceleration"]),
        _spread(good["time_ratio"]),
        *(number(each, 1) for each in energies),
        ", ".join(map(str, rows.index[~rows["docked"]])) or "–",
    ]


def _spread(values: pd.Series[float]) -> str:
    """Of what is known: how long a way takes that is planned only then is not known before."""
    known = values.dropna()
    return (
        ", ".join(number(float(known.quantile(share)), 2) for share in (0.5, 0.95, 1.0))
        if len(known)
        else "–"
    )


def sentence(first: Driven, other: Driven) -> str:
    """How the times to dock of the cases that both dock compare."""
    both, (shorter, longer) = docked_by_all((first, other)), LONGER
    ratios = (other.rows["time_to_dock"] / first.rows["time_to_dock"])[both]
    return (
        f"- {first.of}: of {len(ratios):,} cases that both dock, {other.version} takes "
        f"{number(ratios.median(), 3)} times as long as {first.version} (median; mean "
        f"{number(ratios.mean(), 3)}), in {(ratios > longer).sum()} more than {longer}, "
        f"in {(ratios < shorter).sum()} less than {shorter} times as long."
    )


def text(campaigns: Sequence[Driven]) -> str:
    """The table and the sentences."""
    groups = side_by_side(campaigns)
    rows = [line(each, group) for group in groups for each in group]
    told = [sentence(group[0], other) for group in groups for other in group[1:]]
    return "\n\n".join([table(HEADER, rows), "\n".join(told)])


def main() -> None:
    parser = command_line(__doc__, "python -m benchmarks.compare_campaigns")
    parser.add_argument("campaigns", nargs="+", metavar="VERSION=FOLDER")
    try:
        print(text([read(each) for each in parser.parse_args().campaigns]))
    except InputError as error:
        raise SystemExit(str(error)) from None


if __name__ == "__main__":
    main()
