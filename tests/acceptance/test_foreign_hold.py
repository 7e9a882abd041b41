"""Random foreign vehicles stay where they docked (`tests.rti_mpcc.hold_draws`)."""

from __future__ import annotations

from typing import Any

import pytest

from tests.rti_mpcc.hold_draws import draws, stay_of

SEED = 47_311
BATCHES, SIZE = 30, 10


@pytest.mark.parametrize("batch", range(BATCHES))
def test_random_foreign_vehicles_stay_where_they_docked(batch: int, figures: dict[str, Any]) -> None:
    stays = [stay_of(draw, draw.drive()) for draw in draws(SIZE, SEED + batch)]
    figures["docked"] = sum(each.docked_at is not None for each in stays)
    figures["largest_share_moved"] = max(each.share for each in stays)
    assert all(each.good for each in stays), [(k, each) for k, each in enumerate(stays) if not each.good]
