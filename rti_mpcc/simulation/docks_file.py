"""A file of docks (TOML): where they are expected, how they are known, and what stands around them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import inf
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from estimation import CharucoBoard
from geometry import Area, InputError, Pose2
from rti_mpcc.config import Vehicle
from rti_mpcc.errors import ScenarioError
from rti_mpcc.simulation.mission import ApproachSection
from rti_mpcc.simulation.scenario import AreaSection, Polygon, Triple, VehicleSection
from rti_mpcc.simulation.section import Section
from rti_mpcc.simulation.solid import SolidThings
from rti_mpcc.simulation.toml_file import Problem, parsed, read_text, validated
from rti_mpcc.steps import Approach, Dock, DockKind, Straight
from rti_mpcc.types import Array

Pair = Annotated[tuple[float, float], Field(strict=False)]
SPACING = 0.1
"""Of the bodies of a docked vehicle along approach and contact move that are checked [m]."""


class ContactSection(Section):
    """The move that ends in contact, see `Straight`: distance [m], limits, tolerance [m], [rad]."""

    distance: float
    speed: float = 0.2
    steering: float = 0.05
    tolerance: Pair | None = None


class DockSection(Section):
    """A dock, see `Dock`: `pose` of the docked vehicle (x, y [m], heading [rad]); `body` in its frame [m]."""

    name: str = Field(min_length=1)
    pose: Triple
    kind: str = DockKind.KNOWN.value
    tolerance: Triple | None = None
    body: Polygon | None = None
    board: CharucoBoard | None = None
    approach: ApproachSection | None = None
    contact: ContactSection | None = None
    uncertainty: Pair | None = None

    def dock(self) -> Dock:
        """The dock. Raises InputError."""
        kinds = {kind.value: kind for kind in DockKind}
        if self.kind not in kinds:
            raise InputError(f"kind = {self.kind!r}: must be one of {', '.join(kinds)}")
        approach, contact = self.approach, self.contact
        return Dock(
            Pose2(*self.pose),
            name=self.name,
            kind=kinds[self.kind],
            tolerance=self.tolerance,
            body=None if self.body is None else np.array(self.body),
            board=self.board,
            approach=None if approach is None else Approach(approach.length, approach.direction),
            contact=None if contact is None else Straight(**contact.model_dump()),
            uncertainty=self.uncertainty,
        )


class DocksSection(Section):
    """A whole file: docks, the vehicle that docks there, and what stands around them."""

    docks: Annotated[tuple[DockSection, ...], Field(strict=False, alias="dock", min_length=1)]
    vehicle: VehicleSection = VehicleSection()
    area: AreaSection | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Docks:
    """What a file of docks says.

    Attributes:
        docks: by name, in the order of the file.
        vehicle: that docks there; area: what stands around them, or None.
    """

    docks: dict[str, Dock]
    vehicle: Vehicle
    area: Area | None


def load_docks(file: str | Path) -> dict[str, Dock]:
    """The docks of a file, by name. Raises ScenarioError with one line a problem, as `load_scenario`."""
    return read_docks(file).docks


def read_docks(file: str | Path) -> Docks:
    """All that a file of docks says. Raises as `load_docks`."""
    path, name = Path(file), str(file)
    section = validated(DocksSection, parsed(read_text(path), name), source=name, folder=path.parent)
    found: list[Problem] = []
    docks: dict[str, Dock] = {}
    for place, each in enumerate(section.docks):
        if each.name in docks:
            found.append(Problem(f"dock[{place}].name", each.name, "there is a dock of this name already"))
            continue
        try:
            docks[each.name] = each.dock()
        except InputError as error:
            found.append(Problem(f"dock[{place}] {each.name}", None, str(error)))
    vehicle, area = Vehicle(**section.vehicle.model_dump(exclude_unset=True)), None
    try:
        area = None if section.area is None else _area(section.area, docks)
    except InputError as error:
        found.append(Problem("area", None, str(error)))
    found += [
        *_confused(docks),
        *(each for dock in docks.values() for each in _in_the_way(dock, vehicle, area)),
    ]
    if found:
        raise ScenarioError("\n".join(f"{name}: {problem}" for problem in found))
    return Docks(docks=docks, vehicle=vehicle, area=area)


def _area(section: AreaSection, docks: dict[str, Dock]) -> Area:
    if section.map is not None:
        return Area.from_map(section.map)
    return Area(boundary=section.boundary, obstacles=section.obstacles)


def _confused(docks: dict[str, Dock]) -> Iterator[Problem]:
    """Boards that cannot be told from one another."""
    boards = [(name, dock.board) for name, dock in docks.items() if dock.board is not None]
    for (one, first), (other, second) in combinations(boards, 2):
        if first.dictionary != second.dictionary:
            continue
        if max(first.markers.start, second.markers.start) < min(first.markers.stop, second.markers.stop):
            allowed = f"must share no marker with the board of dock {one!r}"
            yield Problem(f"dock {other}: board.first_marker", second.first_marker, allowed)


def _in_the_way(dock: Dock, vehicle: Vehicle, area: Area | None) -> Iterator[Problem]:
    """What the body of a docked vehicle meets, there and on the approach to it."""
    assert dock.pose is not None
    solid = area if area is not None else Area()
    for what, poses in (("the docked vehicle", [dock.pose]), ("its approach", approach_poses(dock))):
        if area is not None and _room(poses, vehicle, solid) < 0.0:
            yield Problem(f"dock {dock.name}: pose", None, f"{what} overlaps something of the area")
        body = dock.body_at(dock.pose)
        if body is not None and _room(poses, vehicle, Area(obstacles=[body])) < 0.0:
            yield Problem(f"dock {dock.name}: body", None, f"must not overlap {what}")
            break


def approach_poses(dock: Dock) -> list[Pose2]:
    """Of the vehicle along the straight last piece of the way into a dock, every `SPACING`; none without."""
    if dock.approach is None or dock.pose is None:
        return []
    length, direction = dock.approach.length, dock.approach.direction
    marks: list[Any] = np.linspace(0.0, length, int(np.ceil(length / SPACING)) + 1).tolist()
    return [dock.pose.compose(Pose2(-direction * mark, 0.0, 0.0)) for mark in marks]


def _room(poses: list[Pose2], vehicle: Vehicle, area: Area) -> float:
    """The least clearance of the body at some poses [m]; inf for none."""
    if not poses:
        return inf
    rows: Array = np.array([[pose.x, pose.y, pose.phi] for pose in poses])
    return float(SolidThings.of(area).clearance(rows, vehicle).min())
