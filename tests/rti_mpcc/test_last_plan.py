"""While no QP is solved the last plan is driven, for as long and as near to it as the settings allow."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.encounters import Car, Plant, on_lane
from rti_mpcc import Command, ControllerConfig, Source
from rti_mpcc.clock import Decisions, PlayedBack
from rti_mpcc.drive.fallback import PLAN_LIFE, PLAN_OFFSET
from rti_mpcc.qp.solver import Stop

CONFIG = ControllerConfig()
FAILED = Decisions(granted=(True,) * 40, stops=(Stop("forced to fail", 0),) * 40)


def after_failures(cycles: int, turned: float = 0.0) -> list[Command]:
    """The commands of cycles without a solution, `turned` [rad] off, of a vehicle that has driven for 1 s."""
    driven, plant = on_lane(40.0, 40.0, CONFIG), Plant(car=Car(config=CONFIG), x=0.0, y=0.0, phi=0.0)
    commands = []
    for k in range(20 + cycles):
        state, clock = plant.measured, None
        if k >= 20:
            state, clock = replace(state, phi=state.phi + turned), PlayedBack(FAILED)
        commands.append(driven.step(state, now=CONFIG.cycle * k, clock=clock))
        plant.obey(commands[-1], CONFIG.cycle)
    return commands[20:]


def test_the_last_plan_is_driven_for_its_time_and_no_longer() -> None:
    sources = [command.source for command in after_failures(25)]
    count = sources.index(Source.BRAKING)
    assert sources[:count] == [Source.SHIFTED_PLAN] * count
    assert count * CONFIG.cycle == pytest.approx(PLAN_LIFE, abs=1.1 * CONFIG.cycle)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("share", "source"), [(0.9, Source.SHIFTED_PLAN), (1.1, Source.BRAKING)])
def test_the_last_plan_is_not_driven_with_the_heading_too_far_off(
    sign: float, share: float, source: Source
) -> None:
    _, most = PLAN_OFFSET
    (command,) = after_failures(1, sign * share * most)
    assert command.source is source
