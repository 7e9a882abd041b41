"""What every public constructor and function takes, and that it refuses the rest in one sentence."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from geometry import Corridor, InputError, Pose2, ReferencePath, RtiMpccError
from rti_mpcc import CharucoGoalDetector, ControllerConfig, DockingController, DockingMission, plan_manoeuvre
from rti_mpcc.mission.step import STEPS, Step
from tests.inputs.arguments import (
    AREA,
    BOARD,
    CAMERA,
    CONFIG,
    DOORS,
    MADE_BY_US,
    NEEDS_OPENCV,
    NEVER_RAISES,
    OF_RESULTS,
    parameters,
    public,
)

FILES = frozenset({"Area.from_map", "ReferencePath.from_csv"})
SETTINGS_ONLY = frozenset(
    {
        "ControllerConfig.paper",
        "ControllerConfig.paper_printed",
        "Clearance.of_size",
        "Clearance.model_post_init",
    }
)
OF_MISSIONS = frozenset(
    f"{step.__name__}.{name}" for step in STEPS.values() for name in vars(step) if hasattr(Step, name)
)
"""What a mission calls of its steps."""


def test_every_public_signature_is_here() -> None:
    left_out = NEVER_RAISES | OF_RESULTS | NEEDS_OPENCV | FILES | SETTINGS_ONLY | OF_MISSIONS
    for name, function in public():
        names = parameters(function)
        if name.split(".")[0] in MADE_BY_US or name in left_out or not names:
            continue
        assert name in DOORS, f"{name}{inspect.signature(function)} has no valid arguments in arguments.py"
        assert set(DOORS[name].valid) == set(names), name


def _others(value: Any) -> Iterator[Any]:
    """The same value as numbers of other kinds, and in other containers."""
    if isinstance(value, bool) or value is None:
        return
    if isinstance(value, float | int):
        yield np.float64(value)
        yield np.array(float(value))
        if float(value).is_integer():
            yield int(value)
            yield np.int32(value)
            yield np.float32(value)
    if isinstance(value, np.ndarray):
        yield value.tolist()
        yield np.asfortranarray(value)
        yield np.repeat(value, 2, axis=0)[::2]
        frozen = value.copy()
        frozen.setflags(write=False)
        yield frozen
        yield value.astype(np.float32)
        if (value == value.astype(np.int64)).all():
            yield value.astype(np.int64)
    if isinstance(value, list | tuple) and value and isinstance(value[0], tuple | float):
        yield tuple(value)
        yield list(value)
        yield np.array(value)
        yield np.array(value).astype(np.int64) if (np.array(value) % 1 == 0).all() else np.array(value)


def _alike(found: Any, expected: Any) -> bool:
    """Whether two results say the same, as far as they show it."""
    if isinstance(expected, bool | float | np.ndarray | np.generic):
        return bool(np.allclose(found, expected, rtol=1e-6, equal_nan=True))
    shown = [repr(each) for each in (found, expected)]
    return type(found) is type(expected) and ("object at 0x" in shown[0] or shown[0] == shown[1])


@cache
def _expected(name: str) -> Any:
    return DOORS[name].call(**DOORS[name].valid)


SAME = [(name, argument) for name, door in DOORS.items() for argument in door.valid]


@pytest.mark.parametrize(("name", "argument"), SAME)
def test_numbers_of_all_kinds_do(name: str, argument: str) -> None:
    door, expected = DOORS[name], _expected(name)
    for other in _others(door.valid[argument]):
        found = door.call(**{**door.valid, argument: other})
        assert _alike(found, expected), f"{name}({argument}={other!r})"


class _Strange:
    def __repr__(self) -> str:
        return "_Strange()"


WILD: list[Any] = [
    "text", "1.0", b"1", True, (), [], {}, {"a": 1}, {1, 2}, _Strange(), _Strange, len, 1j, [[1], [1, 2]],
    ["a", "b"], [None], (1, 2, 0), np.array(["1"]), np.array([True]), np.zeros((2, 2)), np.zeros(0),
    Pose2(1.0, 2.0, 0.0), ControllerConfig(), AREA, Ellipsis, None,
]  # fmt: skip
NUMBERS: list[Any] = [
    float("nan"), float("inf"), -float("inf"), 0, -1, 1e300, -1e300, 1e-300, 10**400, np.float32(2.5), np.nan,
]  # fmt: skip


@pytest.mark.parametrize(("name", "argument"), SAME)
def test_what_is_wrong_is_refused_in_one_sentence(name: str, argument: str) -> None:
    door = DOORS[name]
    for wild in WILD:
        try:
            door.call(**{**door.valid, argument: wild})
        except RtiMpccError as error:
            said = str(error)
            assert "\n" not in said, f"{name}({argument}={wild!r}): {said}"
            assert len(said) < 500, f"{name}({argument}={wild!r}): {said}"


@pytest.mark.parametrize(("name", "argument"), SAME)
def test_the_wrong_type_is_never_taken_for_a_default(name: str, argument: str) -> None:
    door = DOORS[name]
    value = door.valid[argument]
    if callable(value) or value is None or isinstance(value, str):
        return
    wild: Any
    for wild in ("text", {}, _Strange(), b"1"):
        with pytest.raises(RtiMpccError, match=argument):
            door.call(**{**door.valid, argument: wild})


def _drawn(draws: int) -> Any:
    return settings(
        max_examples=draws,
        deadline=None,
        suppress_health_check=list(HealthCheck),
        database=None,
        derandomize=draws < 100,
    )


def _values() -> st.SearchStrategy[Any]:
    plain = st.one_of(
        st.sampled_from(WILD),
        st.sampled_from(NUMBERS),
        st.floats(-1e3, 1e3),
        st.integers(-5, 5),
        st.text(max_size=3),
    )
    return st.recursive(plain, lambda inner: st.lists(inner, max_size=4), max_leaves=8)


def _fuzz(name: str, draws: int) -> None:
    door = DOORS[name]

    @_drawn(draws)  # type: ignore[untyped-decorator]
    @given(st.dictionaries(st.sampled_from(sorted(door.valid)), _values(), min_size=1, max_size=2))
    def at(wild: dict[str, Any]) -> None:
        try:
            door.call(**{**door.valid, **wild})
        except RtiMpccError as error:
            assert "\n" not in str(error)  # noqa: PT017

    at()


@pytest.mark.parametrize("name", DOORS)
def test_no_foreign_traceback(name: str) -> None:
    _fuzz(name, 20)


@pytest.mark.acceptance
@pytest.mark.parametrize("name", DOORS)
def test_no_foreign_traceback_of_many(name: str) -> None:
    _fuzz(name, 2000)


def _of(*given: Any) -> Any:
    return given


def _planned(**wrong: Any) -> Any:
    return plan_manoeuvre(**{"start": Pose2(0, 0, 0), "goal": Pose2(1, 0, 0), "area": AREA, **wrong})


def test_the_first_thing_that_anybody_types() -> None:
    path = ReferencePath.from_segments(Pose2(0, 0, 0), [(1, 0, 40)])
    assert Corridor.from_offsets(path, left=5, right=-5).narrowest() == (10.0, 0.0)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: _planned(goal=(1, 2, 0)), r"goal = \(1, 2, 0\): must be a Pose2"),
        (lambda: _planned(config={}), "config = {}: must be a ControllerConfig"),
        (lambda: DockingController.in_area(*_of(None)), "area = None: must be an Area"),
        (lambda: DockingMission(*_of(None, [])), "controller = None: must be a DockingController"),
        (
            lambda: ReferencePath.from_segments(*_of([(1, 0, 4)], Pose2(0, 0, 0))),
            "start = .*: must be a Pose2",
        ),
        (lambda: CharucoGoalDetector(*_of(BOARD, CAMERA)), "camera = .*: must be a Camera"),
        (lambda: DockingController(*_of(CONFIG, None)), "path = .*: must be a ReferencePath"),
    ],
)
def test_swapped_and_missing_arguments_are_named(call: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        call()
