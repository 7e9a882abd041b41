"""`import rti_mpcc` stays light: the rest is imported when it is first used, and never in a cycle."""

from __future__ import annotations

from types import ModuleType

import pytest

import estimation
import geometry
import rti_mpcc
from tests.processes import printed

LATER = ("rti_mpcc.route_planner.planner", "rti_mpcc.mission", "estimation.charuco", "geometry.reeds_shepp")
PATH = """
import sys
from rti_mpcc import ControllerConfig, Corridor, DockingController, Pose2, ReferencePath, VehicleState
path = ReferencePath.from_segments(start=Pose2(0.0, 0.0, 0.0), segments=[(1, 0.0, 20.0)])
corridor = Corridor.from_offsets(path, left=3.0, right=-3.0)
controller = DockingController(path, corridor, ControllerConfig(recovery={recovery}))
before = set(sys.modules)
controller.step(VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0), now=0.0)
packages = ("rti_mpcc", "geometry", "estimation")
loaded = [name for name in set(sys.modules) - before if name.startswith(packages)]
print(loaded, "rti_mpcc.route_planner.planner" in before)
"""


def packages_after(statements: str) -> set[str]:
    """What a fresh interpreter has loaded after these."""
    code = f"import sys; {statements}; print(*{{name.split('.')[0] for name in sys.modules}})"
    return set(printed("-c", code).split())


def test_an_import_compiles_nothing() -> None:
    compiled = "[each.name for each in compiled._KERNELS if each.compiled]"
    assert printed("-c", f"import rti_mpcc; from geometry import compiled; print({compiled})") == "[]"


@pytest.mark.parametrize("package", [geometry, estimation, rti_mpcc])
def test_every_public_name_is_found_and_listed(package: ModuleType) -> None:
    assert set(package.__all__) <= set(dir(package))
    assert all(getattr(package, name) is not None for name in package.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'Nothing'"):
        package.Nothing  # noqa: B018


def test_the_package_alone_imports_no_planner_mission_or_camera() -> None:
    assert (
        printed("-c", f"import rti_mpcc, sys; print([name for name in {LATER} if name in sys.modules])")
        == "[]"
    )


@pytest.mark.parametrize("recovery", [True, False])
def test_a_controller_imports_the_planner_when_it_is_made_if_it_may_replan(recovery: bool) -> None:
    assert printed("-c", PATH.format(recovery=recovery)) == f"[] {recovery}"


def test_a_control_loop_loads_no_drawing_no_tables_and_no_filter() -> None:
    heavy = {"matplotlib", "filterpy", "rich", "cv2", "pandas"}
    assert not heavy & packages_after("import rti_mpcc; rti_mpcc.DockingController")


def test_the_command_line_loads_what_only_some_commands_need_where_one_is_asked_for() -> None:
    heavy = {"distributed", "dask", "matplotlib", "pandas"}
    assert not heavy & packages_after("import rti_mpcc.cli")


def test_estimation_loads_filterpy_with_the_first_filter_and_that_no_drawing() -> None:
    assert "filterpy" not in packages_after("import estimation; estimation.GoalFilterConfig()")
    made = packages_after("import rti_mpcc; rti_mpcc.GoalPoseFilter()")
    assert "filterpy" in made
    assert "matplotlib" not in made


def test_pictures_are_drawn_without_pyplot_which_would_keep_them() -> None:
    drawing = "from rti_mpcc.report import campaign, overview, plan, timeline"
    assert printed("-c", f"import sys; {drawing}; print('matplotlib.pyplot' in sys.modules)") == "False"


@pytest.mark.acceptance
def test_estimation_loads_opencv_with_the_first_detector() -> None:
    assert "cv2" not in packages_after("import estimation; estimation.Camera(), estimation.CharucoBoard()")
    made = "estimation.CharucoGoalDetector(estimation.Camera(), estimation.CharucoBoard())"
    assert "cv2" in packages_after(f"import estimation; {made}")
