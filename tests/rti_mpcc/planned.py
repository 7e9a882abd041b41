"""Manoeuvres made by hand, and a controller that drives one: for what only shows, writes or counts them."""

from __future__ import annotations

from geometry import Corridor, Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.docking import DockingController
from rti_mpcc.manoeuvre import Manoeuvre, PlanOutcome, Segment, SegmentEnd


def manoeuvre_along(path: ReferencePath, goal: Pose2 | None = None, *, nodes: int = 42) -> Manoeuvre:
    """A way that was found, in a quarter of a second."""
    last = len(path.parts) - 1
    segments = tuple(
        Segment(part=part, index=index, end=SegmentEnd.GOAL if index == last else SegmentEnd.CUSP)
        for index, part in enumerate(path.parts)
    )
    return Manoeuvre(
        start=path.start,
        goal=goal or path.end,
        outcome=PlanOutcome.FOUND,
        segments=segments,
        clearance=0.3,
        nearest=0.0,
        nodes=nodes,
        seconds=0.25,
    )


def no_manoeuvre(start: Pose2, goal: Pose2, outcome: PlanOutcome = PlanOutcome.BUDGET_SPENT) -> Manoeuvre:
    """A search in vain."""
    return Manoeuvre(
        start=start, goal=goal, outcome=outcome, reason="too narrow", nearest=1.5, nodes=1000, seconds=2.0
    )


class OnPlannedPath(DockingController):
    """Drives a path as if it had planned it, and looks at nothing beside it."""

    def __init__(self, path: ReferencePath, config: ControllerConfig) -> None:
        super().__init__(path, Corridor.from_offsets(path, left=4.0, right=-4.0), config)

    @property
    def replans(self) -> int:
        return 0

    @property
    def planning_seconds(self) -> float:
        return 0.25
