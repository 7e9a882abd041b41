"""What is asked of a goal beside its pose, put into the settings."""

from __future__ import annotations

import pytest

from rti_mpcc.config import ControllerConfig, GoalTracking
from rti_mpcc.planning.goals import NO_TERMS, GoalTerms

CONFIG = ControllerConfig(dead_time=0.2)


def test_where_nothing_is_asked_the_settings_are_the_same() -> None:
    assert NO_TERMS.on(CONFIG) is CONFIG
    assert GoalTerms() == NO_TERMS


@pytest.mark.parametrize("required", [True, False])
def test_each_term_changes_its_own_setting_only(required: bool) -> None:
    config = CONFIG.model_copy(update={"goal_tracking": GoalTracking(required=not required)})
    tolerance = GoalTerms(tolerance=(0.1, 0.2, 0.3)).on(config)
    assert tolerance == config.model_copy(update={"goal_tolerance": (0.1, 0.2, 0.3)})
    seen = GoalTerms(detected=required).on(config)
    assert seen.goal_tracking == config.goal_tracking.model_copy(update={"required": required})
    assert seen.model_copy(update={"goal_tracking": config.goal_tracking}) == config
    into = GoalTerms(approach=(2.5, -1)).on(config)
    assert (into.route.final_straight, into.route.final_direction) == (2.5, -1)
    assert into.model_copy(update={"route": config.route}) == config
    all_three = GoalTerms(tolerance=(0.1, 0.2, 0.3), detected=required, approach=(2.5, -1)).on(config)
    assert (all_three.goal_tolerance, all_three.route) == ((0.1, 0.2, 0.3), into.route)
    assert all_three.goal_tracking.required is required
    assert config.goal_tracking.required is not required  # the settings that came in stay
