"""Whatever a setting is: it is refused in one sentence, or driven with, without a mistake of the program."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from math import isfinite
from typing import Any

import pytest
from pydantic import BaseModel

from geometry import CorridorError
from rti_mpcc import ConfigError, ControllerConfig, DockingController, VehicleState
from rti_mpcc.simulation import load_scenario
from rti_mpcc.types import Reason

SCENARIO = load_scenario("docking_moving_goal")
CONFIG = SCENARIO.controller_config("default")
PATH = SCENARIO.build_path()
CORRIDOR = SCENARIO.build_corridor(PATH)
NUMBERS = (0, 1e-9, 1e-3, 1, 1e9)
BLOCKS = 2
CYCLES = 3


def others(settings: BaseModel) -> Iterator[BaseModel | None]:
    """The same settings with one number, of however deep a group, that is another one; None if refused."""
    for name in type(settings).model_fields:
        value = getattr(settings, name)
        if isinstance(value, BaseModel):
            for other in others(value):
                yield None if other is None else _with(settings, name, other)
        elif isinstance(value, bool):
            yield _with(settings, name, not value)
        elif isinstance(value, int | float | None):
            for number in NUMBERS:
                yield _with(settings, name, int(number) if isinstance(value, int) else number)
        elif isinstance(value, tuple):
            for place in range(len(value)):
                for number in NUMBERS:
                    yield _with(settings, name, (*value[:place], number, *value[place + 1 :]))


def _with(settings: BaseModel, name: str, value: Any) -> BaseModel | None:
    given = {field: getattr(settings, field) for field in type(settings).model_fields}
    try:
        return type(settings)(**{**given, name: value})
    except ConfigError:
        return None


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("block", range(BLOCKS))
def test_any_number_is_refused_or_driven_with(block: int) -> None:
    begin = PATH.parts[0].pose(1.0)
    state = VehicleState(x=begin.x, y=begin.y - 0.9, phi=begin.phi, v=0.5, delta=0.0)
    driven = 0
    for config in islice(others(CONFIG), block, None, BLOCKS):
        if config is None:
            continue
        assert isinstance(config, ControllerConfig)
        try:
            controller = DockingController(PATH, CORRIDOR, config)
        except (ConfigError, CorridorError):  # a body that is wider than the corridor
            continue
        for cycle in range(CYCLES):
            command = controller.step(state, now=cycle * config.cycle, goal=SCENARIO.planned_goal())
            assert command.diagnostics.cause is not Reason.INTERNAL_ERROR, (
                config,
                command.diagnostics.reason,
            )
            assert isfinite(command.acceleration)
            assert isfinite(command.steering_rate)
        driven += 1
    assert driven > 50
