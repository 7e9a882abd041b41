"""The comparison of two campaigns: tables, sentences, and a picture of all cases that they share."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rti_mpcc.report import style
from rti_mpcc.report.axes import grid, legend_below, png
from rti_mpcc.report.campaign.columns import in_words
from rti_mpcc.report.campaign.pairs import RATIOS, Pairs, compared
from rti_mpcc.report.content import Block, Picture, Section, Table, found, say
from rti_mpcc.report.numbers import number
from rti_mpcc.types import Array

_NAMED = 40
"""So many cases are named in the page; all of them are in the JSON file."""
_SAID = (
    "Cases are paired by their index where seed and course are the same. Ratios are the first campaign's "
    "figure over the second's, on the cases that both dock; energies are the integrals of the square up to "
    "the time of docking."
)


class Comparison(NamedTuple):
    """The section, and the same for JSON."""

    section: Section
    told: dict[str, Any]


def pairs_section(pairs: Pairs) -> Comparison:
    """Both campaigns side by side, on the cases that they have in common."""
    told = compared(pairs)
    picture = Picture(
        name="against",
        png=png(pairs_figure(pairs)),
        caption="Every case that both campaigns have: time to dock and least clearance. Below the diagonal "
        f"the first, {pairs.names[0]}, is less. A case that only one of the two docks has no time in the "
        "other and stands at the edge.",
        told="Two scatter pictures of the cases of both campaigns: time to dock, and least clearance.",
    )
    blocks: list[Block] = [
        *(found(sentence) for sentence in sentences(pairs, told)),
        say(_SAID),
        _counts(told),
        _ratios(told),
        picture,
        *_lost(pairs, told),
    ]
    if pairs.differences:
        blocks.append(_settings(pairs))
    title = f"Case by case: {pairs.names[0]} against {pairs.names[1]}"
    return Comparison(Section(name="against", title=title, blocks=blocks), told)


def sentences(pairs: Pairs, told: dict[str, Any]) -> list[str]:
    """What the comparison comes to."""
    one, other = pairs.names
    said = [
        f"{told['common']} cases in common: {told['docked_both']} dock in both, "
        f"{told['docked_first_only']} in `{one}` only, {told['docked_second_only']} in `{other}` only, "
        f"{told['docked_none']} in neither."
    ]
    time = told["ratios"]["time_to_dock_s"]
    if time["p50"] is not None:
        said.append(
            f"On those that both dock `{one}` takes {number(time['p50'], 3)} times the time to dock of "
            f"`{other}` (median; quartiles {number(time['p25'], 3)} and {number(time['p75'], 3)}), and is "
            f"the faster one in {told['first_faster']} of {told['docked_both']}."
        )
    left = told["only_in_first"], told["only_in_second"]
    if any(left):
        said.append(f"Not compared: {left[0]} cases of `{one}` and {left[1]} of `{other}` have no pair.")
    if told["disturbed_differently"]:
        said.append(
            f"{told['disturbed_differently']} of the common cases are the same course disturbed differently."
        )
    differ = ", ".join(f"{name} ({mine} and {others})" for name, (mine, others) in pairs.differences.items())
    return [*said, f"Settings that differ: {differ}." if differ else "No settings differ."]


def _counts(told: dict[str, Any]) -> Table:
    rows = [
        [
            told[place],
            str(told["docked"][row]),
            str(told[f"docked_{place}_only"]),
            str(told["collisions"][row]),
            number(told["min_clearance_m"][row], 3),
        ]
        for row, place in enumerate(("first", "second"))
    ]
    return Table(
        caption=f"Both campaigns on their {told['common']} common cases.",
        heads=("campaign", "docked", "docked by it alone", "collisions", "least clearance [m]"),
        rows=rows,
    )


def _ratios(told: dict[str, Any]) -> Table:
    rows = [
        [words, *(number(told["ratios"][name][key], 3) for key in ("p25", "p50", "p75"))]
        for name, words in RATIOS.items()
    ]
    difference = told["clearance_difference_m"]
    rows.append(
        ["least clearance, difference [m]", *(number(difference[key], 3) for key in ("p25", "p50", "p75"))]
    )
    return Table(
        caption=f"Ratios {told['first']} / {told['second']} on the {told['docked_both']} that both dock.",
        heads=("figure", "lower quartile", "median", "upper quartile"),
        rows=rows,
    )


def _lost(pairs: Pairs, told: dict[str, Any]) -> list[Block]:
    """The cases that one of them loses, with what became of them in both."""
    docked = pairs.docked
    differ = np.flatnonzero(docked[:, 0] != docked[:, 1])
    if not differ.size:
        return [say("There is no case that one of the two docks and the other does not.")]
    rows = []
    for case in differ[:_NAMED].tolist():
        mine, others = pairs.rows[case].tolist()
        rows.append(
            [
                str(pairs.first.index[mine]),
                in_words(pairs.first.outcome_of(mine)),
                in_words(pairs.second.outcome_of(others)),
                pairs.first.details.get(mine) or pairs.second.details.get(others, ""),
            ]
        )
    rest = "" if differ.size <= _NAMED else f" The first {_NAMED} of {differ.size}; all are in report.json."
    return [
        Table(
            caption=f"Cases that one docks and the other does not.{rest}",
            heads=("case", *pairs.names, "what was told"),
            rows=rows,
            worded=(1, 2),
            sentences=(3,),
        )
    ]


def _settings(pairs: Pairs) -> Table:
    return Table(
        caption="Settings that differ.",
        heads=("setting", *pairs.names),
        rows=[
            [f"`{name}`", *("–" if value is None else str(value) for value in values)]
            for name, values in pairs.differences.items()
        ],
        worded=(1, 2),
    )


def pairs_figure(pairs: Pairs) -> Figure:
    """Time to dock and least clearance of the second campaign across, of the first upright."""
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    times, clearances = figure.subplots(1, 2)
    docked = pairs.docked
    known = np.where(docked, pairs.of("time_to_dock_s"), np.nan)
    _scatter(times, known, docked, pairs.names, "time to dock [s]")
    clearance = pairs.of("min_clearance_m")
    whole = np.where(np.isfinite(clearance).all(axis=1, keepdims=True), clearance, np.nan)
    _scatter(clearances, whole, docked, pairs.names, "least clearance [m]")
    legend_below(figure, columns=4)
    return figure


def _scatter(
    axes: Axes, values: Array, docked: NDArray[np.bool_], names: tuple[str, str], words: str
) -> None:
    """Points (k, 2), equal scales, the diagonal; what has no value in one of the two at the edge."""
    finite = values[np.isfinite(values)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    room = 0.06 * (high - low) or 0.5
    edge = bool((np.isfinite(values).any(axis=1) & ~np.isfinite(values).all(axis=1)).any())
    low, high = low - room, high + (2.0 if edge else 1.0) * room
    at = np.where(np.isfinite(values), values, high)
    shown = np.isfinite(values).any(axis=1)
    kinds = (
        (docked.all(axis=1), "both dock", "o", style.BLUE),
        (docked[:, 0] & ~docked[:, 1], f"only {names[0]} docks", "^", style.GREEN),
        (~docked[:, 0] & docked[:, 1], f"only {names[1]} docks", "v", style.RED),
        (~docked.any(axis=1), "neither docks", "x", style.BLACK),
    )
    axes.plot([low, high], [low, high], color=style.GREY, linewidth=0.9, zorder=1)
    for wanted, label, marker, color in kinds:
        rows = wanted & shown
        if rows.any():
            face = color if marker == "x" else "none"
            axes.scatter(
                at[rows, 1],
                at[rows, 0],
                s=22,
                marker=marker,
                color=color,
                label=label,
                linewidths=0.9,
                facecolors=face,
                zorder=3,
                clip_on=False,
            )
    axes.set_xlim(low, high)
    axes.set_ylim(low, high)
    axes.set_aspect("equal", adjustable="box")
    axes.set_xlabel(f"{words}, {names[1]}")
    axes.set_ylabel(f"{words}, {names[0]}")
    grid(axes)
