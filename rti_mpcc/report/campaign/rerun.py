"""Driving a case of a campaign again: the command that does it, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

from rti_mpcc.simulation import Scenario
from rti_mpcc.simulation.batch import Case, Outcome, drive
from rti_mpcc.simulation.campaign import CampaignCase


@dataclass(frozen=True, slots=True, kw_only=True)
class Rerun:
    """What came of a case that was driven again.

    Attributes:
        scenario: None where it could not be drawn.
        outcome: None where it raised, or was not driven; raised: what was raised.
    """

    scenario: Scenario | None
    outcome: Outcome | None
    raised: str = ""


def command_of(case: CampaignCase) -> str:
    """One line for a shell that drives a case again, and draws it."""
    return (
        f"rti-mpcc campaign-case --level {case.level.value} --seed {case.seed} --index {case.index} "
        f"--method {case.method} --preset {case.preset}"
    )


def rerun(case: CampaignCase, *, drives: bool = True) -> Rerun:
    """Drive a case again in this process. `drives`: False for one that may end the process."""
    scenario = None
    try:
        scenario = case.scenario()
        run = Case(scenario=scenario, method=case.method, preset=case.preset, seed=case.run_seed)
        return Rerun(scenario=scenario, outcome=drive(run) if drives else None)
    except Exception as error:  # whatever a case raised in the campaign it may raise here
        return Rerun(scenario=scenario, outcome=None, raised=f"{type(error).__name__}: {error}")
