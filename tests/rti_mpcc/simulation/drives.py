"""What the tests of campaigns drive their cases by; workers import it."""

from __future__ import annotations

import os
from dataclasses import dataclass
from time import sleep
from typing import Any

from rti_mpcc.simulation import Scenario, changed, load_scenario
from rti_mpcc.simulation.campaign import CampaignRow, CaseOutcome, Drawn


@dataclass(frozen=True, kw_only=True)
class ShortCase:
    """The first second of a built-in scenario, with noise of its own."""

    index: int

    @property
    def name(self) -> str:
        return f"short_{self.index}"

    @property
    def run(self) -> dict[str, Any]:
        return {"seed": self.index}

    def scenario(self) -> Scenario:
        noise = [0.01, 0.01, 0.001, 0.01, 0.001]
        changes = {"name": self.name, "simulation.duration": 1.0, "simulation.state_noise": noise}
        return changed(load_scenario("docking_inside"), changes)

    def drawn(self, scenario: Scenario) -> Drawn:
        return {"course": {"number": self.index}, "disturbances": {}}


def made_up(case: ShortCase) -> CampaignRow:
    """No run at all."""
    sleep(0.02)
    docked, figures = CaseOutcome.DOCKED, {"min_clearance_m": 0.1}
    return CampaignRow(index=case.index, scenario=case.name, outcome=docked, detail="", figures=figures)


def troubled(case: ShortCase) -> CampaignRow:
    """Case 1 raises, 2 ends its process, 4 leaves the program, 5 has figures that JSON has not."""
    if case.index == 1:
        raise ZeroDivisionError(f"case\n{case.index} of {object()}")
    if case.index == 2:
        os._exit(9)
    if case.index == 4:
        raise SystemExit(3)
    if case.index == 5:
        nan, docked = {"min_clearance_m": float("nan")}, CaseOutcome.DOCKED
        return CampaignRow(index=case.index, scenario=case.name, outcome=docked, detail="", figures=nan)
    return made_up(case)
