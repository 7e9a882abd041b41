"""A cost term from outside the package, of docs/tutorials/own_objective.md: gradient, effect, settings."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rti_mpcc import ConfigError, ControllerConfig
from rti_mpcc.config import CostTerm, DockingObjective
from rti_mpcc.docking import DockingController
from rti_mpcc.ocp.objectives import CONTOURING, Linearised
from rti_mpcc.ocp.stage_cost import QuadraticCost, add_residual
from rti_mpcc.recording import Recorder, read_recording, replay
from rti_mpcc.simulation import RunResult, changed, load_scenario, simulate, summary
from tests.rti_mpcc.own_code import shown_class

SCENARIO = changed(load_scenario("docking_inside"), {"simulation.cycle": 0.1})


@pytest.fixture(scope="module")
def kind() -> Iterator[Any]:
    """The class that the page shows, as typed in a module of its own."""
    with shown_class("tutorials/own_objective.md", "LateralJerk", CostTerm.KINDS, "LateralJerk") as shown:
        yield shown


def with_term(term: CostTerm) -> ControllerConfig:
    config = SCENARIO.controller_config()
    return config.changed(objective=DockingObjective(terms=(term,)))


def driven(config: ControllerConfig, file: Path | None = None) -> RunResult:
    path = SCENARIO.build_path()
    controller: Any = DockingController(path, SCENARIO.build_corridor(path), config)
    if file is None:
        return simulate(SCENARIO, controller=controller)
    with Recorder(controller, file) as recorder:
        return simulate(SCENARIO, controller=recorder)


@pytest.fixture(scope="module")
def usual() -> RunResult:
    """Without the term."""
    return driven(SCENARIO.controller_config())


def lateral_jerk(result: RunResult) -> float:
    """Integral of its square [m²/s⁵], over 0.1 s each: the plant's steps show the cycles."""
    truth = result.truth
    lateral = np.interp(np.arange(0.0, truth.times[-1], 0.1), truth.times, truth.lateral_acceleration)
    return float(0.1 * np.sum((np.diff(lateral) / 0.1) ** 2))


def test_its_gradient_is_that_of_its_cost(kind: Any) -> None:
    random, stages = np.random.default_rng(3), 5
    states = random.normal(size=(stages + 1, 6)) * (5.0, 5.0, 1.0, 1.0, 0.3, 5.0)
    controls = random.normal(size=(stages, 3)) * (0.5, 0.3, 1.0)
    config = ControllerConfig()
    path = SCENARIO.build_path()
    plan = Linearised(
        states, states, controls, np.full(stages, 0.2), None,
        CONTOURING.weights(config, None, states[:, 5], np.full(stages, 0.2)),  # type: ignore[arg-type]
        SCENARIO.build_corridor(path), 0, config,
    )  # fmt: skip
    term = kind(weight=3.0)

    def cost(states: Any, controls: Any) -> float:
        weights, values, *_ = term.residual(replace(plan, states=states, local=states, controls=controls))
        return float(np.sum(weights * values**2))

    found = QuadraticCost(
        np.zeros((stages + 1, 6, 6)), np.zeros((stages + 1, 6)), np.zeros((stages, 3)), np.zeros((stages, 3))
    )
    add_residual(found, term.residual(plan))
    parts: list[tuple[Any, Any, Callable[[Any], float]]] = [
        (states, found.state_gradient, lambda moved: cost(moved, controls)),
        (controls, found.control_gradient, lambda moved: cost(states, moved)),
    ]
    for values, gradient, of in parts:
        for index in np.ndindex(values.shape):
            step = np.zeros(values.shape)
            step[index] = 1e-6
            slope = (of(values + step) - of(values - step)) / 2e-6
            assert gradient[index] == pytest.approx(slope, rel=1e-5, abs=1e-6)
    eigenvalues = np.linalg.eigvalsh(found.state_hessian)
    assert eigenvalues.min() > -1e-9
    assert (found.control_hessian >= 0.0).all()


def test_it_changes_the_ride_and_a_recording_holds_it(kind: Any, usual: RunResult, tmp_path: Path) -> None:
    file = tmp_path / "own.jsonl"
    calm = driven(with_term(kind(weight=300.0)), file)
    assert summary(calm)["docked"]
    assert lateral_jerk(calm) < 0.8 * lateral_jerk(usual)
    assert replay(file).identical
    (term,) = read_recording(file).header.config.objective.terms
    assert term == kind(weight=300.0)


def test_no_weight_is_no_term(kind: Any, usual: RunResult) -> None:
    none = driven(with_term(kind(weight=0.0)))
    assert none.cycles.acceleration.tolist() == usual.cycles.acceleration.tolist()


def test_wrong_settings_are_named(kind: Any) -> None:
    with pytest.raises(ConfigError, match="weight = -1"):
        kind(weight=-1.0)
    with pytest.raises(
        ConfigError, match="cost term 'Other' is not known: import the module that defines it"
    ):
        DockingObjective(terms=({"kind": "Other"},))  # type: ignore[arg-type]
