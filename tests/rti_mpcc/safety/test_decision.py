"""What a command says of the speed and the steering that come of it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rti_mpcc.safety.decision import _within

numbers = st.floats(-20.0, 20.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("value", "now", "said"), [(0.5, 0.4, 0.5), (1.005, 0.99, 1.0), (1.2, 1.1, 1.1), (1.05, 1.1, 1.05)]
)
def test_a_planned_value_is_within_its_limit_or_no_farther_out_than_it_is(
    sign: float, value: float, now: float, said: float
) -> None:
    assert _within(sign * value, 1.0, sign * now) == sign * said


@given(value=numbers, limit=st.floats(0.1, 10.0), now=numbers)
def test_it_never_leaves_what_lies_between_both(value: float, limit: float, now: float) -> None:
    said = _within(value, limit, now)
    assert min(-limit, now) <= said <= max(limit, now)
    assert said == value or not min(-limit, now) <= value <= max(limit, now)
