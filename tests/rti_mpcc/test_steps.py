"""Steps as data: what they take, and every way of getting them wrong."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from math import cos, inf, nan, pi, sin
from typing import Any

import numpy as np
import pytest
import shapely

from geometry import InputError, Pose2
from rti_mpcc.mission import Approach, Dock, DockKind, DriveTo, Straight, Undock, Wait

POSE = Pose2(1.0, 2.0, pi / 2)
SQUARE = [(1.0, -1.0), (2.0, -1.0), (2.0, 1.0), (1.0, 1.0)]
KINDS: list[Callable[..., Any]] = [
    lambda **common: Dock(**common),
    lambda **common: Wait(1.0, **common),
    lambda **common: Straight(1.0, **common),
    lambda **common: Undock(1.0, **common),
    lambda **common: DriveTo(POSE, **common),
]
WORDS = ["dock", "wait", "straight", "undock", "drive_to"]
THREE = "must be three numbers > 0: [m], [m], [rad]"
TWO = "must be two numbers > 0: lateral [m], heading [rad]"
COUNT = "must be a whole number >= 0"
NO_ROUTE = "must not be 0, and at most 100 m either way"
POSITIVE = "must be > 0, and finite"
WITH_POSE = "only of a dock with a pose, to which a route is planned"


@pytest.mark.parametrize(("kind", "word"), list(zip(KINDS, WORDS, strict=True)), ids=WORDS)
def test_all_have_a_word_and_what_all_steps_have(kind: Callable[..., Any], word: str) -> None:
    def common(step: Any) -> tuple[Any, ...]:
        return step.timeout, step.patience, step.retries, step.retry_from, step.then

    assert kind().word == word
    assert common(kind()) == (inf, 15.0, 0, None, "stop")
    full = kind(timeout=5, patience=inf, retries=2, retry_from=0, then="home")
    assert common(full) == (5, inf, 2, 0, "home")


def _said(name: str, value: Any, allowed: str) -> str:
    """The message, exactly where the value is a float; for others the door says what is wanted."""
    if isinstance(value, float) and allowed not in (COUNT, TWO, THREE):
        return f"{name} = {value!r}: {allowed}"
    return f"{name} = "


@pytest.mark.parametrize("kind", KINDS, ids=WORDS)
@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        *(("timeout", value, "must be > 0") for value in (0.0, -1.0, nan, True, "5", None)),
        *(("patience", value, "must be > 0") for value in (0, -inf, nan)),
        *(("retries", value, COUNT) for value in (-1, 1.5, True, "2")),
        *(("retry_from", value, COUNT) for value in (-1, 0.5, False)),
        *(("then", value, "must be stop, continue or home") for value in ("again", None, "")),
    ],
)
def test_what_all_steps_have_is_checked(
    kind: Callable[..., Any], name: str, value: Any, allowed: str
) -> None:
    said = _said(f"{type(kind()).__name__}.{name}", value, allowed)
    with pytest.raises(InputError, match=f"^{re.escape(said)}"):
        kind(**{name: value})


BAD: list[tuple[Callable[[], Any], str]] = [
    *(
        (lambda x=x: Approach(x, 1), _said("Approach.length", x, "must be > 0 and at most 100 m"))
        for x in (0.0, -1.0, inf, nan, "2", 100.1)
    ),
    *(
        (
            lambda x=x: Approach(1.0, x),
            _said("Approach.direction", x, "must be 1 (forward) or -1 (in reverse)"),
        )
        for x in (0, 2, None, "1")
    ),
    *((lambda x=x: Straight(x), _said("Straight.distance", x, NO_ROUTE)) for x in (0.0, inf, nan, True, "1")),
    *((lambda x=x: Straight(1.0, speed=x), _said("Straight.speed", x, POSITIVE)) for x in (0.0, -0.1, inf)),
    *((lambda x=x: Straight(1.0, steering=x), _said("Straight.steering", x, POSITIVE)) for x in (0.0, nan)),
    *(
        (lambda x=x: Straight(1.0, tolerance=x), _said("Straight.tolerance", x, TWO))
        for x in ((0.1,), (0.1, 0.0), (0.1, nan), 0.1, (0.1, 0.1, 0.1))
    ),
    (lambda: Straight(1.0, until=True), "Straight.until = True: must be a function or None"),  # type: ignore[arg-type]
    *((lambda x=x: Undock(x), _said("Undock.distance", x, NO_ROUTE)) for x in (0, -inf, nan, None, 10**400)),
    *(
        (lambda x=x: Wait(x), _said("Wait.seconds", x, "must be >= 0, and finite"))
        for x in (-1.0, inf, nan, "1")
    ),
    (lambda: Wait(), "Wait.seconds = None: needs seconds, or a signal"),
    (lambda: Wait(1.0, until=5), "Wait.until = 5: must be a function or None"),  # type: ignore[arg-type]
    (lambda: DriveTo((1, 2, 3)), "DriveTo.pose = (1, 2, 3): must be a Pose2"),  # type: ignore[arg-type]
    *(
        (lambda x=x: DriveTo(POSE, tolerance=x), _said("DriveTo.tolerance", x, THREE))
        for x in ((0.1, 0.1), (0.1, 0.1, -0.1), 5)
    ),
    *(
        (lambda x=x: Dock(POSE, tolerance=x), _said("Dock.tolerance", x, THREE))
        for x in ((0.1, 0.1), (0, 1, 1))
    ),
    (lambda: Dock(name=3), "Dock.name = 3: must be text"),  # type: ignore[arg-type]
    (lambda: Dock((1, 2, 3)), "Dock.pose = (1, 2, 3): must be a Pose2 or None"),  # type: ignore[arg-type]
    (lambda: Dock(POSE, kind="known"), "Dock.kind = 'known': must be a DockKind or None"),  # type: ignore[arg-type]
    (lambda: Dock(POSE, approach=(2.0, 1)), "Dock.approach = (2.0, 1): must be an Approach or None"),  # type: ignore[arg-type]
    (lambda: Dock(contact=Wait(1.0)), "Dock.contact = "),  # type: ignore[arg-type]
    (lambda: Dock(POSE, kind=DockKind.CHARUCO), "Dock.board = None: a charuco dock has one, and no other"),
    (lambda: Dock(kind=DockKind.KNOWN), f"Dock.kind = {DockKind.KNOWN!r}: {WITH_POSE}"),
    (lambda: Dock(tolerance=(0.1, 0.1, 0.1)), f"Dock.tolerance = (0.1, 0.1, 0.1): {WITH_POSE}"),
    (lambda: Dock(approach=Approach(1.0, 1)), f"Dock.approach = {Approach(1.0, 1)!r}: {WITH_POSE}"),
    (lambda: Dock(POSE, body=[(0.0, 0.0), (1.0, 1.0)]), "Dock.body"),
    (lambda: Dock(POSE, body=[(0, 0), (1, 1), (1, 0), (0, 1)]), "Dock.body"),
    (lambda: Dock(POSE, body=[(0, 0), (1, nan), (1, 0)]), "Dock.body"),
]


@pytest.mark.parametrize(("made", "said"), BAD, ids=[said for _, said in BAD])
def test_what_is_wrong_is_refused_and_said(made: Callable[[], Any], said: str) -> None:
    with pytest.raises(InputError, match=f"^{re.escape(said)}"):
        made()


@pytest.mark.parametrize("kind", [int, float, Fraction, np.float32, np.int64])
def test_numbers_of_any_kind_are_kept_as_floats(kind: Callable[[int], Any]) -> None:
    def steps(one: Any, two: Any, three: Any) -> list[Any]:
        move = Straight(-two, speed=one, steering=one, tolerance=(one, two), timeout=two, patience=one)
        dock = Dock(
            POSE, approach=Approach(two, -1), tolerance=(one, one, two), contact=move, body=SQUARE,
            uncertainty=(two, one), timeout=two, patience=one,
        )  # fmt: skip
        return [Wait(two, timeout=three), move, Undock(-two), DriveTo(POSE, tolerance=(one, one, two)), dock]

    assert repr(steps(kind(1), kind(2), kind(3))) == repr(steps(1.0, 2.0, 3.0))


def test_counts_are_kept_as_integers_and_pairs_as_tuples() -> None:
    step = Wait(0, retries=np.int64(2), retry_from=np.int64(0))  # type: ignore[arg-type]
    assert (type(step.seconds), type(step.retries), type(step.retry_from)) == (float, int, int)
    move = Straight(-1.0, tolerance=[0.1, np.float32(0.5)])  # type: ignore[arg-type]
    assert repr(move.tolerance) == "(0.1, 0.5)"


@pytest.mark.parametrize("pose", [POSE, Pose2(-3.0, 1.0, -2.0)], ids=repr)
def test_the_body_stands_where_the_dock_is(pose: Pose2) -> None:
    body = Dock(POSE, body=SQUARE).body_at(pose)
    assert body is not None
    for corner, (x, y) in zip(body, SQUARE, strict=True):
        there = pose.compose(Pose2(x, y, 0.0))
        assert corner == pytest.approx((there.x, there.y))
    assert Dock(POSE).body_at(pose) is None


def test_a_body_may_be_wherever_the_dock_is_wrong_by() -> None:
    body = [(-4.0, -1.0), (-2.0, -1.0), (-2.0, 1.0), (-4.0, 1.0)]
    dock = Dock(POSE, body=body, approach=Approach(2.0, -1), uncertainty=(0.8, 0.2))
    (around,) = map(shapely.Polygon, dock.keep_out())
    random = np.random.default_rng(0)
    for _ in range(200):
        far, turned, turn = 0.8 * random.uniform(), random.uniform(0.0, 2.0 * pi), random.uniform(-0.2, 0.2)
        pose = replace(POSE, x=POSE.x + far * cos(turned), y=POSE.y + far * sin(turned), phi=POSE.phi + turn)
        assert around.buffer(0.05).contains(shapely.Polygon(dock.body_at(pose)))
    assert Dock(POSE, body=body).keep_out() == ()


def test_where_a_dock_may_be_takes_a_body_and_an_approach() -> None:
    said = "must be two numbers > 0, [m] and [rad], of a dock with a body and an approach"
    approach, far = Approach(1.0, -1), (1.0, 0.2)
    with pytest.raises(InputError, match=re.escape(said)):
        Dock(POSE, body=SQUARE, uncertainty=far)
    with pytest.raises(InputError, match=re.escape(said)):
        Dock(POSE, approach=approach, uncertainty=far)
    with pytest.raises(InputError, match=re.escape(said)):
        Dock(POSE, body=SQUARE, approach=approach, uncertainty=(1.0, -0.2))
