"""Plane geometry: poses, reference paths with cusps, corridors. Knows no vehicle and no solver."""

from __future__ import annotations

from geometry.angles import lift, wrap
from geometry.corridor import Corridor, Narrowing
from geometry.errors import CorridorError, InputError, PathError, RtiMpccError
from geometry.lines import CorridorLines, PartLines
from geometry.part import PathPart, PathReference
from geometry.path import ReferencePath
from geometry.pose import Pose2

__all__ = [
    "Corridor",
    "CorridorError",
    "CorridorLines",
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
