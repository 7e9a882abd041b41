"""Plane geometry: poses, reference paths with cusps, corridors. Knows no vehicle and no solver."""

from __future__ import annotations

from geometry.angles import lift, wrap
from geometry.errors import CorridorError, InputError, PathError, RtiMpccError
from geometry.part import PathPart, PathReference
from geometry.path import ReferencePath
from geometry.pose import Pose2

__all__ = [
    "CorridorError",
    "InputError",
    "PathError",
    "PathPart",
    "PathReference",
    "Pose2",
    "ReferencePath",
    "RtiMpccError",
    "lift",
    "wrap",
]
