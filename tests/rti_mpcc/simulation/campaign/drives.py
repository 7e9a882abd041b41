"""What the tests of campaigns drive their cases by, in place of the real thing; workers import it."""

from __future__ import annotations

import os
from pathlib import Path
from time import sleep

from rti_mpcc.simulation import Scenario, changed
from rti_mpcc.simulation.batch import Case, drive
from rti_mpcc.simulation.campaign import CampaignCase, CampaignRow, CaseOutcome
from rti_mpcc.simulation.campaign.row import row_of

JOURNAL = "CAMPAIGN_TEST_JOURNAL"
"""Environment variable: a file that gets index and process of each case that is begun."""


def made_up(case: CampaignCase) -> CampaignRow:
    """No run at all."""
    noted(case)
    return CampaignRow(
        index=case.index,
        scenario=case.name,
        outcome=CaseOutcome.DOCKED,
        detail="",
        course=None,
        disturbances=None,
        figures={"min_clearance_m": 0.1 * case.index - 0.05, "failures_driven": case.index},
    )


def slow(case: CampaignCase) -> CampaignRow:
    sleep(0.1)
    return made_up(case)


def alone(case: CampaignCase) -> CampaignRow:
    """Raises where another case is driven at the same time."""
    mark = Path(os.environ[JOURNAL]).with_suffix(".mark")
    mark.touch(exist_ok=False)
    row = slow(case)
    mark.unlink()
    return row


def short(case: CampaignCase) -> CampaignRow:
    """The first half second of the real thing."""
    return row_of(case.index, drive(Case(scenario=shortened(case), seed=case.run_seed)))


def shortened(case: CampaignCase) -> Scenario:
    return changed(case.scenario(), {"simulation.duration": 0.5})


def troubled(case: CampaignCase) -> CampaignRow:
    """Case 1 raises, case 2 ends its process, case 4 leaves the program."""
    if case.index == 1:
        raise ZeroDivisionError(f"case\n{case.index} of {object()}")
    if case.index == 2:
        noted(case)
        os._exit(9)
    if case.index == 4:
        raise SystemExit(3)
    return made_up(case)


def without_figures(case: CampaignCase) -> CampaignRow:
    """Figures that JSON does not have."""
    row = made_up(case)
    return CampaignRow(
        index=row.index,
        scenario=row.scenario,
        outcome=row.outcome,
        detail=row.detail,
        course=None,
        disturbances=None,
        figures={"min_clearance_m": float("nan")},
    )


def noted(case: CampaignCase) -> None:
    if (journal := os.environ.get(JOURNAL)) is not None:
        with Path(journal).open("a") as stream:
            stream.write(f"{case.index} {os.getpid()}\n")


def begun(journal: Path) -> list[tuple[int, int]]:
    """Index and process of the cases that were begun."""
    if not journal.exists():
        return []
    return [(int(index), int(pid)) for index, pid in map(str.split, journal.read_text().splitlines())]
