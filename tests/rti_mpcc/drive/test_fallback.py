from __future__ import annotations

import numpy as np
import pytest

from rti_mpcc.config import ControllerConfig
from rti_mpcc.drive import fallback
from rti_mpcc.drive.fallback import STOP_DISTANCE
from rti_mpcc.types import Array, Source

CONFIG = ControllerConfig()


def state(v: float = 1.0, delta: float = 0.0) -> Array:
    return np.array([0.0, 0.0, 0.0, v, delta, 0.0])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_braking_is_against_the_motion(sign: float) -> None:
    control = fallback.brake(state(sign * 2.0, 0.3), 1.6, CONFIG)
    assert control.acceleration == pytest.approx(-sign * 1.6)
    assert (control.steering_rate, control.source) == (0.0, Source.BRAKING)


@pytest.mark.parametrize("cycle", [0.005, 0.05, 0.2])
@pytest.mark.parametrize("speed", [0.5, -0.03])
def test_braking_ends_at_rest_without_turning_round(speed: float, cycle: float) -> None:
    config = ControllerConfig(cycle=cycle)
    v = speed
    for _ in range(round(4.0 / cycle)):
        v += cycle * fallback.brake(state(v), 0.4, config).acceleration
        assert v * speed >= -1e-12
    assert abs(v) <= 1e-3


@pytest.mark.parametrize("speed", [0.5, -0.5])
def test_hard_braking_is_hard_to_the_last_cycle(speed: float) -> None:
    """Softness costs way: what is braked for may be near."""
    hard = fallback.brake(state(speed), 5.0, CONFIG)
    assert hard.acceleration == pytest.approx(-np.sign(speed) * 5.0)
    last = fallback.brake(state(0.1 * speed), 5.0, CONFIG)
    assert last.acceleration * CONFIG.cycle == pytest.approx(-0.1 * speed)


@pytest.mark.parametrize("speed", [0.05, 0.2, 0.5, 2.0])
@pytest.mark.parametrize("deceleration", [0.2, 0.4, 1.2, 3.0])
def test_the_mean_deceleration_stops_as_far_as_braking_does(speed: float, deceleration: float) -> None:
    config, v, way = CONFIG.changed(cycle=0.005), speed, 0.0
    while v > 1e-4:
        before, v = v, v + config.cycle * fallback.brake(state(v), deceleration, config).acceleration
        way += 0.5 * config.cycle * (before + v)
    mean = fallback.mean_deceleration(speed, deceleration, config)
    assert speed**2 / (2.0 * mean) == pytest.approx(way, rel=0.03, abs=0.004)


def test_before_a_contact_it_brakes_as_hard_as_the_way_needs() -> None:
    assert fallback.before_contact(1.0, 10.0, CONFIG) == CONFIG.comfort_acceleration
    distance = 1.0 + STOP_DISTANCE
    assert fallback.before_contact(2.5, distance, CONFIG) == pytest.approx(2.5**2 / 2.0)
    assert fallback.before_contact(8.0, distance, CONFIG) == CONFIG.limits.acceleration
    assert fallback.before_contact(1.0, 0.0, CONFIG) == CONFIG.limits.acceleration


def test_an_even_change_of_deceleration_stops_where_it_is_to() -> None:
    """Against the closed form: v and s of a deceleration b - j t."""
    v, b, s = 0.4, 0.2, 0.25
    root = np.sqrt(4.0 * v**2 / 9.0 - 2.0 / 3.0 * b * s)
    duration = 2.0 * s / (2.0 / 3.0 * v + root)
    j = 2.0 * (b * duration - v) / duration**2
    assert v - b * duration + 0.5 * j * duration**2 == pytest.approx(0.0, abs=1e-12)
    assert v * duration - 0.5 * b * duration**2 + j * duration**3 / 6.0 == pytest.approx(s)
    assert fallback._eased(v, s, b, 0.05) == pytest.approx(b - 0.05 * j)
    # Braking too hard already it is let go, as far as the speed lets it.
    assert fallback._eased(0.2, 0.5, 0.4, 0.05) == pytest.approx(0.4 - 0.05 * 0.4**2 / (2.0 * 0.2))
