"""`import rti_mpcc` stays light: the rest is imported when it is first used, and never in a cycle."""

from __future__ import annotations

from ast import literal_eval
from types import ModuleType

import pytest

import estimation
import geometry
import rti_mpcc
from tests.processes import printed

LATER = ("rti_mpcc.route_planner.planner", "rti_mpcc.mission", "estimation.charuco", "geometry.reeds_shepp")
IN_TURN = f"""
import sys, estimation
from geometry import compiled
def packages():
    return sorted({{name.split(".")[0] for name in sys.modules}})
estimation.GoalFilterConfig()
print(packages())
import rti_mpcc
print([name for name in {LATER} if name in sys.modules])
rti_mpcc.DockingController
print(packages())
print([each.name for each in compiled._KERNELS if each.compiled])
rti_mpcc.GoalPoseFilter()
print(packages())
from rti_mpcc import ControllerConfig, Corridor, DockingController, Pose2, ReferencePath, VehicleState
path = ReferencePath.from_segments(start=Pose2(0.0, 0.0, 0.0), segments=[(1, 0.0, 20.0)])
corridor = Corridor.from_offsets(path, left=3.0, right=-3.0)
for recovery in (False, True):
    controller = DockingController(path, corridor, ControllerConfig(recovery=recovery))
    before = set(sys.modules)
    controller.step(VehicleState(x=0.0, y=0.0, phi=0.0, v=0.0, delta=0.0), now=0.0)
    ours = ("rti_mpcc", "geometry", "estimation")
    print([name for name in set(sys.modules) - before if name.startswith(ours)])
    print("rti_mpcc.route_planner.planner" in before)
"""
HEAVY = {"matplotlib", "rich", "cv2", "pandas", "distributed", "dask"}


def test_a_control_loop_loads_and_compiles_no_more_than_it_uses() -> None:
    """In one process, one after the other: what is not loaded later was not before.

    A controller imports the planner when it is made, if it may replan, and nothing in a cycle.
    """
    said = map(literal_eval, printed("-c", IN_TURN).splitlines())
    estimation, later, loop, compiled, filtering, *controllers = said
    assert "filterpy" not in estimation
    assert later == []
    assert not (HEAVY | {"filterpy"}) & set(loop)
    assert compiled == []
    assert "filterpy" in filtering
    assert "matplotlib" not in filtering
    assert controllers == [[], False, [], True]


@pytest.mark.parametrize("package", [geometry, estimation, rti_mpcc])
def test_every_public_name_is_found_and_listed(package: ModuleType) -> None:
    assert set(package.__all__) <= set(dir(package))
    assert all(getattr(package, name) is not None for name in package.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'Nothing'"):
        package.Nothing  # noqa: B018


def test_the_command_line_loads_what_only_some_commands_need_where_one_is_asked_for() -> None:
    """And pictures are drawn without pyplot, which would keep them."""
    drawing = "from rti_mpcc.report import campaign, overview, plan, timeline"
    code = f"import sys, rti_mpcc.cli; print(*sys.modules); {drawing}; print(*sys.modules)"
    command, pictures = (set(line.split()) for line in printed("-c", code).splitlines())
    assert not {"distributed", "dask", "matplotlib", "pandas"} & command
    assert "matplotlib.figure" in pictures
    assert "matplotlib.pyplot" not in pictures


@pytest.mark.acceptance
def test_estimation_loads_opencv_with_the_first_detector() -> None:
    parts = "camera, board = estimation.Camera(), estimation.CharucoBoard()"
    seen, made = "print('cv2' in sys.modules)", "estimation.CharucoGoalDetector(camera, board)"
    code = f"import sys, estimation; {parts}; {seen}; {made}; {seen}"
    assert printed("-c", code).splitlines() == ["False", "True"]
