"""The promises on every command, over 6000 random cases."""

from __future__ import annotations

import pytest

from tests.rti_mpcc.promises import keep_promises

FIRST = 100
"""Seeds of tests/rti_mpcc/test_promises.py are below."""


@pytest.mark.parametrize("chunk", range(20))
def test_the_promises_hold_whatever_the_controller_is_given(chunk: int) -> None:
    for seed in range(FIRST + 250 * chunk, FIRST + 250 * (chunk + 1)):
        keep_promises(seed)
    for seed in range(FIRST + 50 * chunk, FIRST + 50 * (chunk + 1)):
        keep_promises(seed, in_area=True)
