"""What the tests of campaign reports share: rows made by hand, as a campaign writes them."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rti_mpcc.report.campaign.rows import Campaign, read_campaign
from rti_mpcc.simulation.campaign import (
    CampaignRow,
    CampaignSettings,
    CaseOutcome,
    CourseFigures,
    DisturbanceFigures,
    Level,
    Problems,
    SceneFigures,
)

COURSE = CourseFigures(
    direction=1,
    pieces=2,
    cusps=0,
    length_m=22.5,
    curvature=0.1,
    room_m=1.5,
    narrowings=0,
    obstacles=1,
    goal_behind_m=0.0,
    goal_beside_m=-1.0,
    goal_turned_rad=0.2,
)
SCENE = SceneFigures(
    kind="bay",
    wheelbase_m=2.8,
    radius_m=3.0,
    apart_m=12.0,
    turned_rad=1.5,
    room_at_start_m=1.0,
    room_at_goal_m=0.3,
    obstacles=7,
    bounded=0,
    comfort_acceleration=0.4,
)
CALM = DisturbanceFigures(
    position_std_m=0.0,
    heading_std_rad=0.0,
    dropout=0.0,
    outlier=0.0,
    delay_s=0.0,
    initial_offset=(0.0, 0.0, 0.0),
    state_noise=(0.0, 0.0, 0.0, 0.0, 0.0),
    wheelbase_error=0.0,
    steering_offset_rad=0.0,
    acceleration_gain=1.0,
    dead_time_s=0.18,
)
SETTINGS = CampaignSettings(count=4, level=Level.NOMINAL, seed=1)
SCENES = CampaignSettings(count=4, level=Level.NOMINAL, seed=1, problems=Problems.SCENES)


def figures(time: float | None = 20.0, clearance: float | None = 0.2, **changes: Any) -> dict[str, Any]:
    """Those of a run that docked at `time` [s], or did not; the yardstick of `COURSE` is 15 s."""
    energy = {"acceleration": 1.0, "steering_rate": 0.2, "lateral_acceleration": 0.4}
    usual: dict[str, Any] = {
        "docked": time is not None,
        "time_to_tolerance_s": None if time is None else time - 0.5,
        "time_to_dock_s": time,
        "min_clearance_m": clearance,
        "direction_changes": 0,
        "distance_m": 23.0,
        "final_error": {"longitudinal_m": 0.01, "lateral_m": -0.002, "heading_rad": -0.001},
        "energy_to_dock": energy,
        "comfort": {"acceleration": 0.4, "lateral_acceleration": 1.0, "steering_rate": 0.5},
        "peak": peak(),
        "energy_ratio": 1.1,
        "expected_time_s": 18.0,
        "hard_braking": {"contact ahead": 2},
        "solver": {"failures": 0, "iteration_limit_cycles": 0},
        "failures_driven": 0,
        "fallback_cycles": 0,
        "cycles_by_status": {"arriving": 10, "docked": 2},
    }
    return {**usual, **changes}


def peak(**changes: float) -> dict[str, float]:
    return {"acceleration": 0.5, "lateral_acceleration": 0.8, "steering_rate": 0.25, **changes}


def row(
    index: int,
    told: dict[str, Any] | None = None,
    *,
    outcome: CaseOutcome = CaseOutcome.DOCKED,
    detail: str = "",
    course: dict[str, Any] | None = None,
    **changes: Any,
) -> CampaignRow:
    """A row; `course` are changes of its course, so is the index: no two cases have the same one."""
    own = {"goal_beside_m": -1.0 - 0.01 * index, **(course or {})}
    plain = CampaignRow(
        index=index,
        scenario=f"campaign_1_{index:02d}_nominal",
        outcome=outcome,
        detail=detail,
        course=replace(COURSE, **own),
        disturbances=CALM,
        figures=told,
    )
    return replace(plain, **changes)


def docked(index: int, time: float = 20.0, clearance: float | None = 0.2, **changes: Any) -> CampaignRow:
    return row(index, figures(time, clearance), **changes)


def scene(index: int, told: dict[str, Any] | None, *, kind: str = "bay", **changes: Any) -> CampaignRow:
    """A row of a scene: the yardstick of its first way, of 10 m with a cusp, is sqrt(200) s."""
    planning = {"length_m": 10.0, "cusps": 1, "replans": index}
    cycle = {"p50": 1.0 + index, "p95": 2.0, "p99": 3.0 + index, "max": 40.0 + index}
    timed = {
        "planning_s": 0.1 * (index + 1),
        "cycle_ms": cycle,
        "deadline_misses": index,
        "slowest_ms": {"planning": 30.0},
        "misses": {"planning": index} if index else {},
    }
    plain = row(index, None, **changes)
    return replace(
        plain,
        scenario=f"{kind}_1_{index}_nominal",
        course=replace(SCENE, kind=kind, apart_m=12.0 + index),
        figures=None if told is None else {**told, "planning": planning},
        timed=None if told is None else timed,
    )


def stalled(index: int, clearance: float = 0.2, **changes: Any) -> CampaignRow:
    return row(index, figures(None, clearance), outcome=CaseOutcome.STALLED, detail="no plan", **changes)


def raised(index: int, outcome: CaseOutcome = CaseOutcome.RAISED, **changes: Any) -> CampaignRow:
    return row(index, None, outcome=outcome, detail="ValueError: <odd> `x`", **changes)


def write(
    folder: Path, rows: Iterable[CampaignRow], *, tail: str = "", settings: CampaignSettings = SETTINGS
) -> Path:
    """A folder as `run_campaign` leaves it; `tail`: what stands behind the rows."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = list(rows)
    rows = list(rows)
    (folder / "campaign.json").write_text(json.dumps(settings.table()))
    (folder / "rows.jsonl").write_text("".join(one.line() for one in rows) + tail)
    (folder / "timed.jsonl").write_text("".join(one.lines().timed or "" for one in rows))
    (folder / "timed.jsonl").write_text("".join(one.lines().timed or "" for one in rows))
    return folder


def campaign(
    folder: Path, *rows: CampaignRow, tail: str = "", settings: CampaignSettings = SETTINGS
) -> Campaign:
    return read_campaign(write(folder, rows, tail=tail, settings=settings))
