"""Outcomes as published, and sentences that are computed from figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import degrees
from typing import Any, NamedTuple

from benchmarks.reproduction import causes
from benchmarks.reproduction.exactness import PoseError
from benchmarks.reproduction.published import published_run
from rti_mpcc.report.text import number

Figures = Mapping[str, Any]
CAME, MISSED, UNSAID = "reproduced", "not reproduced", "not measured"
ENERGIES = {
    "acceleration": "acceleration",
    "steering_rate": "steering rate",
    "lateral_acceleration": "lateral acceleration",
}
"""In the order in which they are told."""
SLOWER = {"docking_inside": 1.4, "docking_behind": 1.8}
"""So many times as long as `dynamic` takes `separated` at least, as published."""


def came_out(claim: str, holds: bool | None, evidence: str = "") -> str:
    """A claim, whether it holds (None: not measured), and the figures that show it."""
    word = UNSAID if holds is None else CAME if holds else MISSED
    return f"{claim}: {word}" + (f" ({evidence})." if evidence else ".")


def ratio(one: float | None, other: float | None) -> float | None:
    """None where one of the two was never reached."""
    return one / other if one is not None and other else None


def time_told(scenario: str, figures: Figures) -> str:
    """The time to tolerance of the proposed method beside the published ones."""
    published = published_run(scenario, "dynamic")
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


def near_paper(scenario: str, figures: Figures) -> bool | None:
    """Whether the time to tolerance is that of the paper within 10 %; None if it was never reached."""
    times = ratio(figures["time_to_tolerance_s"], published_run(scenario, "dynamic")["time_in_paper_s"])
    return None if times is None else abs(times - 1.0) <= 0.1


def times_told(scenario: str, method: str, runs: Mapping[str, Figures]) -> str:
    """How much longer a method takes than `dynamic`: here, in the paper and in the published code."""
    others = "paper {}, published code {}".format(*published_times(scenario, method))
    mine = times_of(runs, method)
    if mine is None:
        return f"`{method}` has no time to compare with that of `dynamic` ({others}): {ending(runs[method])}."
    return f"`{method}` takes {mine:.2f} times `dynamic` ({others}); {ending(runs[method])}."


def published_times(scenario: str, method: str) -> list[str]:
    """The time of a method as a multiple of that of `dynamic`: in the paper, by the published code."""
    run, first = published_run(scenario, method), published_run(scenario, "dynamic")
    return [number(ratio(run[kind], first[kind]), 2) for kind in ("time_in_paper_s", "time_to_tolerance_s")]


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


class Claim(NamedTuple):
    """An outcome as published.

    Attributes:
        holds: whether the claim holds for the figures by method; None: not measured.
        evidence: the figures that show it.
        cause: the reason if it does not hold, if it is known.
    """

    text: str
    holds: Callable[[Mapping[str, Figures]], bool | None]
    evidence: Callable[[Mapping[str, Figures]], str]
    cause: str = ""


def claims(scenario: str) -> Sequence[Claim]:
    """What is published, about `dynamic` and about the methods that it is compared with."""
    least = SLOWER[scenario]
    shared = (
        Claim(
            "`dynamic` takes as long as in the paper, within 10 %",
            lambda runs: near_paper(scenario, runs["dynamic"]),
            lambda runs: _seconds(scenario, runs["dynamic"]),
        ),
        Claim(
            f"As published, `separated` takes at least {least:g} times as long as `dynamic`",
            lambda runs: _at_least(times_of(runs, "separated"), least),
            lambda runs: _times_of(scenario, runs, "separated"),
            causes.SEPARATED_BEHIND if scenario == "docking_behind" else "",
        ),
    )
    return (*shared, *(_inside(scenario) if scenario == "docking_inside" else _behind(scenario)))


def _inside(scenario: str) -> Sequence[Claim]:
    return (
        Claim(
            "As published, `switched` takes longer than `dynamic`",
            lambda runs: _at_least(times_of(runs, "switched"), 1.0),
            lambda runs: _times_of(scenario, runs, "switched"),
        ),
        Claim(
            "As published, `switched` changes direction once more than `dynamic`",
            lambda runs: _turns(runs, "switched") == _turns(runs, "dynamic") + 1,
            lambda runs: _turns_of(scenario, runs, "switched"),
        ),
    )


def _behind(scenario: str) -> Sequence[Claim]:
    return (
        Claim(
            "As published, `separated` changes direction",
            lambda runs: _turns(runs, "separated") > 0,
            lambda runs: _turns_of(scenario, runs, "separated"),
        ),
        Claim(
            "As published, `switched` leaves the corridor with its body or fails to dock",
            lambda runs: _leaves(runs["switched"]) or not runs["switched"]["docked"],
            lambda runs: _clearance_of(scenario, runs["switched"]),
        ),
        Claim(
            "As published, `switched` leaves the corridor",
            lambda runs: _leaves(runs["switched"]),
            lambda runs: _clearance_of(scenario, runs["switched"]),
            causes.SWITCHED_BEHIND,
        ),
    )


def _seconds(scenario: str, run: Figures) -> str:
    known = published_run(scenario, "dynamic")
    times = [run["time_to_tolerance_s"], known["time_in_paper_s"], known["time_to_tolerance_s"]]
    here, paper, code = (number(time, 2) for time in times)
    return f"here {here} s, paper {paper} s, published code {code} s"


def _times_of(scenario: str, runs: Mapping[str, Figures], method: str) -> str:
    paper, code = published_times(scenario, method)
    return f"{number(times_of(runs, method), 2)} times here, paper {paper}, published code {code}"


def _turns_of(scenario: str, runs: Mapping[str, Figures], method: str) -> str:
    there = [published_run(scenario, name)["direction_changes"] for name in (method, "dynamic")]
    return (
        f"`{method}` {_turns(runs, method)} and `dynamic` {_turns(runs, 'dynamic')} here, "
        f"{there[0]} and {there[1]} in the published code"
    )


def _clearance_of(scenario: str, run: Figures) -> str:
    there = published_run(scenario, "switched")["min_clearance_m"]
    return (
        f"here {'it docks' if run['docked'] else 'it does not dock'}, clearance of the body "
        f"{number(run['min_clearance_m'], 2)} m; published code {number(there, 2)} m"
    )


def _leaves(run: Figures) -> bool:
    clearance = run["min_clearance_m"]
    return clearance is not None and clearance < 0.0


def times_of(runs: Mapping[str, Figures], method: str) -> float | None:
    """The time to tolerance of a method as a multiple of that of `dynamic`."""
    return ratio(runs[method]["time_to_tolerance_s"], runs["dynamic"]["time_to_tolerance_s"])


def _at_least(value: float | None, least: float) -> bool | None:
    return None if value is None else value >= least


def _turns(runs: Mapping[str, Figures], method: str) -> int:
    return int(runs[method]["direction_changes"])


def missed_causes(scenario: str, measured: Mapping[str, Figures]) -> list[str]:
    """The reasons of the outcomes that are not reproduced, each once."""
    missed = [claim.cause for claim in claims(scenario) if claim.holds(measured) is False]
    return [cause for cause in dict.fromkeys(missed) if cause]
