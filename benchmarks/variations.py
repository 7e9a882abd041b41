"""What the deviations benchmark runs: the product as it is, and with one thing undone at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rti_mpcc.config import SolverSettings, Weights
from rti_mpcc.ocp.corridor_rows import corridor_rows
from rti_mpcc.paper import PUBLISHED
from rti_mpcc.qp.solver import WARM
from rti_mpcc.types import Array

PATIENT = {"solver": SolverSettings(max_iterations=1000)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """One run.

    Attributes:
        settings: replace those of the preset; patches: of functions and constants ("module.name"), for the
            run.
        changes: of the scenario file.
    """

    letter: str
    what: str
    scenario: str
    preset: str = "default"
    settings: Mapping[str, Any] = field(default_factory=dict)
    patches: Mapping[str, Any] = field(default_factory=dict)
    changes: Mapping[str, Any] = field(default_factory=dict)


LAZY = {"simulation.acceleration_gain": 0.8}
SHORT = {"simulation.duration": 60.0}

CURVATURE = "rti_mpcc.controller.fill_curvature"


BLENDING = "rti_mpcc.paper.terms._add_slopes"
OWN_UNIT = {"rti_mpcc.qp.pattern.BOUND_UNIT": 1.0}
RELAXED = {"rti_mpcc.controller.WARM": WARM._replace(over_relaxation=1.6)}
UNSCALED = {"rti_mpcc.controller.ROW_SCALING_FROM": 1e9}
TIGHT = {"solver": SolverSettings(max_iterations=20_000, tolerance=1e-7)}
COARSE = {"rti_mpcc.qp.solver.FINE_TOLERANCE": SolverSettings().tolerance}
IN_FULL = {"rti_mpcc.ocp.objectives.FIRM_TIME": 1e-9}


def _nothing(*_: object) -> None:
    """In place of a function that only writes."""


def _as_they_are(lower: Array, *_: object) -> Array:
    """In place of what relaxes the bounds of rows."""
    return lower


VARIATIONS = (
    Variation(letter="a", what="as it is", scenario="long_approach", settings=PATIENT),
    Variation(
        letter="a",
        what="linear progress reward, speed at its bound",
        scenario="long_approach",
        settings={**PATIENT, "weights": Weights(virtual_speed=0.0)},
    ),
    Variation(letter="b", what="as it is", scenario="docking_behind", settings=PATIENT),
    Variation(
        letter="b",
        what="bound rows in their own unit",
        scenario="docking_behind",
        settings=PATIENT,
        patches=OWN_UNIT,
    ),
    Variation(
        letter="b",
        what="the same with tolerance 1e-4",
        scenario="docking_behind",
        settings={"solver": SolverSettings(max_iterations=1000, tolerance=1e-4)},
        patches=OWN_UNIT,
    ),
    Variation(
        letter="c",
        what="half-planes of far boundaries stay in the QP",
        scenario="docking_behind",
        settings=PATIENT,
        patches={
            "rti_mpcc.ocp.stage_contacts.NEAR": 1e3,
            "rti_mpcc.controller.corridor_rows": partial(corridor_rows, near=1e3),
        },
    ),
    Variation(letter="d", what="as it is, acceleration gain 0.8", scenario="docking_behind", changes=LAZY),
    Variation(
        letter="d",
        what="effort in full to the end, gain 0.8",
        scenario="docking_behind",
        patches=IN_FULL,
        changes=LAZY,
    ),
    Variation(letter="d", what="as it is, acceleration gain 0.8", scenario="docking_inside", changes=LAZY),
    Variation(
        letter="d",
        what="effort in full to the end, gain 0.8",
        scenario="docking_inside",
        patches=IN_FULL,
        changes=LAZY,
    ),
    Variation(
        letter="e",
        what="progress of an arrival without a weight of its own",
        scenario="docking_behind",
        settings=PATIENT,
        patches={"rti_mpcc.controller.IDLE_WEIGHT": 1e-6},
    ),
    Variation(letter="f", what="as it is", scenario="docking_behind", preset="paper"),
    Variation(
        letter="f",
        what="progress of both signs",
        scenario="docking_behind",
        preset="paper",
        settings={"objective": PUBLISHED["objective"].changed(progress_reverses=True)},
    ),
    Variation(
        letter="f",
        what="no corridor rows",
        scenario="docking_behind",
        preset="paper",
        patches={"rti_mpcc.controller.corridor_rows": _nothing},
    ),
    Variation(letter="g", what="as it is", scenario="docking_full_course", settings=PATIENT, changes=SHORT),
    Variation(
        letter="g",
        what="no damping (full Gauss-Newton steps)",
        scenario="docking_full_course",
        settings=PATIENT,
        patches={"rti_mpcc.planning.search.DAMPING": 0.0, "rti_mpcc.planning.search.FIRST_DAMPING": 0.0},
        changes=SHORT,
    ),
    Variation(
        letter="g",
        what="without the curvature of the dynamics, (Q1)",
        scenario="docking_full_course",
        settings=PATIENT,
        patches={CURVATURE: _nothing},
        changes=SHORT,
    ),
    Variation(letter="l", what="as it is", scenario="docking_moving_goal"),
    Variation(
        letter="l",
        what="lost margin requested at once",
        scenario="docking_moving_goal",
        patches={"rti_mpcc.controller.relaxed_bounds": _as_they_are},
    ),
    *(
        Variation(letter="n", what=what, scenario=scenario, preset="paper", patches=patches)
        for scenario in ("docking_inside", "docking_behind")
        for what, patches in (
            ("as it is", {}),
            ("weights taken as constant", {BLENDING: _nothing}),
        )
    ),
    *(
        Variation(letter=letter, what=what, scenario=scenario, settings=settings, patches=patches)
        for scenario in ("docking_behind", "long_approach")
        for letter, what, settings, patches in (
            ("o", "as it is", PATIENT, {}),
            ("o", "tight: all QPs to 1e-7", TIGHT, {"rti_mpcc.qp.solver.FINE_TOLERANCE": 1e-7}),
            ("o", "bounds in their own units at any distance", PATIENT, UNSCALED),
            ("p", "over-relaxation 1.6 from cycle to cycle", PATIENT, RELAXED),
            ("q", "no fine tolerance first", PATIENT, COARSE),
        )
    ),
)
