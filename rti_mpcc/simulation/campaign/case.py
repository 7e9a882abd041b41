"""One case of a campaign: which it is, the scenario that follows from that, and what became of it.

What a worker is sent is a `CampaignCase`, a few words; it draws the scenario itself, and sends back the lines
that are kept of it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum

from benchmarks.problems.courses import CAMPAIGN, drawn_course
from benchmarks.problems.scene_scenario import scenario_of
from benchmarks.problems.scenes import drawn_scene, kind_of_number
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.batch import Case, drive
from rti_mpcc.simulation.campaign.levels import Level, at_level
from rti_mpcc.simulation.campaign.row import (
    CampaignRow,
    CaseOutcome,
    Lines,
    course_figures,
    disturbance_figures,
    row_of,
)
from rti_mpcc.simulation.scenario import Scenario
from rti_mpcc.simulation.scenario_file import changed

MOST = 1_000_000
"""Cases of a campaign, at most."""
DIED = "its worker process ended while it was under way"
_ADDRESS = re.compile(r" at 0x[0-9a-f]+")


class Problems(Enum):
    """What a campaign draws."""

    COURSES = "courses"
    """A path with its corridor, and a goal near its end: `drawn_course`."""
    SCENES = "scenes"
    """No path: a start, a goal and what stands there, `drawn_scene`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignCase:
    """Case number `index` of a campaign of this seed and level, driven by a method and preset.

    `deadline` is that of the controller [s], or None.

    Raises InputError for a negative seed, or an index that is not in 0 ... MOST - 1.
    """

    seed: int
    level: Level
    index: int
    method: str = "dynamic"
    preset: str = "default"
    problems: Problems = Problems.COURSES
    deadline: float | None = None

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise InputError(f"seed = {self.seed}: must be >= 0")
        if not 0 <= self.index < MOST:
            raise InputError(f"index = {self.index}: must be >= 0 and < {MOST}")

    @property
    def run_seed(self) -> int:
        """Of the noise of its run: another one for every case of every campaign."""
        return MOST * self.seed + self.index

    @property
    def name(self) -> str:
        """Of its scenario."""
        if self.problems is Problems.SCENES:
            return f"{kind_of_number(self.index)}_{self.seed}_{self.index}_{self.level.value}"
        return f"{CAMPAIGN.prefix}_{self.seed}_{self.index:02d}_{self.level.value}"

    def scenario(self) -> Scenario:
        """Drawn, always the same. Raises InputError where none of many draws can be docked in."""
        scenario = at_level(self._drawn(), self.level, self.seed, self.index)
        return (
            scenario if self.deadline is None else changed(scenario, {"controller.deadline": self.deadline})
        )

    def _drawn(self) -> Scenario:
        if self.problems is Problems.SCENES:
            return scenario_of(drawn_scene(self.seed, self.index))
        return drawn_course(self.seed, self.index, CAMPAIGN)


Drive = Callable[[CampaignCase], CampaignRow]
"""What makes a row of a case. Workers get it by its name: it has to be defined at the top of a module."""


def drive_case(case: CampaignCase) -> CampaignRow:
    """Draw and drive a case. Raises what either raises."""
    scenario = case.scenario()
    run = Case(scenario=scenario, method=case.method, preset=case.preset, seed=case.run_seed)
    return row_of(case.index, drive(run))


def driven_lines(drive: Drive, case: CampaignCase) -> Lines:
    """The lines of a case; where it raises, one that tells what. Runs in the workers."""
    try:
        return drive(case).lines()
    except (Exception, SystemExit) as error:
        # What differs from process to process is no part of a row.
        told = _ADDRESS.sub("", " ".join(f"{type(error).__name__}: {error}".split()))
        return undriven_row(case, CaseOutcome.RAISED, told).lines()


def died_lines(case: CampaignCase, *, drawn: bool = True) -> Lines:
    """The line of a case that ended its worker. To be run in another one where its course is drawn again."""
    return undriven_row(case, CaseOutcome.WORKER_DIED, DIED, drawn=drawn).lines()


def undriven_row(case: CampaignCase, outcome: CaseOutcome, detail: str, *, drawn: bool = True) -> CampaignRow:
    """A row without figures, and without its course where that cannot be drawn, or is not to be."""
    scenario = None
    if drawn:
        with suppress(Exception):
            scenario = case.scenario()
    return CampaignRow(
        index=case.index,
        scenario=scenario.name if scenario else case.name,
        outcome=outcome,
        detail=detail,
        course=course_figures(scenario) if scenario else None,
        disturbances=disturbance_figures(scenario) if scenario else None,
        figures=None,
    )
