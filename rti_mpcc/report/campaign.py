"""The report of a campaign: its rows as one table, report.json, report.html, and its worst cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

import pandas as pd
from matplotlib.figure import Figure
from scipy.stats import binomtest

from rti_mpcc.errors import InputError
from rti_mpcc.recording import Machine
from rti_mpcc.report.files import write_json
from rti_mpcc.report.overview import overview_figure
from rti_mpcc.report.page import rendered
from rti_mpcc.report.ride import Observer, ride_of_run
from rti_mpcc.report.ride_page import ride_page
from rti_mpcc.report.text import in_words, number, percent
from rti_mpcc.simulation import driver_of
from rti_mpcc.simulation.batch import Case, drive
from rti_mpcc.simulation.campaign import TIMES, CaseOutcome, RandomCase, read_rows
from rti_mpcc.simulation.scenario import save_scenario

PAGE, NUMBERS, WORST = "report.html", "report.json", "worst"
COMFORT = ("acceleration", "lateral_acceleration", "steering_rate", "jerk")
OVER_GAIN = "acceleration_over_gain"
"""Peak acceleration with the gain of the plant divided out: what was commanded."""
SUMS = {
    "interior_point_cycles": "figures.solver.interior_point_cycles",
    "solver_failures": "figures.solver.failures",
    "failures_driven": "figures.failures_driven",
    "fallback_cycles": "figures.fallback_cycles",
    "deadline_misses": "timed.deadline_misses",
    "replans": "figures.planning.replans",
}
COLUMNS = {
    **SUMS,
    "min_clearance_m": "figures.min_clearance_m",
    "time_to_tolerance": "figures.time_to_tolerance_s",
    "time_to_dock": "figures.time_to_dock_s",
    "expected_time": "figures.expected_time_s",
    "energy_ratio": "figures.energy_ratio",
    "gain": "disturbances.acceleration_gain",
    **{f"{kind}.{name}": f"figures.{kind}.{name}" for kind in ("peak", "comfort") for name in COMFORT},
    **{f"cycle_ms.{name}": f"timed.cycle_ms.{name}" for name in ("p50", "p99", "max")},
}
"""Numbers of the table, by their paths in a row."""
LARGEST = {
    "time_ratio": "longest time over the expected one",
    **{f"over_comfort.{name}": f"highest {in_words(name)} over comfort" for name in COMFORT},
    "energy_ratio": "most energy over the least",
}
"""Columns whose largest values are bad, and what such a case is called."""
CASE_COLUMNS = ("time_to_dock", "time_ratio", "min_clearance_m", "over_comfort.acceleration", "energy_ratio")
"""Numbers of each case on the page."""


def read_table(folder: Path) -> pd.DataFrame:
    """The rows of a campaign by index, with what was timed. Raises InputError where there is no row.

    Columns: the paths of their JSON; the short names of `COLUMNS`; `docked`: truly, and the controller says
    so; `crossed`: the body left the corridor or area, or met an obstacle; `over_comfort.<name>`: peaks over
    comfort; `time_ratio`: time to dock over the expected one.
    """
    timed = {row["index"]: row for row in read_rows(folder, TIMES)}
    rows = [{**row, "timed": timed.get(row["index"])} for row in read_rows(folder)]
    if not rows:
        raise InputError(f"{folder}: has no row of a campaign")
    table = pd.json_normalize(rows).set_index("index").sort_index()
    numbers = table.reindex(columns=list(COLUMNS.values())).astype(float).set_axis(list(COLUMNS), axis=1)
    table = table.join(numbers)
    over = {name: table[f"peak.{name}"] / table[f"comfort.{name}"] for name in COMFORT}
    over[OVER_GAIN] = table["peak.acceleration"] / table["gain"] / table["comfort.acceleration"]
    return table.assign(
        outcome=pd.Categorical(table["outcome"], [one.value for one in CaseOutcome], ordered=True),
        docked=table["outcome"] == CaseOutcome.DOCKED.value,
        crossed=table["min_clearance_m"] < 0.0,
        time_ratio=table["time_to_dock"] / table["expected_time"],
        **{f"over_comfort.{name}": ratios for name, ratios in over.items()},
    )


def overall(rows: pd.DataFrame) -> dict[str, Any]:
    """The figures of a campaign; None where there is nothing to take one of."""
    docked, clearance = rows[rows["docked"]], rows["min_clearance_m"]
    outcomes, cycles = rows["outcome"].value_counts(), {"p50": "median", "p99": "median", "max": "max"}
    interval = binomtest(len(docked), len(rows)).proportion_ci(confidence_level=0.95, method="exact")
    times = {name: percentiles(docked[name]) for name in ("time_to_tolerance", "time_to_dock")}
    return {
        "cases": len(rows),
        "outcomes": {outcome.value: int(outcomes[outcome.value]) for outcome in CaseOutcome},
        "success_rate": len(docked) / len(rows),
        "success_interval": [float(interval.low), float(interval.high)],
        "collisions": int(rows["crossed"].sum()),
        "min_clearance_m": known(clearance.min()),
        "clearance_p5_m": known(clearance.quantile(0.05)),
        "clearance_p50_m": known(clearance.quantile(0.5)),
        **{f"{name}_{key}": value for name, of in times.items() for key, value in of.items()},
        "comfort": {name: percentiles(rows[f"over_comfort.{name}"]) for name in (*COMFORT, OVER_GAIN)},
        "energy_ratio": percentiles(docked["energy_ratio"]),
        "time_ratio": percentiles(docked["time_ratio"]),
        "cycle_ms": {name: known(rows[f"cycle_ms.{name}"].agg(how)) for name, how in cycles.items()},
        **{name: int(rows[name].sum()) for name in SUMS},
        **{name: _summed(rows, f"figures.{name}.") for name in ("hard_braking", "cycles_by_status")},
    }


def _summed(rows: pd.DataFrame, above: str) -> dict[str, int]:
    columns = [str(name) for name in rows if str(name).startswith(above)]
    return {name.removeprefix(above): int(rows[name].sum()) for name in columns}


def worst_cases(rows: pd.DataFrame, count: int) -> dict[int, str]:
    """The `count` worst by index, the worst first, and why each is one of them.

    Collisions, the deepest first; what did not dock, the worst outcome first, then the least clearance; of
    the rest, in turn, the least clearance and the largest of each of `LARGEST`.
    """
    near = rows.sort_values("min_clearance_m", kind="stable")
    lost = near[~near["docked"] & ~near["crossed"]].sort_values("outcome", ascending=False, kind="stable")
    rest = near[near["docked"] & ~near["crossed"]]
    ranked = [[(case, "least clearance") for case in rest.index]]
    for column, why in LARGEST.items():
        largest = rest[rest[column].notna()].sort_values(column, ascending=False, kind="stable")
        ranked.append([(case, why) for case in largest.index])
    found: dict[int, str] = dict.fromkeys(near.index[near["crossed"]].tolist(), "collision")
    found |= zip(lost.index.tolist(), map(in_words, lost["outcome"]), strict=True)
    for case, why in (one for ones in zip_longest(*ranked) for one in ones if one is not None):
        found.setdefault(int(case), why)
    return dict(list(found.items())[:count])


def write_report(
    folder: Path, settings: Mapping[str, Any], cases: Sequence[RandomCase], *, worst: int
) -> tuple[dict[str, str], tuple[Path, ...]]:
    """Write report.json, report.html, and the `worst` cases, driven again, as scenario files and pages of
    their own into a folder.

    `settings` of the campaign are in both files. Returns the figures for people, and the written files.
    Raises InputError where there is no row, OSError.
    """
    rows, by_index = read_table(folder), {case.index: case for case in cases}
    figures, shown = overall(rows), []
    for index, why in worst_cases(rows, worst).items():
        row = rows.loc[index]
        said = {name: str(row[name]) for name in ("scenario", "outcome", "detail")}
        numbers = {name: known(row[name]) for name in ("time_to_dock", "min_clearance_m")}
        drives = said["outcome"] != CaseOutcome.WORKER_DIED.value
        command, picture, page = _driven_again(by_index[index], folder, drives=drives)
        own = {"command": command, "page": page}
        shown.append(({"index": index, "why": why, **said, **numbers, **own}, picture))
    files, table = (folder / PAGE, folder / NUMBERS), readable_figures(figures)
    title = f"Campaign {folder.resolve().name}"
    pages = {one["index"]: one["page"] for one, _ in shown}
    given = {"figures": figures, "table": table, "shown": shown, "settings": settings, "pages": pages}
    page = rendered("campaign.html", title, cases=_case_rows(rows), **given)
    files[0].write_text(page, encoding="utf-8")
    more = {"settings": dict(settings), "versions": Machine.here().versions}
    write_json({**figures, **more, "worst": [one for one, _ in shown]}, files[1])
    return table, (*files, *([folder / WORST] if shown else []))


def _case_rows(rows: pd.DataFrame) -> list[list[Any]]:
    """Of each case: index, outcome, and the numbers of `CASE_COLUMNS`; None: not known."""
    numbers = rows[list(CASE_COLUMNS)].astype(float)
    return [
        [index, in_words(str(outcome)), *map(known, values)]
        for index, outcome, values in zip(rows.index, rows["outcome"], numbers.to_numpy(), strict=True)
    ]


def _driven_again(case: RandomCase, folder: Path, *, drives: bool) -> tuple[str, Figure | None, str]:
    """Save a case; the command that drives it from its file, and its picture and page if it `drives`."""
    try:
        scenario = case.scenario()
        options = "".join(f" --{name} {value}" for name, value in case.run.items())
        file = save_scenario(scenario, folder / WORST)
        command = f"rti-mpcc run {file}{options}"
        if not drives:  # it may end this process
            return command, None, ""
        run = Case(scenario=scenario, **case.run)
        observer = Observer(driver_of(scenario, preset=run.preset, method=run.method))
        driven = drive(run, observer)
        ride, page = ride_of_run(driven.result, observer.moments), file.with_suffix(".html")
        page.write_text(ride_page(ride, driven.figures), encoding="utf-8")
        return command, overview_figure(ride), f"{WORST}/{page.name}"
    except Exception as error:  # whatever a case raised in the campaign it may raise here
        return f"{type(error).__name__}: {error}", None, ""


def readable_figures(figures: Mapping[str, Any]) -> dict[str, str]:
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
    """Values separated by slashes."""
    return " / ".join(number(value, digits) for value in values.values())


def percentiles(values: pd.Series[Any]) -> dict[str, float | None]:
    """Percentiles as p50, ..., and the largest as max, of what is known; None where nothing is."""
    found = {f"p{share}": known(values.quantile(share / 100.0)) for share in (50, 95, 99)}
    return {**found, "max": known(values.max())}


def known(value: Any) -> float | None:
    """A number for JSON, which has no NaN."""
    return None if pd.isna(value) else float(value)
