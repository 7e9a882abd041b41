"""Whether steps make a mission that a controller can drive."""

from __future__ import annotations

import logging

from geometry import InputError, Pose2
from geometry.angles import degrees_hint
from rti_mpcc.docking import DockingController
from rti_mpcc.planning import validation
from rti_mpcc.planning.plausibility import FARTHEST, LARGEST_HEADING
from rti_mpcc.steps import AnyStep, Dock, DriveTo, Straight, Undock, Wait

_log = logging.getLogger(__name__)


def check_mission(steps: tuple[AnyStep, ...], home: DriveTo | None, controller: DockingController) -> None:
    """Refuse steps that are no mission of this controller.

    Raises:
        InputError: see `DockingMission`.
    """
    if not steps:
        raise InputError("steps: a mission needs at least one")
    if home is not None:
        if home.retry_from is not None:
            raise InputError(f"home.retry_from = {home.retry_from}: it has no place in the mission")
        _check_pose(home.pose, "home.pose", controller)
    for place, step in enumerate(steps):
        name = f"steps[{place}]"
        if not isinstance(step, Dock | Wait | Straight | Undock | DriveTo):
            raise InputError(f"{name}: must be a Dock, Wait, Straight, Undock or DriveTo, is {step!r}")
        if isinstance(step, Dock | DriveTo) and step.pose is not None:
            _check_pose(step.pose, f"{name}.pose", controller)
        if step.retry_from is not None and step.retry_from > place:
            raise InputError(f"{name}.retry_from = {step.retry_from}: must not be a later step")
        if step.then == "home" and home is None:
            raise InputError(f"{name}.then = 'home': the mission has no home")
        drives = isinstance(step, Straight | Undock | DriveTo) or (isinstance(step, Dock) and step.pose)
        if drives and controller.area is None:
            raise InputError(f"{name}: needs planned routes; this controller drives its path only")


def _check_pose(pose: Pose2, name: str, controller: DockingController) -> None:
    if validation.usable_goal(pose) is None:
        raise InputError(
            f"{name} = {pose}: its coordinates must be at most {FARTHEST:g} m, "
            f"its heading at most {LARGEST_HEADING:g} rad"
        )
    if hint := degrees_hint(f"{name}.phi", pose.phi):
        _log.warning("%s", hint)
