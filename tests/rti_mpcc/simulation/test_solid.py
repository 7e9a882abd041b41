"""The clearance of a body in an area: known distances, and against measuring everything."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from geometry import Area
from rti_mpcc.config import Vehicle
from rti_mpcc.model.footprint import body_polygons
from rti_mpcc.simulation.scenery import area_clearance

VEHICLE = Vehicle(width=2.0, front=4.0, rear=1.0)
HALL = [(-10.0, -5.0), (20.0, -5.0), (20.0, 5.0), (-10.0, 5.0)]
BOX = [(8.0, 2.0), (10.0, 2.0), (10.0, 4.0), (8.0, 4.0)]


def clearance(area: Area, *poses: tuple[float, float, float]) -> list[float]:
    found: list[float] = area_clearance(area, np.array(poses), VEHICLE).tolist()
    return found


def test_to_an_obstacle() -> None:
    area = Area(boundary=HALL, obstacles=[BOX])
    assert clearance(area, (3.0, 3.0, 0.0), (7.0, 0.5, 0.0)) == pytest.approx([1.0, 0.5])
    # Corner to corner.
    assert clearance(area, (3.0, 0.0, 0.0)) == pytest.approx([np.hypot(1.0, 1.0)])


@pytest.mark.parametrize(
    ("pose", "depth"),
    [((4.5, 3.0, 0.0), 0.5), ((16.25, 0.0, 0.0), 0.25), ((-9.5, 0.0, 0.0), 0.5), ((0.0, 4.5, 0.0), 0.5)],
)
def test_crossed_it_is_minus_the_depth(pose: tuple[float, float, float], depth: float) -> None:
    assert clearance(Area(boundary=HALL, obstacles=[BOX]), pose) == pytest.approx([-depth], abs=0.06)


def test_without_anything_it_is_infinite() -> None:
    assert clearance(Area(), (0.0, 0.0, 0.0)) == [np.inf]


def test_among_many_things_the_nearest_counts() -> None:
    random = np.random.default_rng(3)
    corners = random.uniform(-40.0, 40.0, (60, 1, 2)) + random.uniform(0.5, 2.0, (60, 1, 1)) * np.array(BOX)
    area = Area(obstacles=list(corners))
    poses = np.column_stack([random.uniform(-40.0, 40.0, (700, 2)), random.uniform(-3.0, 3.0, 700)])
    found = area_clearance(area, poses, VEHICLE)
    bodies = shapely.polygons(body_polygons(poses, VEHICLE))
    least = np.min([shapely.distance(bodies, shapely.Polygon(ring)) for ring in corners], axis=0)
    free = least > 0.0
    assert 100 < np.count_nonzero(free) < 600
    assert found[free] == pytest.approx(least[free], abs=1e-9)
    assert (found[~free] <= 0.0).all()
