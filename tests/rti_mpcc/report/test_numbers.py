"""Numbers and words for tables."""

from __future__ import annotations

import pytest

from rti_mpcc.report.numbers import number, percent


@pytest.mark.parametrize(
    ("value", "digits", "told"), [(-0.04, 1, "0.0"), (-0.06, 1, "−0.1"), (None, 2, "–"), (0.0, 0, "0")]
)
def test_what_rounds_to_zero_has_no_sign(value: float | None, digits: int, told: str) -> None:
    assert number(value, digits) == told


@pytest.mark.parametrize(
    ("share", "told"),
    [(0.0, "0.00 %"), (1e-6, "0.01 %"), (0.5, "50.00 %"), (0.999999, "99.99 %"), (1.0, "100.00 %")],
)
def test_only_all_is_rounded_to_all(share: float, told: str) -> None:
    assert percent(share) == told
