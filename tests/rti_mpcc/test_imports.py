"""What planning, missions and cameras need is imported when it is first used, and never in a cycle."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

import estimation
import geometry
import rti_mpcc

ROOT = Path(__file__).parents[2]
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


def printed(code: str) -> str:
    """What a fresh process prints."""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_an_import_compiles_nothing() -> None:
    compiled = "[each.name for each in compiled._KERNELS if each.compiled]"
    assert printed(f"import rti_mpcc; from geometry import compiled; print({compiled})") == "[]"


@pytest.mark.parametrize("package", [geometry, estimation, rti_mpcc])
def test_every_public_name_is_found_and_listed(package: ModuleType) -> None:
    assert set(package.__all__) <= set(dir(package))
    assert all(getattr(package, name) is not None for name in package.__all__)
    with pytest.raises(AttributeError, match="has no attribute 'Nothing'"):
        package.Nothing  # noqa: B018


def test_the_package_alone_imports_no_planner_mission_or_camera() -> None:
    assert printed(f"import rti_mpcc, sys; print([name for name in {LATER} if name in sys.modules])") == "[]"


@pytest.mark.parametrize("recovery", [True, False])
def test_a_controller_imports_the_planner_when_it_is_made_if_it_may_replan(recovery: bool) -> None:
    assert printed(PATH.format(recovery=recovery)) == f"[] {recovery}"
