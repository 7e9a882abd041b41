"""Outcomes of Scenario 1 and 2 as published, and what is measured of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from benchmarks.reproduction import causes
from benchmarks.reproduction.published import published_run
from benchmarks.reproduction.verdicts import near_paper, published_times, ratio
from rti_mpcc.report.text import number

Figures = Mapping[str, Any]
SLOWER = {"docking_inside": 1.4, "docking_behind": 1.8}
"""So many times as long as `dynamic` takes `separated` at least, as published."""


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
            lambda runs: near_paper(runs["dynamic"], published_run(scenario, "dynamic") or {}),
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
    known = published_run(scenario, "dynamic") or {}
    times = [run["time_to_tolerance_s"], known["time_in_paper_s"], known["time_to_tolerance_s"]]
    here, paper, code = (number(time, 2) for time in times)
    return f"here {here} s, paper {paper} s, published code {code} s"


def _times_of(scenario: str, runs: Mapping[str, Figures], method: str) -> str:
    known, first = published_run(scenario, method) or {}, published_run(scenario, "dynamic") or {}
    paper, code = (published_times(kind, known, first) for kind in ("time_in_paper_s", "time_to_tolerance_s"))
    return f"{number(times_of(runs, method), 2)} times here, paper {paper}, published code {code}"


def _turns_of(scenario: str, runs: Mapping[str, Figures], method: str) -> str:
    there = [(published_run(scenario, name) or {})["direction_changes"] for name in (method, "dynamic")]
    return (
        f"`{method}` {_turns(runs, method)} and `dynamic` {_turns(runs, 'dynamic')} here, "
        f"{there[0]} and {there[1]} in the published code"
    )


def _clearance_of(scenario: str, run: Figures) -> str:
    there = (published_run(scenario, "switched") or {})["min_clearance_m"]
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
