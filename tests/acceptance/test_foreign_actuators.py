"""200 random vehicles of unknown dead times and lags, obeying rates or set-points, with default settings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.rti_mpcc.actuator_draws import case, driven

GROUPS, DRAWS, FIRST_SEED = 10, 20, 4_700_000
SLOWER, HARDER = 1.15, 1.25  # than with the actuators given; than comfort


@pytest.mark.parametrize("group", range(GROUPS))
def test_unknown_actuators_are_as_good_as_known_ones(group: int, figures: dict[str, Any]) -> None:
    rows = []
    for seed in range(FIRST_SEED + group * DRAWS, FIRST_SEED + (group + 1) * DRAWS):
        drawn = case(seed)
        rows.append((drawn, driven(drawn), driven(drawn, drawn.told)))
    ratios = [unknown.seconds / known.seconds for _, unknown, known in rows]
    figures["time_ratio"] = {"p50": float(np.median(ratios)), "max": max(ratios)}
    figures["peak_over_comfort"] = max(unknown.peak for _, unknown, _ in rows)
    figures["docked"] = sum(unknown.docked for _, unknown, _ in rows)
    for drawn, unknown, known in rows:
        assert (known.docked, known.touched) == (True, False), drawn
        assert not any("answers" in command.diagnostics.reason for command in known.ride.commands), drawn
        assert (unknown.docked, unknown.touched) == (True, False), drawn
        assert unknown.seconds <= SLOWER * known.seconds, drawn
        assert unknown.peak <= HARDER, drawn
