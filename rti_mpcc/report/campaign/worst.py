"""The worst cases of a campaign: which they are, the command that drives each again, and what came of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import zip_longest
from math import degrees
from typing import Any, NamedTuple

import pandas as pd

from rti_mpcc.report.campaign.case_picture import case_figure
from rti_mpcc.report.campaign.figures import ERRORS, known
from rti_mpcc.report.campaign.rows import Campaign
from rti_mpcc.report.numbers import in_words, number
from rti_mpcc.simulation import Scenario
from rti_mpcc.simulation.batch import Case, Outcome, drive
from rti_mpcc.simulation.campaign import CampaignCase, CaseOutcome, Problems

SAME = {"time_to_dock_s": 0.005, "min_clearance_m": 0.0005}
"""Figures of a case that differ by less are the same [s], [m]."""
CROSSED, CLOSE = "crossed a boundary", "least clearance"
BY_FIGURE = {
    "over_yardstick": "longest for its way",
    "over_comfort.acceleration": "highest acceleration over comfort",
    "over_comfort.lateral_acceleration": "highest lateral acceleration over comfort",
    "over_comfort.steering_rate": "highest steering rate over comfort",
    "over_comfort.jerk": "highest jerk over comfort",
    "energy_ratio": "most energy over the least",
    "over_expected": "longest over the time expected",
}
"""Columns whose largest values are bad, and what such a case is called."""


class Again(NamedTuple):
    """What came of a case that was driven again.

    Attributes:
        scenario: None where it could not be drawn.
        outcome: None where it raised, or was not driven; raised: what was raised.
    """

    scenario: Scenario | None
    outcome: Outcome | None
    raised: str = ""


def worst_cases(rows: pd.DataFrame, count: int) -> dict[int, str]:
    """The `count` worst, or all, the worst first, and why each is one of them.

    Those that crossed a boundary, the deepest first; those that did not dock, by outcome, then clearance; of
    the rest, in turn, the least clearance and the largest by each of `BY_FIGURE`.
    """
    near = rows.sort_values("min_clearance_m", kind="stable")
    rest = near[near["docked"] & ~near["crossed"]]
    lost = near[~near["docked"] & ~near["crossed"]].sort_values("outcome", kind="stable")
    worst = [[(case, CLOSE) for case in rest.index.tolist()]]
    for column, why in BY_FIGURE.items():
        known_ones = rest[rest[column].notna()].sort_index()
        largest = known_ones.sort_values(column, ascending=False, kind="stable")
        worst.append([(case, why) for case in largest.index.tolist()])
    ordered = [
        *((case, CROSSED) for case in near.index[near["crossed"]].tolist()),
        *zip(lost.index.tolist(), lost["outcome"].map(in_words), strict=True),
    ]
    for places in zip_longest(*worst):
        ordered += filter(None, places)
    first: dict[int, str] = {}
    for case, why in ordered:
        first.setdefault(case, why)
    return dict(list(first.items())[:count])


def told(campaign: Campaign, chosen: dict[int, str]) -> list[dict[str, Any]]:
    """What is known of the chosen cases, for JSON."""
    rows = campaign.rows.loc[list(chosen)].to_dict("records")
    return [
        {
            "index": index,
            "scenario": row["scenario"],
            "why": why,
            "outcome": row["outcome"],
            "detail": row["detail"],
            "time_to_dock_s": known(row["time_to_dock_s"]),
            "time_over_yardstick": known(row["over_yardstick"]),
            "min_clearance_m": known(row["min_clearance_m"]),
            "acceleration_over_comfort": known(row["over_comfort.acceleration"]),
            "energy_ratio": known(row["energy_ratio"]),
            "time_ratio": known(row["over_expected"]),
            "final_error": {name: known(row[f"final_error.{name}"]) for name in ERRORS},
            "direction_changes_beyond_cusps": known(row["turns_beyond"]),
            "solver_failures": known(row["solver.failures"]),
            "fallback_cycles": known(row["fallback_cycles"]),
            "command": command_of(campaign.asked.case(index)),
        }
        for (index, why), row in zip(chosen.items(), rows, strict=True)
    ]


def shown(
    campaign: Campaign, cases: list[dict[str, Any]], progress: Callable[[int, int], None] | None = None
) -> Iterator[dict[str, Any]]:
    """Drive cases, as `told` gives them, again, one after the other: with `sentence`, `figure` and `caption`.

    `figure` is None where the course cannot be drawn. `progress`: told (done, in all).
    """
    for place, one in enumerate(cases, start=1):
        # What ended its worker might end this process, too.
        drives = one["outcome"] != CaseOutcome.WORKER_DIED.value
        again = drive_again(campaign.asked.case(one["index"]), drives=drives)
        figure, caption = None, ""
        if again.scenario is not None:
            result = None if again.outcome is None else again.outcome.result
            figure = case_figure(again.scenario, result, f"case {one['index']}: {one['why']}")
            caption = f"Case {one['index']}, {one['why']}: {again.scenario.description}."
        sentence = f"Case {one['index']}, {one['scenario']}: {ending(one)}{_differs(one, again)}"
        yield one | {"sentence": sentence, "figure": figure, "caption": caption}
        if progress is not None:
            progress(place, len(cases))


def command_of(case: CampaignCase) -> str:
    """One line for a shell that drives a case again, and draws it."""
    scenes = " --scenes" if case.problems is Problems.SCENES else ""
    deadline = "" if case.deadline is None else f" --deadline {case.deadline:g}"
    return (
        f"rti-mpcc campaign-case --level {case.level.value} --seed {case.seed} --index {case.index} "
        f"--method {case.method} --preset {case.preset}{scenes}{deadline}"
    )


def drive_again(case: CampaignCase, *, drives: bool = True) -> Again:
    """Drive a case again in this process. `drives`: False for one that may end the process."""
    scenario = None
    try:
        scenario = case.scenario()
        run = Case(scenario=scenario, method=case.method, preset=case.preset, seed=case.run_seed)
        return Again(scenario, drive(run) if drives else None)
    except Exception as error:  # whatever a case raised in the campaign it may raise here
        return Again(scenario, None, f"{type(error).__name__}: {error}")


def ending(one: dict[str, Any]) -> str:
    """How a case ended, in words."""
    clearance = f"least clearance {number(one['min_clearance_m'], 3)} m."
    if one["time_to_dock_s"] is not None:
        time, over = number(one["time_to_dock_s"], 2), number(one["time_over_yardstick"], 2)
        return f"docked after {time} s, {over} times its yardstick; {clearance}"
    ended = in_words(one["outcome"]) + (f" ({one['detail']})" if one["detail"] else "")
    error = one["final_error"]
    if error["longitudinal_m"] is None:
        return f"{ended}; it has no figures."
    return (
        f"{ended}, {number(100.0 * error['longitudinal_m'], 1)} cm, "
        f"{number(100.0 * error['lateral_m'], 1)} cm and {number(degrees(error['heading_rad']), 1)}° off; "
        f"{clearance}"
    )


def _differs(one: dict[str, Any], again: Again) -> str:
    """What is to be said where the case was not driven again, or came out differently."""
    if again.scenario is None:
        return f" It cannot be drawn: {again.raised}."
    if again.outcome is None:
        reason = f"driven again it raised {again.raised}" if again.raised else "it was not driven again"
        return f" The picture shows the course alone: {reason}."
    figures = again.outcome.figures
    now = {**figures, "time_to_dock_s": figures["time_to_dock_s"] if figures["docked"] else None}
    if all(_same(one[name], now[name], least) for name, least in SAME.items()):
        return ""
    return (
        " Driven again for this page it came out differently, time to dock "
        f"{number(now['time_to_dock_s'], 2)} s, least clearance {number(now['min_clearance_m'], 3)} m: "
        "the program, its libraries or the processor are not those of the campaign."
    )


def _same(one: float | None, other: float | None, least: float) -> bool:
    return one is other if one is None or other is None else abs(one - other) < least
