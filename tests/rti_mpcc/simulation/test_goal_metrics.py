"""How well the goal was known: errors and spreads in its frame, and the figures of detections."""

from __future__ import annotations

import json
from dataclasses import replace
from math import pi
from typing import Any

import numpy as np
import pytest

from estimation import GoalEstimate, GoalStatus, Judgement, Outcome
from geometry import Pose2
from rti_mpcc.simulation import GoalSource, RunResult, Scenario, changed, simulate, summary
from rti_mpcc.simulation.metrics import errors_to, goal_summary
from tests.rti_mpcc.simulation.conftest import Scripted, with_columns

GOAL = Pose2(10.0, 0.0, 0.0)
ERRORS = ("longitudinal_m", "lateral_m", "heading_rad")


@pytest.fixture
def run(straight: Scenario) -> RunResult:
    """A run of 11 cycles, 0.1 s apart, whose tracking the tests replace; the goal is at (10, 0, 0)."""
    scenario = changed(straight, {"simulation.duration": 1.0, "simulation.cycle": 0.1})
    return simulate(scenario, controller=Scripted(script=lambda now, state: (0.0, 0.0)))


def tracked(
    run: RunResult,
    *,
    seen_from: int = 11,
    estimate: Pose2 = GOAL,
    detections: tuple[Judgement, ...] = (),
    last: GoalStatus = GoalStatus.TRACKING,
    source: GoalSource = GoalSource.DETECTED,
) -> RunResult:
    """The run with an estimate of the goal from the cycle `seen_from` on."""
    count = len(run.cycles)
    seen = [GoalEstimate(status=GoalStatus.TRACKING, pose=estimate)] * (count - seen_from)
    goals = [GoalEstimate(status=GoalStatus.SEARCHING)] * seen_from + seen
    if seen:
        goals[-1] = replace(goals[-1], status=last)
    columns = with_columns(run.cycles, goal=goals if source is GoalSource.DETECTED else [None] * count)
    columns.detections[0] = detections
    return replace(run, cycles=columns, detector=True, goal_source=source)


def judged(outcome: Outcome, nis: float | None = None) -> Judgement:
    return Judgement(stamp=0.0, outcome=outcome, nis=nis)


def figures(run: RunResult) -> dict[str, Any]:
    found = goal_summary(run)
    assert found is not None
    assert summary(run)["goal"] == found
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    return found


def test_errors_are_longitudinal_lateral_and_wrapped_heading() -> None:
    goal = Pose2(3.0, -2.0, 2.0)
    offsets = [Pose2(0.3, -0.2, 0.1), Pose2(-1.0, 0.5, -0.1 + 4.0 * pi)]
    poses = [goal.compose(offset) for offset in offsets]
    errors = errors_to(
        np.tile((goal.x, goal.y, goal.phi), (2, 1)), np.array([(p.x, p.y, p.phi) for p in poses])
    )
    assert errors == pytest.approx(np.array([(0.3, -0.2, 0.1), (-1.0, 0.5, -0.1)]), abs=1e-12)


def test_detections_are_counted_by_what_became_of_them(run: RunResult) -> None:
    detections = (
        judged(Outcome.REJECTED),
        judged(Outcome.ACQUIRED),
        judged(Outcome.ACCEPTED, 2.0),
        judged(Outcome.ACCEPTED, 5.0),
        judged(Outcome.REJECTED, 400.0),
        judged(Outcome.ACQUIRED, 60.0),
        judged(Outcome.REFUSED),
    )
    found = figures(tracked(run, seen_from=4, detections=detections))
    assert [found[name] for name in ("detections", "accepted", "rejected", "refused")] == [7, 4, 2, 1]
    # Only what passed the gate: the law of 3 is that of these.
    assert found["mean_nis"] == pytest.approx(3.5)
    assert (found["source"], found["first_seen_s"]) == ("detected", pytest.approx(0.4))
    assert found["final_status"] == "tracking"


def test_error_is_that_of_the_last_estimate_to_the_goal_of_that_time(run: RunResult) -> None:
    goals = run.truth.goals.copy()
    goals[run.truth.times > 0.85] = 10.0, 1.0, 0.5 * pi
    moved = replace(run, truth=replace(run.truth, goals=goals))
    estimate = Pose2(10.02, 1.1, 0.5 * pi + 0.03)
    found = figures(tracked(moved, seen_from=2, estimate=estimate, last=GoalStatus.LOST))
    errors = dict(zip(ERRORS, (0.1, -0.02, 0.03), strict=True))
    assert found["estimate_error"] == pytest.approx(errors, abs=1e-12)
    assert found["final_status"] == "lost"


def test_goal_that_was_never_seen(run: RunResult) -> None:
    found = figures(tracked(run, detections=(judged(Outcome.REJECTED),)))
    counts = {"detections": 1, "accepted": 0, "rejected": 1, "refused": 0}
    none = {"first_seen_s": None, "estimate_error": dict.fromkeys(ERRORS), "mean_nis": None}
    assert found == {"source": "detected", **counts, **none, "final_status": "searching"}
