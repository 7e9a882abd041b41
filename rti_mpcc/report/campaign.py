"""The report of a campaign: its rows as one table, report.json, report.html, and its worst cases."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
from matplotlib.figure import Figure
from rich.table import Table
from scipy.stats import binomtest

from rti_mpcc.errors import InputError
from rti_mpcc.recording import Machine
from rti_mpcc.report.files import write_json
from rti_mpcc.report.numbers import in_words, number, percent
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.page import rendered
from rti_mpcc.simulation.batch import Case, drive
from rti_mpcc.simulation.campaign import TIMES, DrawnCase, read_rows
from rti_mpcc.simulation.campaign_row import CaseOutcome
from rti_mpcc.simulation.scenario_writer import save_scenario

PAGE, NUMBERS, WORST = "report.html", "report.json", "worst"
COMFORT = ("acceleration", "lateral_acceleration", "steering_rate", "jerk")
TIMES_TO = {"time_to_tolerance": "figures.time_to_tolerance_s", "time_to_dock": "figures.time_to_dock_s"}
RATIOS = {"energy_ratio": "figures.energy_ratio", "time_ratio": "time_ratio"}
"""Of the docked cases."""
SUMS = {
    "iteration_limit_cycles": "figures.solver.iteration_limit_cycles",
    "solver_failures": "figures.solver.failures",
    "failures_driven": "figures.failures_driven",
    "fallback_cycles": "figures.fallback_cycles",
    "deadline_misses": "timed.deadline_misses",
    "replans": "figures.planning.replans",
}
COUNTS = ("hard_braking", "cycles_by_status")
"""Numbers of cycles by name, which are summed, too."""
CYCLES = tuple(f"timed.cycle_ms.{name}" for name in ("p50", "p99", "max"))
CLEARANCE = "figures.min_clearance_m"
LARGEST = {
    "time_ratio": "longest time over the expected one",
    **{f"over_comfort.{name}": f"highest {in_words(name)} over comfort" for name in COMFORT},
    "figures.energy_ratio": "most energy over the least",
}
"""Columns whose largest values are bad, and what such a case is called."""
TAIL = (50, 95, 99)


class Report(NamedTuple):
    """What was written, and the table for a terminal."""

    files: tuple[Path, ...]
    table: Table


def read_table(folder: Path) -> pd.DataFrame:
    """The rows of a campaign by index, with what was timed; columns are the paths of their JSON.

    And `docked`: the controller says so, and it is true; `crossed`: the body left the corridor or area, or
    met an obstacle; `over_comfort.<name>`: peaks over comfort; `time_ratio`: time to dock over the expected.

    Raises InputError where there is no row.
    """
    timed = {row["index"]: row for row in read_rows(folder, TIMES)}
    rows = [{**row, "timed": timed.get(row["index"])} for row in read_rows(folder)]
    if not rows:
        raise InputError(f"{folder}: has no row of a campaign")
    table = pd.json_normalize(rows).set_index("index").sort_index()
    peaks = [f"figures.{kind}.{name}" for kind in ("peak", "comfort") for name in COMFORT]
    needed = {
        *TIMES_TO.values(),
        *RATIOS.values(),
        *SUMS.values(),
        *CYCLES,
        *peaks,
        "figures.expected_time_s",
        CLEARANCE,
    }
    needed.remove("time_ratio")
    table = table.reindex(columns=[*table, *sorted(needed.difference(table))])
    table[list(needed)] = table[list(needed)].astype(float)
    order = [outcome.value for outcome in CaseOutcome]
    return table.assign(
        outcome=pd.Categorical(table["outcome"], order, ordered=True),
        docked=table["outcome"] == CaseOutcome.DOCKED.value,
        crossed=table[CLEARANCE] < 0.0,
        time_ratio=table["figures.time_to_dock_s"] / table["figures.expected_time_s"],
        **{f"over_comfort.{n}": table[f"figures.peak.{n}"] / table[f"figures.comfort.{n}"] for n in COMFORT},
    )


def overall(rows: pd.DataFrame) -> dict[str, Any]:
    """The figures of a campaign; None where there is nothing to take one of."""
    docked, clearance, outcomes = rows[rows["docked"]], rows[CLEARANCE], rows["outcome"].value_counts()
    interval = binomtest(len(docked), len(rows)).proportion_ci(confidence_level=0.95, method="exact")
    p50, p99, largest = rows[CYCLES[0]].median(), rows[CYCLES[1]].median(), rows[CYCLES[2]].max()
    return {
        "cases": len(rows),
        "outcomes": {outcome.value: int(outcomes[outcome.value]) for outcome in CaseOutcome},
        "success_rate": len(docked) / len(rows),
        "success_interval": [float(interval.low), float(interval.high)],
        "told_docked": len(docked) / len(rows),
        "collisions": int(rows["crossed"].sum()),
        "min_clearance_m": known(clearance.min()),
        "clearance_p5_m": known(clearance.quantile(0.05)),
        "clearance_p50_m": known(clearance.quantile(0.5)),
        "comfort": {name: spread(rows[f"over_comfort.{name}"]) for name in COMFORT},
        **{f"{n}_{k}": each for n, of in TIMES_TO.items() for k, each in spread(docked[of]).items()},
        **{name: spread(docked[column]) for name, column in RATIOS.items()},
        "cycle_ms": {"p50": known(p50), "p99": known(p99), "max": known(largest)},
        **{name: int(rows[column].sum()) for name, column in SUMS.items()},
        **{name: _summed(rows, f"figures.{name}.") for name in COUNTS},
    }


def _summed(rows: pd.DataFrame, above: str) -> dict[str, int]:
    """Of the columns below a path, by their last name."""
    columns = [str(name) for name in rows if str(name).startswith(above)]
    return {name.removeprefix(above): int(rows[name].sum()) for name in columns}


def worst_cases(rows: pd.DataFrame, count: int) -> dict[int, str]:
    """The `count` worst by index, the worst first, and why each is one of them.

    Collisions, the deepest first; what did not dock, the worst outcome first, then the least clearance; of
    the rest, in turn, the least clearance and the largest of each of `LARGEST`.
    """
    near = rows.sort_values(CLEARANCE, kind="stable")
    lost = near[~near["docked"] & ~near["crossed"]].sort_values("outcome", ascending=False, kind="stable")
    rest = near[near["docked"] & ~near["crossed"]]
    ranked = [[(case, "least clearance") for case in rest.index]]
    for column, why in LARGEST.items():
        largest = rest[rest[column].notna()].sort_values(column, ascending=False, kind="stable")
        ranked.append([(case, why) for case in largest.index])
    found: dict[int, str] = dict.fromkeys(near.index[near["crossed"]].tolist(), "collision")
    found |= {case: in_words(str(outcome)) for case, outcome in lost["outcome"].items()}
    for case, why in (one for ones in zip_longest(*ranked) for one in ones if one is not None):
        found.setdefault(int(case), why)
    return dict(list(found.items())[:count])


def write_report(
    folder: Path,
    settings: Mapping[str, Any],
    cases: Sequence[DrawnCase],
    *,
    worst: int,
    progress: Callable[[int], None] | None = None,
) -> Report:
    """Write report.json, report.html, and the worst cases as scenario files into the folder of a campaign.

    Args:
        settings: what was driven, for both files; cases: of the campaign.
        worst: so many of the worst cases are driven again, saved and shown.
        progress: given the number of worst cases that were driven again, after each.

    Raises InputError where there is no row, OSError.
    """
    rows, by_index = read_table(folder), {case.index: case for case in cases}
    figures, pictures = overall(rows), []
    told: list[dict[str, Any]] = []
    for done, (index, why) in enumerate(worst_cases(rows, worst).items(), start=1):
        row, columns = (
            rows.loc[index],
            {"time_to_dock_s": TIMES_TO["time_to_dock"], "min_clearance_m": CLEARANCE},
        )
        command, picture = _driven_again(by_index[index], folder, drives=row["outcome"] != "worker_died")
        said = {name: row[name] for name in ("scenario", "outcome", "detail")}
        numbers = {name: known(row[column]) for name, column in columns.items()}
        told.append({"index": index, "why": why, **said, **numbers, "command": command})
        pictures.append(picture)
        if progress is not None:
            progress(done)
    written = {**figures, "settings": dict(settings), "worst": told, "versions": Machine.here().versions}
    files, title, table = (
        (folder / PAGE, folder / NUMBERS),
        f"Campaign {folder.resolve().name}",
        words(figures),
    )
    shown = list(zip(told, pictures, strict=True))
    page = rendered("campaign.html", title, figures=figures, table=table, shown=shown, settings=settings)
    files[0].write_text(page, encoding="utf-8")
    write_json(written, files[1])
    console = Table("", "value", title=title, title_justify="left")
    for name, value in table.items():
        console.add_row(name.replace("[", r"\["), value)
    return Report((*files, *([folder / WORST] if shown else [])), console)


def _driven_again(case: DrawnCase, folder: Path, *, drives: bool) -> tuple[str, Figure | None]:
    """Save a case; the command that drives it from its file, and its picture if it can be driven.

    `drives`: False for a case that may end this process.
    """
    try:
        scenario = case.scenario()
        options = "".join(f" --{name} {value}" for name, value in case.run.items())
        command = f"rti-mpcc run {save_scenario(scenario, folder / WORST)}{options}"
        return command, overview_figure(drive(Case(scenario=scenario, **case.run)).result) if drives else None
    except Exception as error:  # whatever a case raised in the campaign it may raise here
        return f"{type(error).__name__}: {error}", None


def words(figures: Mapping[str, Any]) -> dict[str, str]:
    """The figures for tables that people read."""
    low, high = map(percent, figures["success_interval"])
    tail, clearances = "p50 / p95 / p99 / largest", ("min_clearance_m", "clearance_p5_m", "clearance_p50_m")
    times = {name: value for name, value in figures.items() if name.startswith("time_to_dock_")}
    return {
        "cases": str(figures["cases"]),
        "docked, and the controller says so": percent(figures["success_rate"]),
        "its 95 % interval": f"{low} to {high}",
        **{in_words(name): str(count) for name, count in list(figures["outcomes"].items())[1:] if count},
        "collisions": str(figures["collisions"]),
        "least clearance / p5 / p50 [m]": several({name: figures[name] for name in clearances}, 3),
        f"time to dock {tail} [s]": several(times),
        **{f"peak {in_words(n)} over comfort {tail}": several(of) for n, of in figures["comfort"].items()},
        f"acceleration energy over the least {tail}": several(figures["energy_ratio"]),
        f"time to dock over the expected one {tail}": several(figures["time_ratio"]),
        "cycle p50 / p99 of the median case / largest [ms]": several(figures["cycle_ms"]),
        **{in_words(name): str(figures[name]) for name in SUMS},
        "cycles that braked harder than 1.1 times comfort": str(sum(figures["hard_braking"].values())),
    }


def several(values: Mapping[str, float | None], digits: int = 2) -> str:
    """Values of a spread, one behind the other."""
    return " / ".join(number(value, digits) for value in values.values())


def spread(values: pd.Series[Any]) -> dict[str, float | None]:
    """Percentiles as p50, ..., and the largest as max, of what is known; None where nothing is."""
    return {
        **{f"p{share}": known(values.quantile(share / 100.0)) for share in TAIL},
        "max": known(values.max()),
    }


def known(value: Any) -> float | None:
    """A number for JSON, which has no NaN."""
    return None if pd.isna(value) else float(value)
