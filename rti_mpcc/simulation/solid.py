"""What is solid in an area, as the metrics measure it: by shapely alone, with `geometry.clearance`."""

from __future__ import annotations

import numpy as np
import shapely

from geometry import Area
from geometry.clearance import Segments, clearance
from geometry.outline import shape_of
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.types import Array

_SLICE = 500
"""Bodies measured in one call: few things are near to so few of them."""


def area_clearance(area: Area, poses: Array, vehicle: Vehicle) -> Array:
    """Signed clearance (n,) [m] of the body at poses (n, 3) to all that is solid; +inf where nothing is.

    Where something is crossed: minus the deepest penetration.
    """
    outline = area.boundary
    rings = [*([] if outline is None else [outline]), *area.obstacles]
    origin = np.round(rings[0][0]) if rings else np.zeros(2)  # maps may be far from (0, 0)
    walls = Segments.of([] if outline is None else [np.concatenate((outline, outline[:1])) - origin])
    things = np.array([shape_of(ring - origin) for ring in area.obstacles], dtype=np.object_)
    tree, local = shapely.STRtree(things), poses - np.array([*origin, 0.0])
    found = [np.zeros(0)]
    for begin in range(0, len(local), _SLICE):
        bodies = body_polygons(local[begin : begin + _SLICE], vehicle)
        shapes = shapely.polygons(bodies)
        met = tree.query(shapes, predicate="intersects")[1]
        near = np.union1d(tree.query_nearest(shapes)[1], met).astype(np.int64)
        found.append(clearance(walls, things[near], bodies))
    return np.concatenate(found)
