"""The worst cases: a table, and of each its picture and the command that drives it again."""

from __future__ import annotations

from collections.abc import Callable
from math import degrees
from typing import Any, NamedTuple

import numpy as np

from rti_mpcc.report.axes import png
from rti_mpcc.report.campaign.case_picture import case_figure
from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.figures import time_over_yardstick, turns_beyond
from rti_mpcc.report.campaign.rerun import Rerun, command_of, rerun
from rti_mpcc.report.campaign.worst import ORDER, Worst
from rti_mpcc.report.content import Block, Picture, Section, Table, found, say
from rti_mpcc.report.numbers import number
from rti_mpcc.simulation.campaign import CaseOutcome

SAME = {"time_to_dock_s": 0.005, "min_clearance_m": 0.0005}
"""Figures of a case that differ by less are the same [s], [m]."""
_SAID = (
    "The pictures come from runs that were driven again when this page was made. Bodies are drawn each "
    "second, at the end, and where they came nearest to a boundary or obstacle. Scales are equal along x "
    "and y. Only the boundaries of the part that is driven act."
)
_HEADS = (
    *("case", "scenario", "why", "outcome", "to dock [s]", "over yardstick", "clearance [m]"),
    *("turns beyond cusps", "solver failures", "fallback cycles", "what was told"),
)


class WorstCases(NamedTuple):
    """The section, and the same for JSON."""

    section: Section
    told: list[dict[str, Any]]


def worst_section(
    campaign: Campaign, chosen: list[Worst], progress: Callable[[int, int], None] | None = None
) -> WorstCases:
    """Drive the chosen cases again, one after the other, and show them. `progress`: told (done, in all)."""
    told = _told(campaign, chosen)
    blocks: list[Block] = [say(ORDER), _table(told)]
    if told:
        blocks.append(say(_SAID))
    for place, one in enumerate(told, start=1):
        # What ended its worker might end this process, too.
        drives = one["outcome"] != CaseOutcome.WORKER_DIED.value
        blocks += _shown(one, rerun(campaign.asked.case(one["index"]), drives=drives))
        if progress is not None:
            progress(place, len(told))
    section = Section(name="worst", title=f"The {len(told)} worst cases", blocks=blocks)
    return WorstCases(section, told)


def _told(campaign: Campaign, chosen: list[Worst]) -> list[dict[str, Any]]:
    over_yardstick, turns = time_over_yardstick(campaign), turns_beyond(campaign)
    return [
        {
            "index": int(campaign.index[row]),
            "scenario": campaign.scenarios[row],
            "why": why,
            "outcome": campaign.outcome_of(row).value,
            "detail": campaign.details.get(row, ""),
            "time_to_dock_s": _known(campaign["time_to_dock_s"][row]) if campaign.docked[row] else None,
            "time_over_yardstick": _known(over_yardstick[row]),
            "min_clearance_m": _known(campaign["min_clearance_m"][row]),
            "final_error": {
                name: _known(campaign[f"final_error.{name}"][row])
                for name in ("longitudinal_m", "lateral_m", "heading_rad")
            },
            "direction_changes_beyond_cusps": _known(turns[row]),
            "solver_failures": _known(campaign["solver.failures"][row]),
            "fallback_cycles": _known(campaign["fallback_cycles"][row]),
            "command": command_of(campaign.asked.case(int(campaign.index[row]))),
        }
        for row, why in chosen
    ]


def _known(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _table(told: list[dict[str, Any]]) -> Table:
    rows = [
        [
            str(one["index"]),
            one["scenario"],
            one["why"],
            one["outcome"].replace("_", " "),
            number(one["time_to_dock_s"], 2),
            number(one["time_over_yardstick"], 2),
            number(one["min_clearance_m"], 3),
            number(one["direction_changes_beyond_cusps"], 0),
            number(one["solver_failures"], 0),
            number(one["fallback_cycles"], 0),
            one["detail"],
        ]
        for one in told
    ]
    return Table(
        caption="The worst cases, the worst first.",
        heads=_HEADS,
        rows=rows,
        worded=(1, 2, 3),
        sentences=(len(_HEADS) - 1,),
    )


def _shown(one: dict[str, Any], again: Rerun) -> list[Block]:
    """One case: what is known of it, its command, its picture."""
    told: list[Block] = [
        found(f"Case {one['index']}, {one['scenario']}: {ending(one)}{_differs(one, again)}"),
        say(f"`{one['command']}`"),
    ]
    if again.scenario is None:
        return told
    result = again.outcome.result if again.outcome is not None else None
    figure = case_figure(again.scenario, result, f"case {one['index']}: {one['why']}")
    picture = Picture(
        name=f"case_{one['index']}",
        png=png(figure),
        caption=f"Case {one['index']}, {one['why']}: {again.scenario.description}.",
        told=f"Case {one['index']} from above: corridor, path, obstacles, goal, and the driven body.",
    )
    return [*told, picture]


def ending(one: dict[str, Any]) -> str:
    """How a case ended, in words."""
    clearance = f"least clearance {number(one['min_clearance_m'], 3)} m."
    if one["time_to_dock_s"] is not None:
        time, over = number(one["time_to_dock_s"], 2), number(one["time_over_yardstick"], 2)
        return f"docked after {time} s, {over} times its yardstick; {clearance}"
    detail = f" ({one['detail']})" if one["detail"] else ""
    error = one["final_error"]
    if error["longitudinal_m"] is None:
        return f"{one['outcome'].replace('_', ' ')}{detail}; it has no figures."
    return (
        f"{one['outcome'].replace('_', ' ')}{detail}, {number(100.0 * error['longitudinal_m'], 1)} cm, "
        f"{number(100.0 * error['lateral_m'], 1)} cm and {number(degrees(error['heading_rad']), 1)}° off; "
        f"{clearance}"
    )


def _differs(one: dict[str, Any], again: Rerun) -> str:
    """What is to be said where the case was not driven again, or came out differently."""
    if again.outcome is None:
        if again.scenario is None:
            return f" It cannot be drawn: {again.raised}."
        reason = f"driven again it raised {again.raised}" if again.raised else "it was not driven again"
        return f" The picture shows the course alone: {reason}."
    figures = again.outcome.figures
    now = {**figures, "time_to_dock_s": figures["time_to_dock_s"] if figures["docked"] else None}
    if all(_same(one[name], now[name], least) for name, least in SAME.items()):
        return ""
    return (
        " Driven again for this page it came out differently, time to dock "
        f"{number(now['time_to_dock_s'], 2)} s, least clearance "
        f"{number(now['min_clearance_m'], 3)} m: the program, its libraries or the "
        "processor are not those of the campaign."
    )


def _same(one: float | None, other: float | None, least: float) -> bool:
    return one is other if one is None or other is None else abs(one - other) < least
