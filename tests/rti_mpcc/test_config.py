"""Settings that are refused: the message names the field, the value and what is allowed."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import inf, nan
from pathlib import Path
from typing import Any

import pytest
from pydantic import ValidationError

from geometry.settings import Settings
from rti_mpcc import Clearance, ControllerConfig, Limits, SolverSettings, Vehicle, Weights
from rti_mpcc.errors import ConfigError

REFUSED: list[tuple[Callable[..., Any], str, Any, str]] = [
    (ControllerConfig, "cycle", 0.3, "less than or equal to 0.2"),
    (ControllerConfig, "cycle", 0.004, "greater than or equal to 0.005"),
    (ControllerConfig, "cycle", nan, "finite"),
    (ControllerConfig, "cycle", "fast", "number"),
    (ControllerConfig, "cycle", None, "number"),
    (ControllerConfig, "dead_time", -0.1, "greater than or equal to 0"),
    (ControllerConfig, "stages", 70.5, "integer"),
    (ControllerConfig, "comfort_acceleration", 0.0, "greater than 0"),
    (ControllerConfig, "arrival_horizon", inf, "finite"),
    (ControllerConfig, "deadline", 0.001, "greater than 0.001"),
    (ControllerConfig, "vehicle", 3, "Vehicle"),
    (ControllerConfig.paper, "cycle", 1.0, "less than or equal to 0.2"),
    (ControllerConfig.paper_printed, "stages", 0, "greater than or equal to 10"),
    (Vehicle, "width", -2.0, "greater than 0"),
    (Vehicle, "outline", ((0.0, 0.0), (1.0, 1.0)), "at least 3"),
    (Vehicle, "outline", ((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)), "not a simple polygon"),
    (Vehicle, "outline", "a box", "number"),
    (Limits, "steering", 1.5, "less than or equal to 1.4"),
    (Weights, "lag", -1.0, "greater than or equal to 0"),
    (Clearance, "least", -0.01, "greater than or equal to 0"),
    (SolverSettings, "tolerance", 0.0, "greater than or equal to 0.00000001"),
]


@pytest.mark.parametrize(("make", "field", "value", "allowed"), REFUSED)
def test_a_value_out_of_range_is_refused(
    make: Callable[..., Any], field: str, value: Any, allowed: str
) -> None:
    with pytest.raises(ConfigError, match=rf"\.{field} = {re.escape(repr(value))}: .*{allowed}"):
        make(**{field: value})


@pytest.mark.parametrize("make", [ControllerConfig, ControllerConfig.paper, Limits, Vehicle, Weights])
def test_an_unknown_setting_is_refused(make: Callable[..., Any]) -> None:
    with pytest.raises(ConfigError, match=r"\.cycel is not a setting"):
        make(cycel=0.05)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"footprint": {"margin": 0.1}}, "footprint is not a setting any more, but clearance.wanted"),
        ({"caution": {"hard_minimum": 0.1}}, "caution is not a setting any more, but clearance.least"),
        ({"solver": {"polish": True}}, "polish is not a setting any more, but a constant"),
        ({"solver": {"max_iterations": 400}}, "max_iterations is not a setting any more, but a constant"),
        ({"weights": {"bound_speed": 20.0}}, "bound_speed is not a setting any more, but a setting of `obj"),
        ({"route": {"slices": 3}}, "slices is not a setting any more, but a constant"),
        ({"disturbance": {"gap": 2.0}}, "gap is not a setting any more, but a constant"),
        ({"method": "separated"}, "method is not a setting any more, but objective"),
    ],
)
def test_a_former_setting_is_refused_with_what_it_is_now(values: dict[str, Any], said: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(said)):
        ControllerConfig(**values)


@pytest.mark.parametrize(
    ("tolerance", "where"),
    [((0.05, 0.0, 0.03), "1"), ((0.05, 0.05, 4.0), "2"), ((0.05, 0.05), "2"), ((nan, 0.05, 0.03), "0")],
)
def test_a_bad_goal_tolerance_is_refused(tolerance: Any, where: str) -> None:
    with pytest.raises(ConfigError, match=rf"ControllerConfig\.goal_tolerance\.{where}"):
        ControllerConfig(goal_tolerance=tolerance)


def test_everything_that_is_wrong_is_said_at_once() -> None:
    with pytest.raises(ConfigError, match=r"cycle = 9\.0: .*stages = 1: "):
        ControllerConfig(cycle=9.0, stages=1)


def test_settings_cannot_be_changed_and_take_no_positions() -> None:
    config = ControllerConfig()
    with pytest.raises(ValidationError):
        config.cycle = 0.1
    with pytest.raises(TypeError):
        ControllerConfig(Vehicle())  # type: ignore[call-arg]


def test_presets_take_changes() -> None:
    assert ControllerConfig.paper(cycle=0.1).cycle == 0.1
    assert ControllerConfig.paper().cruise_horizon == 7.0
    assert not ControllerConfig.paper_printed().arrival


def test_the_deadline_follows_the_cycle_unless_it_is_given() -> None:
    assert ControllerConfig().deadline == pytest.approx(0.015)
    assert ControllerConfig().changed(cycle=0.02).deadline == pytest.approx(0.01)
    assert ControllerConfig(cycle=0.005).deadline == pytest.approx(0.003)
    assert ControllerConfig.paper(cycle=0.1).deadline == pytest.approx(0.03)
    assert ControllerConfig(deadline=None).changed(cycle=0.02).deadline is None
    assert ControllerConfig(deadline=0.02).changed(cycle=0.1).deadline == 0.02


# -- the groups ----------------------------------------------------------------------------------------------

ROOT = Path(__file__).parents[2]
GROUPS = sorted(
    {type(value) for _, value in ControllerConfig() if isinstance(value, Settings)} | {ControllerConfig},
    key=lambda group: group.__name__,
)


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.__name__)
def test_every_setting_is_documented(group: type[Settings]) -> None:
    _, _, attributes = (group.__doc__ or "").partition("Attributes:")
    told = {name for name in group.model_fields if re.search(rf"\b{name}(?:[:,`]| \[)", attributes)}
    assert set(group.model_fields) - told == set()


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.__name__)
def test_every_setting_is_read_somewhere(group: type[Settings]) -> None:
    packages = (ROOT / "rti_mpcc", ROOT / "estimation")
    files = [file for package in packages for file in package.rglob("*.py")]
    code = "\n".join(file.read_text(encoding="utf-8") for file in files)
    assert [name for name in group.model_fields if not re.search(rf"\w\.{name}\b(?!`)", code)] == []


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.__name__)
def test_no_group_takes_nan(group: type[Settings]) -> None:
    for name in group.model_fields:
        with pytest.raises(ConfigError, match=rf"{group.__name__}\.{name}"):
            group(**{name: nan})


def test_the_least_clearance_is_not_above_the_wanted_one() -> None:
    with pytest.raises(ConfigError, match=r"least = 0\.2 m must not be above wanted = 0\.1 m"):
        Clearance(least=0.2)


@pytest.mark.parametrize("name", ["width", "front", "rear"])
def test_what_follows_from_an_outline_is_not_given_another_value(name: str) -> None:
    outline = ((-1.0, -0.5), (2.0, -0.5), (2.0, 0.5), (-1.0, 0.5))
    with pytest.raises(ConfigError, match=f"{name} = 5.0 beside an outline"):
        Vehicle(outline=outline, **{name: 5.0})
    whole = Vehicle(outline=outline)
    assert Vehicle(**whole.model_dump()) == whole
