"""What is asked of a goal beside its pose."""

from __future__ import annotations

from dataclasses import dataclass

from geometry.settings import replaced
from rti_mpcc.config import ControllerConfig

Outline = tuple[tuple[float, float], ...]
"""Corners x, y [m], of a value that can be compared."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GoalTerms:
    """What is asked of a goal, where that is not what the settings say.

    Attributes:
        tolerance: longitudinal [m], lateral [m], heading [rad]; None: `ControllerConfig.goal_tolerance`.
        detected: whether the vehicle has docked only where the goal was seen; None: `GoalTracking.required`.
        approach: length [m] and direction, +1 or -1, of the straight last piece of a planned way; None:
            `RoutePlanner.final_straight`.
        keep_out: outlines [m] that a planned way keeps out of before that piece, until the goal has
            been detected.
    """

    tolerance: tuple[float, float, float] | None = None
    detected: bool | None = None
    approach: tuple[float, int] | None = None
    keep_out: tuple[Outline, ...] = ()

    def on(self, config: ControllerConfig) -> ControllerConfig:
        """The settings with what is asked here."""
        changes: dict[str, object] = {}
        if self.tolerance is not None:
            changes["goal_tolerance"] = self.tolerance
        if self.detected is not None:
            tracking = config.goal_tracking
            changes["goal_tracking"] = replaced(tracking, required=self.detected)
        if self.approach is not None:
            length, direction = self.approach
            straight = {"final_straight": length, "final_direction": direction}
            changes["route"] = replaced(config.route, **straight)
        return replaced(config, **changes) if changes else config


NO_TERMS = GoalTerms()
"""What the settings say."""
