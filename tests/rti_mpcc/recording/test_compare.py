"""Differences of recorded and replayed data."""

from __future__ import annotations

from dataclasses import fields
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from rti_mpcc.recording.compare import TIMES, differences
from rti_mpcc.recording.lines import to_data
from rti_mpcc.types import Diagnostics


def found(recorded: Any, replayed: Any, tolerance: float = 0.0) -> list[str]:
    return [
        difference.field
        for difference in differences(to_data({"a": recorded}), to_data({"a": replayed}), tolerance)
    ]


LARGE = np.arange(100.0).reshape(50, 2)
NEXT = float(np.nextafter(1.0, 2.0))


@pytest.mark.parametrize(
    "value",
    [
        1.0,
        0,
        nan,
        inf,
        "word",
        None,
        [1.0, {"b": nan}],
        {},
        np.array([1.0, nan]),
        LARGE,
        np.array(1.0),
    ],
)
@pytest.mark.parametrize("tolerance", [0.0, 1e-9])
def test_the_same_is_the_same(value: Any, tolerance: float) -> None:
    assert found(value, value, tolerance) == []


@pytest.mark.parametrize(
    ("one", "other", "bits", "near"),
    [
        (1.0, NEXT, ["a"], []),
        (0.0, -0.0, ["a"], []),
        (1e12, 1e12 + 1.0, ["a"], []),
        (1.0, 1.0 + 1e-8, ["a"], ["a"]),
        (0.0, 2e-9, ["a"], ["a"]),
        (1.0, nan, ["a"], ["a"]),
        (inf, 1e308, ["a"], ["a"]),
        (inf, -inf, ["a"], ["a"]),
        (3, 4, ["a"], ["a"]),
        (True, 1, ["a"], ["a"]),
        ("x", "y", ["a"], ["a"]),
        (None, 0.0, ["a"], ["a"]),
        ([1.0], [1.0, 2.0], ["a"], ["a"]),
        ([1.0, 2.0], [1.0, 3.0], ["a[1]"], ["a[1]"]),
        ([1.0, 2.0, 3.0], [1.0, 3.0, 4.0], ["a[1]"], ["a[1]"]),
        ([{"b": 1, "c": 1}, 1], [{"b": 2, "c": 2}, 2], ["a[0].b", "a[0].c"], ["a[0].b", "a[0].c"]),
        (np.empty((0, 2)), np.empty((0, 3)), ["a.shape[1]"], ["a.shape[1]"]),
        (3.0, 3, ["a"], ["a"]),
        ({"b": 1, "c": 2}, {"b": 1, "d": 2}, ["a.c", "a.d"], ["a.c", "a.d"]),
        (np.array([1.0, 2.0]), np.array([NEXT, 3.0]), ["a[0]"], ["a[1]"]),
        (np.array([1.0, 2.0]), np.array([[1.0, 2.0]]), ["a"], ["a"]),
        (np.array([0.0]), np.array([-0.0]), ["a[0]"], []),
        (np.array([1.0, inf]), np.array([1.0, 1.0]), ["a[1]"], ["a[1]"]),
        (LARGE, LARGE + np.eye(50, 2, -3), ["a[3][0]"], ["a[3][0]"]),
    ],
)
def test_differences_bit_for_bit_and_nearly(one: Any, other: Any, bits: list[str], near: list[str]) -> None:
    assert found(one, other) == bits
    assert found(one, other, 1e-9) == near


def test_times_are_all_that_is_left_out() -> None:
    assert {field.name for field in fields(Diagnostics) if field.name.endswith("_ms")} == TIMES
    assert found({"step_ms": 1.0, "slack": 1.0}, {"step_ms": 2.0, "slack": 2.0}) == ["a.slack"]
