from __future__ import annotations

import numpy as np
import pytest

from benchmarks.figures import Target, distribution, ratio_row, relative_change, target_table


def test_percentiles_of_a_known_distribution() -> None:
    found = distribution(np.arange(101.0))
    assert (found.count, found.p50, found.p95, found.p99, found.max) == (101, 50.0, 95.0, 99.0, 100.0)


@pytest.mark.parametrize("values", [[], [1.0, np.nan], [np.inf]])
def test_a_distribution_of_nothing_or_of_what_is_no_number_is_refused(values: list[float]) -> None:
    with pytest.raises(ValueError, match="finite"):
        distribution(values)


def test_ratios_are_multiples_of_the_yardstick() -> None:
    row = ratio_row("cycle", distribution([1.0, 1.0]), 2.0)
    assert row == ["cycle", "1.00", "1.00", "1.00", "1.00", "2", "0.50", "0.50", "0.50"]


def test_a_target_is_met_up_to_its_bound_and_never_by_what_is_no_number() -> None:
    assert Target(name="a", value=0.5, bound=0.5).met
    assert not Target(name="a", value=0.51, bound=0.5).met
    lost = Target(name="a", value=float("nan"), bound=0.5)
    assert not lost.met
    assert lost.told()["value"] is None
    assert "| a | – | ≤ 0.50 | **not met** |" in target_table([lost])


def test_relative_change_where_something_was_never_reached() -> None:
    assert relative_change(1.02, 1.0) == pytest.approx(0.02)
    assert relative_change(None, None) == 0.0
    assert relative_change(1.0, None) == relative_change(None, 1.0) == float("inf")
