"""The promises on every command, over 5000 drawn runs."""

from __future__ import annotations

import pytest

from tests.rti_mpcc.promises import hold

SHORT = 3
"""Chunks of tests/rti_mpcc/test_promises.py: other numbers are other draws."""


@pytest.mark.parametrize("chunk", range(SHORT, SHORT + 20))
def test_the_promises_hold_whatever_the_controller_is_told(chunk: int) -> None:
    hold(250, chunk)
