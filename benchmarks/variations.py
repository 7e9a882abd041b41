"""What the deviations benchmark runs: the product as it is, and with one thing undone at a time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from rti_mpcc.config import SolverSettings, Weights
from rti_mpcc.ocp.corridor_rows import corridor_rows
from rti_mpcc.paper import PUBLISHED
from rti_mpcc.types import Array


@dataclass(frozen=True, slots=True)
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
    preset: str = field(default="default", kw_only=True)
    settings: Mapping[str, Any] = field(default_factory=dict, kw_only=True)
    patches: Mapping[str, Any] = field(default_factory=dict, kw_only=True)
    changes: Mapping[str, Any] = field(default_factory=dict, kw_only=True)


LAZY = {"simulation.acceleration_gain": 0.8}
SHORT = {"simulation.duration": 60.0}
CURVATURE = "rti_mpcc.controller.fill_curvature"
BLENDING = "rti_mpcc.paper.terms._add_slopes"
OWN_UNIT = {"rti_mpcc.qp.pattern.BOUND_UNIT": 1.0}
RELAXED = {"rti_mpcc.qp.solver.OVER_RELAXATION": 1.6}
UNSCALED = {"rti_mpcc.controller.ROW_SCALING_FROM": 1e9}
TIGHT = {"solver": SolverSettings(tolerance=1e-7)}
IN_FULL = {"rti_mpcc.ocp.objectives.FIRM_TIME": 1e-9}


def _nothing(*_: object) -> None:
    """In place of a function that only writes."""


def _as_they_are(lower: Array, *_: object) -> Array:
    """In place of what relaxes the bounds of rows."""
    return lower


VARIATIONS = (
    Variation("a", "as it is", "long_approach"),
    Variation(
        "a",
        "linear progress reward, speed at its bound",
        "long_approach",
        settings={"weights": Weights(virtual_speed=0.0)},
    ),
    Variation("b", "as it is", "docking_behind"),
    Variation("b", "bound rows in their own unit", "docking_behind", patches=OWN_UNIT),
    Variation(
        "b",
        "the same with tolerance 1e-4",
        "docking_behind",
        settings={"solver": SolverSettings(tolerance=1e-4)},
        patches=OWN_UNIT,
    ),
    Variation(
        "c",
        "half-planes of far boundaries stay in the QP",
        "docking_behind",
        patches={
            "rti_mpcc.ocp.corridor_rows.NEAR": 1e3,
            "rti_mpcc.controller.corridor_rows": partial(corridor_rows, near=1e3),
        },
    ),
    Variation("d", "as it is, acceleration gain 0.8", "docking_behind", changes=LAZY),
    Variation("d", "effort in full to the end, gain 0.8", "docking_behind", patches=IN_FULL, changes=LAZY),
    Variation("d", "as it is, acceleration gain 0.8", "docking_inside", changes=LAZY),
    Variation("d", "effort in full to the end, gain 0.8", "docking_inside", patches=IN_FULL, changes=LAZY),
    Variation(
        "e",
        "progress of an arrival without a weight of its own",
        "docking_behind",
        patches={"rti_mpcc.controller.IDLE_WEIGHT": 1e-6},
    ),
    Variation("f", "as it is", "docking_behind", preset="paper"),
    Variation(
        "f",
        "progress of both signs",
        "docking_behind",
        preset="paper",
        settings={"objective": PUBLISHED["objective"].changed(progress_reverses=True)},
    ),
    Variation(
        "f",
        "no corridor rows",
        "docking_behind",
        preset="paper",
        patches={"rti_mpcc.controller.corridor_rows": _nothing},
    ),
    Variation("g", "as it is", "docking_full_course", changes=SHORT),
    Variation(
        "g",
        "no damping (full Gauss-Newton steps)",
        "docking_full_course",
        patches={"rti_mpcc.drive.search.DAMPING": 0.0, "rti_mpcc.drive.search.FIRST_DAMPING": 0.0},
        changes=SHORT,
    ),
    Variation(
        "g",
        "without the curvature of the dynamics, (Q1)",
        "docking_full_course",
        patches={CURVATURE: _nothing},
        changes=SHORT,
    ),
    Variation("l", "as it is", "docking_moving_goal"),
    Variation(
        "l",
        "lost margin requested at once",
        "docking_moving_goal",
        patches={"rti_mpcc.controller.relaxed_bounds": _as_they_are},
    ),
    *(
        Variation("n", what, scenario, preset="paper", patches=patches)
        for scenario in ("docking_inside", "docking_behind")
        for what, patches in (("as it is", {}), ("weights taken as constant", {BLENDING: _nothing}))
    ),
    *(
        Variation(letter, what, scenario, settings=settings, patches=patches)
        for scenario in ("docking_behind", "long_approach")
        for letter, what, settings, patches in (
            ("o", "as it is", {}, {}),
            ("o", "tight: all QPs to 1e-7", TIGHT, {}),
            ("o", "bounds in their own units at any distance", {}, UNSCALED),
            ("p", "over-relaxation 1.6", {}, RELAXED),
        )
    ),
)
