"""Driving a case of a campaign again: the case, the command that does it, what came of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rti_mpcc.simulation import CAMPAIGN, drawn_course
from rti_mpcc.simulation.batch import Case, Outcome, drive


@dataclass(frozen=True, slots=True, kw_only=True)
class Rerun:
    """What came of a case that was driven again.

    Attributes:
        case: what was driven; outcome: None where it raised, or was not driven; raised: what it raised.
    """

    case: Case
    outcome: Outcome | None
    raised: str = ""


def case_of(settings: Mapping[str, Any], index: int) -> Case:
    """The case of a campaign, made again from its settings."""
    return Case(
        scenario=drawn_course(settings["seed"], index, CAMPAIGN),
        method=settings["method"],
        preset=settings["preset"],
        seed=index,
    )


def command_of(settings: Mapping[str, Any], index: int) -> str:
    """One line for a shell that drives the case again, and draws it."""
    return (
        f"rti-mpcc campaign --only {index} --level {settings['level']} --seed {settings['seed']} "
        f"--method {settings['method']} --preset {settings['preset']}"
    )


def rerun(settings: Mapping[str, Any], index: int, *, drives: bool = True) -> Rerun:
    """Drive a case again in this process. `drives`: False for one that may end the process."""
    case = case_of(settings, index)
    if not drives:
        return Rerun(case=case, outcome=None)
    try:
        return Rerun(case=case, outcome=drive(case))
    except Exception as error:  # whatever a case raised in the campaign it may raise here
        return Rerun(case=case, outcome=None, raised=f"{type(error).__name__}: {error}")
