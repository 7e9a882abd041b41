"""Where the vehicle may be: the corridor with the obstacles that are known by now."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from geometry import Corridor, CorridorError, ReferencePath
from rti_mpcc.config import ControllerConfig

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surroundings:
    """A corridor and its obstacles.

    Attributes:
        corridor: with the obstacles in it; obstacles: their outlines (m, 2) [m].
        changes: how often the obstacles have changed.
    """

    corridor: Corridor
    obstacles: tuple[ArrayLike, ...]
    changes: int = 0

    @classmethod
    def of(cls, corridor: Corridor, path: ReferencePath, config: ControllerConfig) -> Surroundings:
        """Those that a route begins with. Raises CorridorError if they are narrower than the body."""
        width, theta = corridor.narrowest()
        if width < config.vehicle.width:
            raise CorridorError(
                f"the corridor is {width:.3f} m wide at theta = {theta:.2f} m: "
                f"it must be wider than the body, {config.vehicle.width:.3f} m"
            )
        if path.max_curvature > config.max_curvature * (1.0 + 1e-6):
            _log.warning(
                "the path's curvature reaches %.3f 1/m, the vehicle can drive %.3f 1/m",
                path.max_curvature,
                config.max_curvature,
            )
        return cls(corridor=corridor, obstacles=tuple(corridor.obstacles))

    def told(self, obstacles: Sequence[ArrayLike] | None) -> Surroundings:
        """With other obstacles; itself for None and for the same ones."""
        if obstacles is None or same_outlines(obstacles, self.obstacles):
            return self
        return replace(
            self,
            corridor=self.corridor.with_obstacles(obstacles),
            obstacles=tuple(np.array(outline, dtype=np.float64) for outline in obstacles),
            changes=self.changes + 1,
        )


def same_outlines(outlines: Sequence[ArrayLike], known: Sequence[ArrayLike]) -> bool:
    """Whether these are the same polygons (m, 2) in the same order."""
    return len(outlines) == len(known) and all(map(np.array_equal, outlines, known))
