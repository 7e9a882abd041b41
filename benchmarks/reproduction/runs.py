"""What is driven for the report, and the runs that came of it, by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, Self

from benchmarks.problems.courses import drawn_course
from rti_mpcc.errors import InputError
from rti_mpcc.simulation import changed, load_scenario
from rti_mpcc.simulation.batch import Case, DrivenCase, drive_all

DOCKING = {"docking_inside": "Scenario 1", "docking_behind": "Scenario 2"}
"""Scenarios of the paper's Tables II and III, by their names there."""
FULL_COURSE = "path_following"
MISSION = "docking_mission"
METHODS = ("dynamic", "separated", "switched")
CONTOURING = ("dynamic", "constant_1", "constant_50", "constant_100")
PAPER, DEFAULT = "paper", "default"
COMFORTS = {
    "comfort_acceleration": (0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7),
    "comfort_lateral_acceleration": (0.5, 0.25),
    "comfort_steering_rate": (0.25, 0.12),
    "docking_time": (18.0, 24.0, 30.0, 40.0),
}
"""Keys of a scenario's [controller] that are set, one at a time: [m/s²], [m/s²], [rad/s], [s]."""
COURSE_SEED = 1
"""Of the drawn courses."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cases:
    """The runs of a report before they are driven, as in `Runs`."""

    experiments: Sequence[Case]
    comforts: Sequence[Case]
    mission: Case
    courses: Sequence[Case]

    @classmethod
    def of(cls, courses: int) -> Self:
        """All of them, with so many random courses."""
        return cls(
            experiments=experiment_cases(),
            comforts=comfort_cases(),
            mission=mission_case(),
            courses=course_cases(courses),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Runs:
    """The runs of a report: the paper's experiments, `default` at other comforts and on drawn courses.

    `mission` is the docking mission; None: it was not driven.
    """

    experiments: Sequence[DrivenCase]
    comforts: Sequence[DrivenCase] = ()
    courses: Sequence[DrivenCase] = ()
    mission: DrivenCase | None = None

    @classmethod
    def driven(
        cls, cases: Cases, jobs: int | None = None, progress: Callable[[int, int], None] | None = None
    ) -> Self:
        """Drive the cases, as `drive_all` does."""
        given = [*cases.experiments, *cases.comforts, cases.mission, *cases.courses]
        found = iter(drive_all(given, jobs=jobs, progress=progress))
        return cls(
            experiments=list(islice(found, len(cases.experiments))),
            comforts=list(islice(found, len(cases.comforts))),
            mission=next(found),
            courses=list(found),
        )

    def of(self, scenario: str, method: str = "dynamic", preset: str = PAPER) -> DrivenCase:
        """The run of a scenario by a method and preset. Raises InputError if there is none."""
        wanted = (scenario, method, preset)
        for outcome in self.experiments:
            case = outcome.case
            if (case.scenario.name, case.method, case.preset) == wanted:
                return outcome
        raise InputError(f"{scenario}, {method}, {preset}: was not driven")

    def figures(self, scenario: str, method: str = "dynamic", preset: str = PAPER) -> dict[str, Any]:
        """The summary of a run. Raises InputError if there is none."""
        return self.of(scenario, method, preset).figures


def experiment_cases() -> list[Case]:
    """The paper's experiments with its preset, and the same with `default` by its own method."""
    methods = {**dict.fromkeys(DOCKING, METHODS), FULL_COURSE: CONTOURING}
    return [
        Case(scenario=load_scenario(name), method=method, preset=preset)
        for name, compared in methods.items()
        for method, preset in [*((method, PAPER) for method in compared), ("dynamic", DEFAULT)]
    ]


def mission_case() -> Case:
    """The docking mission, by this project's own preset: the others plan no ways."""
    return Case(scenario=load_scenario(MISSION))


def comfort_cases() -> list[Case]:
    """The paper's scenarios with `default` at other comforts, and with the time asked for."""
    changes = [{f"controller.{key}": value} for key, values in COMFORTS.items() for value in values]
    return [Case(scenario=changed(load_scenario(name), change)) for name in DOCKING for change in changes]


def course_cases(count: int) -> list[Case]:
    """The first `count` courses of the seed, with `default` and with `paper`."""
    courses = [drawn_course(COURSE_SEED, index) for index in range(count)]
    return [Case(scenario=course, preset=preset) for course in courses for preset in (DEFAULT, PAPER)]
