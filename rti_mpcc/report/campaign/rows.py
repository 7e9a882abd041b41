"""The rows of a campaign as one table of pandas, a line a case."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from math import hypot, inf, nan
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from geometry.files import RECORDING, content
from rti_mpcc.errors import InputError
from rti_mpcc.simulation.campaign import (
    CampaignSettings,
    CaseOutcome,
    CourseFigures,
    DisturbanceFigures,
    Level,
    Problems,
    SceneFigures,
    read_rows,
    read_settings,
    read_times,
)
from rti_mpcc.simulation.campaign.rows_file import FILE as ROWS
from rti_mpcc.simulation.campaign.settings import FILE as SETTINGS

SEVERITY = (
    CaseOutcome.WORKER_DIED,
    CaseOutcome.RAISED,
    CaseOutcome.FAILED,
    CaseOutcome.STALLED,
    CaseOutcome.UNFINISHED,
    CaseOutcome.UNCONFIRMED,
    CaseOutcome.DOCKED,
)
"""What may become of a case, the worst first."""
COURSE = tuple(field.name for field in fields(CourseFigures))
SCENE = tuple(field.name for field in fields(SceneFigures) if field.name != "kind")
LISTS = ("initial_offset", "state_noise")
"""What of `disturbances` is a list: told by two sizes, and by `NOISES`."""
DISTURBANCES = tuple(field.name for field in fields(DisturbanceFigures) if field.name not in LISTS)
NOISES = ("noise_x_m", "noise_y_m", "noise_phi_rad", "noise_v_m_s", "noise_delta_rad")
FIGURES = (
    *("time_to_tolerance_s", "time_to_dock_s", "min_clearance_m", "direction_changes", "distance_m"),
    *("final_error.longitudinal_m", "final_error.lateral_m", "final_error.heading_rad"),
    *("energy_to_dock.acceleration", "energy_to_dock.steering_rate", "energy_to_dock.lateral_acceleration"),
    *("comfort.acceleration", "comfort.lateral_acceleration", "comfort.steering_rate", "comfort.jerk"),
    *("peak.acceleration", "peak.lateral_acceleration", "peak.steering_rate", "peak.jerk"),
    *("expected_time_s", "energy_ratio", "solver.iteration_limit_cycles"),
    *("solver.failures", "failures_driven", "fallback_cycles"),
)
"""Columns from `figures` of a row, by their path in it."""
COMFORT = ("acceleration", "lateral_acceleration", "steering_rate", "jerk")
"""What comfort has a value of."""
OVER_GAIN = "acceleration_over_gain"
"""The acceleration with the gain of the drive divided out: what was commanded to a weak or strong drive."""
PLANNING = ("planning.length_m", "planning.cusps", "planning.replans")
"""The same, of rows in areas only."""
TIMED = (
    "planning_s",
    "deadline_misses",
    "cycle_ms.p50",
    "cycle_ms.p99",
    "cycle_ms.max",
    "slowest_ms.planning",
)
"""Columns from what was timed of a case, likewise; they are called timed.<path>."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Campaign:
    """A campaign as far as it is driven.

    Attributes:
        name: of its folder.
        settings: what campaign.json says; asked: the same, checked, without the versions.
        rows: a line a case, by index, in order. `scenario`, `detail` and `outcome` (ordered, the worst
            first); `course`, `disturbances`: text that is equal where these are; `kind` of a scene, else "";
            numbers, NaN where a row has none: `COURSE`, `SCENE`, `DISTURBANCES`, `initial_offset_m`,
            `initial_turned_rad`, `NOISES`, `FIGURES`, `PLANNING`, `TIMED`; and what follows from these, see
            `_completed`. In an area `length_m` and `cusps` are those of the first way that was planned.
        statuses: how many cycles of all cases had which status, the most first; hard_braking: how many that
            braked hard had which reason, see `simulation.ride`.
        torn: the last line is not whole, and left out; repeated: lines left out because their case was
            there already.
    """

    name: str
    settings: dict[str, Any]
    asked: CampaignSettings
    rows: pd.DataFrame
    statuses: Mapping[str, int]
    hard_braking: Mapping[str, int]
    torn: bool
    repeated: int

    @property
    def of_scenes(self) -> bool:
        """Its problems have no path."""
        return self.asked.problems is Problems.SCENES


def read_campaign(folder: Path) -> Campaign:
    """What is in the folder of a campaign. Raises InputError where there is none, or it has no whole row."""
    settings = read_settings(folder)
    asked = _asked(settings, folder / SETTINGS)
    file = folder / ROWS
    times = read_times(folder)
    records = [
        _record(row, times, f"{file}, line {number}") for number, row in enumerate(read_rows(folder), start=1)
    ]
    if not records:
        raise InputError(f"{file}: has no whole row, so there is nothing to report yet")
    read = pd.DataFrame.from_records(records, index="index")
    repeated = read.index.duplicated()
    rows = read[~repeated].sort_index()
    statuses, hard_braking = _summed(rows.pop("statuses")), _summed(rows.pop("hard_braking"))
    return Campaign(
        name=folder.resolve().name,
        settings=settings,
        asked=asked,
        rows=_completed(rows),
        statuses=statuses,
        hard_braking=hard_braking,
        torn=not content(file, RECORDING).endswith(b"\n"),
        repeated=int(repeated.sum()),
    )


