"""A short form of tests/acceptance/test_promises.py."""

from __future__ import annotations

import pytest

from tests.rti_mpcc.promises import hold


@pytest.mark.parametrize("chunk", [0, pytest.param(1, marks=pytest.mark.acceptance)])
def test_the_promises_hold_whatever_the_controller_is_told(chunk: int) -> None:
    hold(50, chunk)
