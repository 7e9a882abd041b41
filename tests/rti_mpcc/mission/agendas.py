"""Agendas and commands to decide by."""

from __future__ import annotations

from dataclasses import replace

from geometry import Pose2
from rti_mpcc.planning.agenda import Agenda, Due, StepRecord
from rti_mpcc.steps import AnyStep

HERE = Pose2(0.0, 0.0, 0.0)


def under_way(*steps: AnyStep, place: int = 0, attempt: int = 0, begun: float | None = 10.0) -> Agenda:
    """A mission of these steps, with that at `place` under way."""
    due = tuple(Due(step=step, place=k) for k, step in enumerate(steps))[place:]
    due = (replace(due[0], attempt=attempt), *due[1:])
    log: tuple[StepRecord, ...] = ()
    if begun is not None:
        log = (StepRecord(kind=steps[place].word, place=place, attempt=attempt, begin=begun),)
    return Agenda(due=due, begun=begun, log=log)