def _asked(settings: Mapping[str, Any], file: Path) -> CampaignSettings:
    try:
        return CampaignSettings(
            count=settings["count"],
            level=Level(settings["level"]),
            seed=settings["seed"],
            method=settings["method"],
            preset=settings["preset"],
            problems=Problems(settings["problems"]),
            deadline=settings["deadline"],
        )
    except (KeyError, TypeError, ValueError) as error:
        told = f"does not tell {error}" if isinstance(error, KeyError) else str(error)
        raise InputError(f"{file}: {told}") from None


def _record(row: Any, times: Mapping[int, Any], place: str) -> dict[str, Any]:
    """The columns of a row. Raises InputError where it is none; `place` says where it stands."""
    try:
        index, outcome = int(row["index"]), CaseOutcome(row["outcome"]).value
        course, disturbances, figures = row["course"], row["disturbances"], row["figures"] or {}
        timed = times.get(index) or {}
        numbers = {
            **_drawn(course),
            **_disturbed(disturbances or _UNKNOWN),
            **{path: _at(figures, path) for path in (*FIGURES, *PLANNING)},
            **{f"timed.{path}": _at(timed, path) for path in TIMED},
        }
        return {
            "index": index,
            "scenario": str(row["scenario"]),
            "outcome": outcome,
            # On one line; a backtick would begin code in a page.
            "detail": " ".join(str(row.get("detail") or "").replace("`", "'").split()),
            "course": json.dumps(course, sort_keys=True),
            "kind": str((course or {}).get("kind", "")),
            "disturbances": json.dumps(disturbances, sort_keys=True),
            "statuses": _counts(figures, "cycles_by_status"),
            "hard_braking": _counts(figures, "hard_braking"),
            **{name: nan if value is None else float(value) for name, value in numbers.items()},
        }
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        told = f"is not the row of a case ({type(error).__name__}: {error})"
        raise InputError(f"{place}: {told}") from None


_UNKNOWN = {**dict.fromkeys(DISTURBANCES, nan), "initial_offset": (nan,) * 3, "state_noise": (nan,) * 5}


def _drawn(course: Mapping[str, Any] | None) -> dict[str, Any]:
    """The numbers of a course or scene; those that it does not have are not known."""
    unknown = dict.fromkeys((*COURSE, *SCENE), nan)
    if not course:
        return unknown
    names = SCENE if "kind" in course else COURSE
    return unknown | {name: course[name] for name in names}


def _disturbed(disturbances: Mapping[str, Any]) -> dict[str, Any]:
    x, y, phi = map(float, disturbances["initial_offset"])
    return {
        **{name: disturbances[name] for name in DISTURBANCES},
        "initial_offset_m": hypot(x, y),
        "initial_turned_rad": abs(phi),
        **dict(zip(NOISES, disturbances["state_noise"], strict=True)),
    }


def _counts(figures: Mapping[str, Any], name: str) -> dict[str, int]:
    return {str(key): int(count) for key, count in figures.get(name, {}).items()}


def _summed(counts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    """Of all cases, the most first."""
    total = Counter[str]()
    for one in counts:
        total.update(one)
    return dict(total.most_common())


def _at(figures: Mapping[str, Any], path: str) -> Any:
    """What is at the path; None for what is null or not there."""
    found: Any = figures
    for name in path.split("."):
        found = None if found is None else found.get(name)
    return found


def _completed(rows: pd.DataFrame) -> pd.DataFrame:
    """With the columns that follow from others.

    `docked`; `crossed`: the body left the corridor or area or met an obstacle, False where that is not known;
    `time_to_dock_s`: of the cases that docked only; `turns_beyond`: changes of direction that the route does
    not ask for; `over_yardstick`: time to dock as a multiple of T [s], the time for the way D [m] at the
    comfort acceleration a [m/s²], without a limit on speed: full acceleration over one half of each part,
    full braking over the other, straight, with the c cusps as if they cut the way into equal parts:

        T = 2 sqrt((c + 1) D / a),   D = length of the route + goal behind its end                        (1)

    It makes long and short ways comparable; it is no bound: cusps cut in unequal parts, corners are cut. In
    an area the route is the first way that was planned, which ends at the goal.

    `over_comfort.<what>`: peaks over the comfort values, and of the acceleration `OVER_GAIN`;
    `over_expected`: time to dock over the time that was expected.
    """
    docked = rows["outcome"] == CaseOutcome.DOCKED.value
    time = rows["time_to_dock_s"].where(docked)
    rows = rows.assign(
        length_m=rows["length_m"].fillna(rows["planning.length_m"]),
        cusps=rows["cusps"].fillna(rows["planning.cusps"]),
    )
    way = (rows["length_m"] + rows["goal_behind_m"].fillna(0.0)).clip(lower=0.0)
    yardstick = 2.0 * np.sqrt((rows["cusps"] + 1.0) * way / rows["comfort.acceleration"])
    over_comfort = {name: rows[f"peak.{name}"] / rows[f"comfort.{name}"] for name in COMFORT}
    over_comfort[OVER_GAIN] = over_comfort["acceleration"] / rows["acceleration_gain"]
    rows = rows.assign(**{f"over_comfort.{name}": ratio for name, ratio in over_comfort.items()})
    return rows.assign(
        outcome=pd.Categorical(rows["outcome"], [one.value for one in SEVERITY], ordered=True),
        docked=docked,
        crossed=rows["min_clearance_m"] < 0.0,
        time_to_dock_s=time,
        turns_beyond=(rows["direction_changes"] - rows["cusps"]).clip(lower=0.0),
        over_yardstick=(time / yardstick).replace(inf, nan),
        over_expected=time / rows["expected_time_s"],
    )
