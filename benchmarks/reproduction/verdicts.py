"""Sentences that are computed from figures: nothing here is typed that a run could change."""

from __future__ import annotations

from collections.abc import Mapping
from math import degrees
from typing import Any

from benchmarks.reproduction.exactness import PoseError
from rti_mpcc.report.text import number

Figures = Mapping[str, Any]
CAME, MISSED, UNSAID = "reproduced", "not reproduced", "not measured"
ENERGIES = {
    "acceleration": "acceleration",
    "steering_rate": "steering rate",
    "lateral_acceleration": "lateral acceleration",
}
"""In the order in which they are told."""


def came_out(claim: str, holds: bool | None, evidence: str = "") -> str:
    """A claim, whether it holds (None: not measured), and the figures that show it."""
    word = UNSAID if holds is None else CAME if holds else MISSED
    return f"{claim}: {word}" + (f" ({evidence})." if evidence else ".")


def ratio(one: float | None, other: float | None) -> float | None:
    """None where one of the two was never reached."""
    return one / other if one is not None and other else None


def time_told(figures: Figures, published: Figures) -> str:
    """The time to tolerance of the proposed method beside the published ones."""
    time, paper = figures["time_to_tolerance_s"], published["time_in_paper_s"]
    code = published["time_to_tolerance_s"]
    if time is None:
        return "`dynamic` never gets inside tolerance."
    away = 100.0 * (time / paper - 1.0)
    return (
        f"`dynamic` is inside tolerance after {time:.2f} s: {abs(away):.1f} % "
        f"{'later' if away > 0.0 else 'sooner'} than in the paper ({paper:.2f} s), "
        f"{number(ratio(time, code), 2)} times the published code's {code:.2f} s."
    )


def near_paper(figures: Figures, published: Figures) -> bool | None:
    """Whether the time to tolerance is that of the paper within 10 %; None if it was never reached."""
    times = ratio(figures["time_to_tolerance_s"], published["time_in_paper_s"])
    return None if times is None else abs(times - 1.0) <= 0.1


def times_told(method: str, figures: Figures, base: Figures, published: Figures, first: Figures) -> str:
    """How much longer a method takes than `dynamic`: here, in the paper and in the published code."""
    others = f"paper {published_times('time_in_paper_s', published, first)}, "
    others += f"published code {published_times('time_to_tolerance_s', published, first)}"
    mine = ratio(figures["time_to_tolerance_s"], base["time_to_tolerance_s"])
    if mine is None:
        return f"`{method}` has no time to compare with that of `dynamic` ({others}): {ending(figures)}."
    return f"`{method}` takes {mine:.2f} times `dynamic` ({others}); {ending(figures)}."


def published_times(kind: str, published: Figures, first: Figures) -> str:
    """A published time as a multiple of that of `dynamic`; `kind` says whose."""
    return number(ratio(published.get(kind), first.get(kind)), 2)


def ending(figures: Figures) -> str:
    """Whether it docked, its changes of direction and its clearance."""
    turns, clearance = figures["direction_changes"], figures["min_clearance_m"]
    kept = "nothing is near" if clearance is None else f"the body's clearance is {number(clearance, 2)} m"
    how = "it docks" if figures["docked"] else f"it does not dock ({_where(figures)})"
    return f"{how}, with {turns} change{'' if turns == 1 else 's'} of direction; {kept}"


def _where(figures: Figures) -> str:
    error = figures["final_error"]
    return (
        f"status {figures['last_status']} at the end, {number(error['longitudinal_m'], 2)} m, "
        f"{number(error['lateral_m'], 2)} m and {number(degrees(error['heading_rad']), 1)}° off"
    )


def beyond_told(figures: Figures, published: Figures) -> str:
    """What the preset `default` reaches beside the published code's run."""
    share = ratio(figures["time_to_tolerance_s"], published["time_to_tolerance_s"])
    energies = [
        f"{number(ratio(figures['energy'][name], published['energy'].get(name)), 2)} ({words})"
        for name, words in ENERGIES.items()
    ]
    return (
        f"The preset `default` is inside tolerance after {number(figures['time_to_tolerance_s'], 2)} s, "
        f"{number(share, 2)} times the published code's time, with {', '.join(energies)} times its energies; "
        f"{ending(figures)}."
    )


def error_told(error: PoseError | None) -> str:
    """An error in words."""
    if error is None:
        return "not reached"
    return (
        f"{number(100.0 * error.longitudinal, 1)} cm, {number(100.0 * error.lateral, 1)} cm, "
        f"{number(degrees(error.heading), 1)}°"
    )
