"""Obstacles that appear anywhere, and 200 people who walk: no collision that could have been avoided."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from benchmarks.collisions import check_chatter, keep_promises, meet


@pytest.mark.parametrize("chunk", range(1, 9))
def test_the_promises_hold_for_what_appears_anywhere(chunk: int) -> None:
    for seed in range(40 * chunk, 40 * chunk + 40):
        keep_promises(seed)


@pytest.mark.parametrize("lag", [0.0, 0.2])
@pytest.mark.parametrize("number", range(100))
def test_nobody_who_walks_in_plain_sight_is_run_into(
    number: int, lag: float, figures: dict[str, Any]
) -> None:
    kind, found = meet(number, 191, lag=lag)
    figures["walk"] = kind
    figures["docked"] = found.docked
    figures["clearance_m"] = found.clearance
    figures["contact_speeds"] = [contact.speed for contact in found.contacts]
    figures["largest_acceleration"] = float(np.max([abs(each.acceleration) for each in found.commands]))
    assert not any(contact.front for contact in found.collisions)
    check_chatter(found)
