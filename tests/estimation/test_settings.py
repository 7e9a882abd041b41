"""Settings of the goal filter, and the law that a detection's noise follows."""

from __future__ import annotations

import re
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from estimation import DetectionNoise, GoalFilterConfig
from geometry.errors import ConfigError

REFUSED: list[tuple[type[Any], str, Any, str]] = [
    *(
        (DetectionNoise, field, value, allowed)
        for field in DetectionNoise.model_fields
        for value, allowed in ((0.0, "greater than 0"), (1e13, "less than or equal to"), (nan, "finite"))
    ),
    (GoalFilterConfig, "position_drift", 0.0, "greater than 0"),
    (GoalFilterConfig, "heading_drift", "wide", "number"),
    (GoalFilterConfig, "lost_after", None, "number"),
    (GoalFilterConfig, "history", inf, "finite"),
    (GoalFilterConfig, "vehicle_position_std", -0.1, "greater than or equal to 0"),
    (GoalFilterConfig, "vehicle_heading_std", -0.1, "greater than or equal to 0"),
    (GoalFilterConfig, "gate", 0.5, "greater than 0.5"),
    (GoalFilterConfig, "gate", 1.0, "less than 1"),
    (GoalFilterConfig, "confirmations", 0, "greater than or equal to 1"),
    (GoalFilterConfig, "confirmations", 101, "less than or equal to 100"),
    (GoalFilterConfig, "confirmations", 2.5, "integer"),
    (GoalFilterConfig, "moving", "perhaps", "boolean"),
    (GoalFilterConfig, "noise", 0.05, "DetectionNoise"),
]


@pytest.mark.parametrize(("make", "field", "value", "allowed"), REFUSED)
def test_a_value_out_of_range_is_refused(make: type[Any], field: str, value: Any, allowed: str) -> None:
    with pytest.raises(
        ConfigError, match=rf"{make.__name__}\.{field} = {re.escape(repr(value))}: .*{allowed}"
    ):
        make(**{field: value})


def test_a_bad_value_in_the_noise_is_named_with_the_noise() -> None:
    # As it comes from a scenario file: tables, not objects.
    given: dict[str, Any] = {"noise": {"position_std": -1.0}}
    with pytest.raises(
        ConfigError, match=r"GoalFilterConfig\.noise: .*DetectionNoise\.position_std = -1\.0: "
    ):
        GoalFilterConfig(**given)


@pytest.mark.parametrize(
    ("distance", "position", "heading"),
    [
        (10.0, 0.05, 0.035),
        (20.0, 0.1, 0.07),
        (1.0, 0.005, 0.0035),
        (0.3, 0.002, 0.00105),
        (0.0, 0.002, 0.001),
    ],
)
def test_noise_grows_with_the_range_above_its_floor(distance: float, position: float, heading: float) -> None:
    found = DetectionNoise().covariance(distance)
    assert found == pytest.approx(np.diag(np.square([position, position, heading])), abs=1e-15)
