"""What is solid in an area, as the metrics measure it: by shapely alone, with `geometry.clearance`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from geometry import Area
from geometry.clearance import Segments, clearance
from geometry.outline import shape_of
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.types import Array

_SLICE = 500
"""Bodies measured in one call: few things are near to so few of them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SolidThings:
    """The boundary and the obstacles of an area.

    Attributes:
        origin: (2,) all shapes and bodies are taken from there [m], for maps may be far from (0, 0).
        walls: the boundary, its allowed side on the left; shapes: the obstacles; tree: of these.
    """

    origin: Array
    walls: Segments
    shapes: NDArray[np.object_]
    tree: shapely.STRtree

    @classmethod
    def of(cls, area: Area) -> SolidThings:
        """Those of this area."""
        rings = [*([] if area.boundary is None else [area.boundary]), *area.obstacles]
        origin = np.round(rings[0][0]) if rings else np.zeros(2)
        around = (
            [] if area.boundary is None else [np.concatenate((area.boundary, area.boundary[:1])) - origin]
        )
        shapes = np.array([shape_of(ring - origin) for ring in area.obstacles], dtype=np.object_)
        return cls(origin=origin, walls=Segments.of(around), shapes=shapes, tree=shapely.STRtree(shapes))

    def clearance(self, poses: Array, vehicle: Vehicle) -> Array:
        """Signed clearance (n,) [m] of the body at poses (n, 3); +inf where there is nothing.

        Where something is crossed: minus the deepest penetration.
        """
        local = poses - np.array([*self.origin, 0.0])
        found = [np.zeros(0)]
        for begin in range(0, len(local), _SLICE):
            bodies = body_polygons(local[begin : begin + _SLICE], vehicle)
            shapes = shapely.polygons(bodies)
            met = self.tree.query(shapes, predicate="intersects")[1]
            near = np.union1d(self.tree.query_nearest(shapes)[1], met).astype(np.int64)
            found.append(clearance(self.walls, self.shapes[near], bodies))
        return np.concatenate(found)
