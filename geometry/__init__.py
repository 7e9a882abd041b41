"""Plane geometry: poses, reference paths with cusps, corridors, areas. Knows no vehicle and no solver."""

from __future__ import annotations

from geometry.area import Area
from geometry.corridor import Corridor
from geometry.errors import AreaError, CorridorError, InputError, PathError, RtiMpccError
from geometry.offsets import Narrowing
from geometry.part import PathPart, PathReference
from geometry.path import ReferencePath
from geometry.pose import Pose2, lift, wrap
from geometry.walls import PartLines

__all__ = [
    "Area",
    "AreaError",
    "Corridor",
    "CorridorError",
    "InputError",
    "Narrowing",
    "PartLines",
    "PathError",
    "PathPart",
    "PathReference",
    "Pose2",
    "ReferencePath",
    "RtiMpccError",
    "lift",
    "wrap",
]
