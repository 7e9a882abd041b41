"""Given paths that bend more sharply than the vehicle can: made smooth where there is room, and left else."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from geometry import Area, Corridor, Narrowing, Pose2, ReferencePath
from rti_mpcc import ControllerConfig, DockingController, PathChange, repaired_path
from rti_mpcc.model.footprint import body_of
from rti_mpcc.simulation import simulate, summary
from rti_mpcc.world.surroundings import area_along
from tests.lists import acceptance
from tests.rti_mpcc.docking_runs import on_segments

CONFIG = ControllerConfig()
OPEN = Area(boundary=[(-50.0, -50.0), (80.0, -50.0), (80.0, 80.0), (-50.0, 80.0)])
CORNER = [*((float(x), 0.0) for x in range(16)), *((15.0, float(y)) for y in range(1, 16))]
ZIGZAG = [(0.0, 0.0), (8.0, 0.0), (8.0, 6.0), (16.0, 6.0), (16.0, 12.0)]


def recorded(seed: int) -> list[tuple[float, float]]:
    """A path as it is recorded every half a metre, 3 cm off."""
    x = np.arange(0.0, 60.0, 0.5)
    noise = np.random.default_rng(seed).normal(0.0, 0.03, (2, x.size))
    return list(zip(x + noise[0], 5.0 * np.sin(x / 8.0) + noise[1], strict=True))


def clearance(path: ReferencePath, area: Area) -> float:
    """Least clearance of a body on the path, up to 1 [m]."""
    poses = np.vstack([np.column_stack([at.x, at.y, at.phi]) for at in path.sample(0.02)])
    return float(area.signed_distances(body_of(CONFIG.vehicle), poses, 1.0).min())


def beside(path: ReferencePath, given: ReferencePath) -> float:
    """How far it leads beside the given path, at most [m]."""
    far = 0.0
    for part, own in zip(path.parts, given.parts, strict=True):
        at = part.reference(np.arange(part.start, part.end, 0.2))
        for x, y in zip(at.x, at.y, strict=True):
            near = own.pose(own.project(float(x), float(y)))
            far = max(far, float(np.hypot(x - near.x, y - near.y)))
    return far


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize(
    ("points", "most"), [(CORNER, 1.3), (ZIGZAG, 2.5), (recorded(1), 0.3), (recorded(2), 0.3)]
)
def test_a_path_is_made_smooth_and_stays_near_itself(
    points: list[tuple[float, float]], most: float, direction: int
) -> None:
    given = ReferencePath.from_waypoints(points, direction)
    assert given.max_curvature > 2.0 * CONFIG.max_curvature or points is ZIGZAG
    made = repaired_path(given, OPEN, CONFIG)
    assert made.path.max_curvature <= CONFIG.max_curvature
    assert len(made.path.parts) == 1
    for pose, own in ((made.path.start, given.start), (made.path.end, given.end)):
        assert pose.relative_to(own).within((1e-6, 1e-6, 1e-6))
    far = beside(made.path, given)
    assert far <= most
    assert made.changes
    assert max(change.aside or 0.0 for change in made.changes) == pytest.approx(far, abs=0.1)
    for change in made.changes:
        assert change.curvature > change.possible == CONFIG.max_curvature
        assert "made smooth" in str(change)


def test_what_can_be_driven_stays_as_it_is() -> None:
    tight = [(1, 0.99 * CONFIG.max_curvature, 5.0), (-1, -CONFIG.max_curvature, 5.0)]
    path = ReferencePath.from_segments(Pose2(1.0, 2.0, 3.0), tight)
    made = repaired_path(path, OPEN, CONFIG)
    assert made.path is path
    assert made.changes == ()


def test_only_what_is_bent_too_sharply_is_changed_with_some_way_around_it() -> None:
    sharp = [(1, 0.0, 30.0), (1, 1.0, 1.0), (1, 0.0, 30.0), (-1, 0.1, 20.0), (-1, -0.5, 0.5), (-1, 0.0, 20.0)]
    given = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), sharp)
    made = repaired_path(given, Area(obstacles=[[(-40.0, -40.0), (-39.0, -40.0), (-40.0, -39.0)]]), CONFIG)
    assert [change.part for change in made.changes] == [0, 1]
    first, second = made.changes
    assert 15.0 < first.start < first.end < 46.0
    assert 62.0 < second.start < second.end < 100.0
    assert [part.direction for part in made.path.parts] == [1, -1]
    for part, own in zip(made.path.parts, given.parts, strict=True):
        assert part.last.relative_to(own.last).within((1e-6, 1e-6, 1e-6))
    begin = np.linspace(0.0, first.start - 0.1, 20)
    now, before = (path.parts[0].reference(begin) for path in (made.path, given))
    assert now.x == pytest.approx(before.x)
    assert made.path.max_curvature <= CONFIG.max_curvature


def test_what_is_smooth_keeps_clear_and_else_the_path_stays_and_it_is_said() -> None:
    given = ReferencePath.from_waypoints(CORNER[5:-5])
    inside = [(13.6, 1.4), (13.6, 15.0), (5.0, 15.0), (5.0, 1.4)]
    outside = [(16.4, 15.0), (16.4, -1.4), (5.0, -1.4), (5.0, -2.0), (17.0, -2.0), (17.0, 15.0)]
    for obstacles, smooth in (([inside], True), ([outside], True), ([inside, outside], False)):
        area = Area(boundary=OPEN.boundary, obstacles=obstacles)
        made = repaired_path(given, area, CONFIG)
        if smooth:
            assert made.path.max_curvature <= CONFIG.max_curvature
            assert clearance(made.path, area) >= CONFIG.clearance.least - 1e-3
        else:
            assert made.path is given
            assert {change.aside for change in made.changes} == {None}
            assert all("left as it is" in str(change) for change in made.changes)


@pytest.mark.parametrize("config", [CONFIG, ControllerConfig.paper(), ControllerConfig(recovery=False)])
def test_a_controller_reports_its_changes_and_the_published_presets_keep_the_path(
    config: ControllerConfig, caplog: pytest.LogCaptureFixture
) -> None:
    given = ReferencePath.from_waypoints(CORNER)
    controller = DockingController(given, Corridor.from_offsets(given, left=3.0, right=-3.0), config)
    if config is CONFIG:
        assert [str(change) for change in controller.path_changes] == caplog.messages
        assert all(isinstance(change, PathChange) for change in controller.path_changes)
        assert controller.path is not None
        assert controller.path.max_curvature <= CONFIG.max_curvature
    else:
        assert controller.path is given
        assert controller.path_changes == ()


def test_a_run_is_measured_along_the_path_that_is_driven() -> None:
    corner = [(1, 0.0, 12.0), (1, 0.4, 0.5 * pi / 0.4), (1, 0.0, 12.0)]
    run = simulate(on_segments(corner, corridor={"left": 4.0, "right": -4.0}))
    told = summary(run)
    assert told["docked"]
    assert run.paths[0][1].max_curvature <= CONFIG.max_curvature
    assert told["min_clearance_m"] > 0.05
    assert run.truth.theta[-1] == pytest.approx(run.paths[0][1].length, abs=0.1)


def slot(direction: int, straight: float) -> tuple[ReferencePath, Corridor]:
    """An S bend with a slot in its middle, along the path and 0.25 m wider than the body to either side."""
    pieces = [(direction, 0.1, 15.0), (direction, 0.0, straight), (direction, -0.1, 15.0)]
    given = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), pieces)
    half, middle = 0.5 * CONFIG.vehicle.width + 0.25, 15.0 + 0.5 * straight
    narrowing = Narrowing(start=middle - 2.5, end=middle + 2.5, left=half, right=-half)
    return given, Corridor.from_offsets(given, left=4.0, right=-4.0, narrowings=[narrowing])


@pytest.mark.parametrize("direction", [-1, acceptance(1)])
def test_a_path_on_which_the_body_meets_something_is_led_past_it(direction: int) -> None:
    """A body that follows the bend into the slot meets its edge with a corner: it has to swing out before."""
    given, corridor = slot(direction, 6.0)
    area = area_along(given, corridor, CONFIG)
    (change,) = repaired_path(given, area, CONFIG).changes
    assert change.clearance < 0.0 < change.needed
    assert change.curvature <= change.possible
    assert "m, at least 0.05 m is required: made smooth" in str(change)
    path = repaired_path(given, area, CONFIG).path
    assert [part.direction for part in path.parts] == [direction]
    assert clearance(path, area) >= CONFIG.clearance.least - 1e-3
    assert path.max_curvature <= CONFIG.max_curvature


def test_where_no_way_leads_through_in_one_go_the_path_stays(caplog: pytest.LogCaptureFixture) -> None:
    """A wall across the corridor: the path is kept, and it is no matter for a warning of its own."""
    given = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 40.0)])
    wall = [(20.0, -6.0), (21.0, -6.0), (21.0, 6.0), (20.0, 6.0)]
    corridor = Corridor.from_offsets(given, left=3.0, right=-3.0, obstacles=[wall])
    controller = DockingController(given, corridor, CONFIG)
    assert controller.path is given
    (change,) = controller.path_changes
    assert change.aside is None
    assert change.clearance < 0.0
    assert str(change) not in caplog.messages
