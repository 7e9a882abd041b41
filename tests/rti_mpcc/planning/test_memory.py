from __future__ import annotations

from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest

from rti_mpcc.planning.memory import ControllerMemory, Phase, renewed


def values(memory: ControllerMemory) -> list[object]:
    return [getattr(memory, field.name) for field in fields(memory)]


def test_a_renewed_memory_is_what_replace_makes_of_it() -> None:
    memory = ControllerMemory(time=2.0, part=1, reached=np.zeros(6), latched="why")
    before = values(memory)
    got = renewed(memory, part=2, phase=Phase.HOLDING)
    wanted = replace(memory, part=2, phase=Phase.HOLDING)
    assert all(one is other for one, other in zip(values(got), values(wanted), strict=True))
    assert all(one is other for one, other in zip(values(memory), before, strict=True))


def test_a_memory_to_which_nothing_is_new_stays_itself() -> None:
    memory = ControllerMemory(time=2.0, latched="why")
    assert renewed(memory, time=memory.time, halt=None) is memory


def test_a_renewed_memory_is_frozen() -> None:
    got = renewed(ControllerMemory(), part=2)
    with pytest.raises(FrozenInstanceError):
        got.part = 3  # type: ignore[misc]


def test_what_a_memory_does_not_have_cannot_be_renewed() -> None:
    with pytest.raises(AttributeError):
        renewed(ControllerMemory(), parts=2)  # type: ignore[call-arg]
