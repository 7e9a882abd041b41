"""A file of docks (TOML): where they are expected, how they are known, and what stands around them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from math import ceil
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from estimation import CharucoBoard
from geometry import Area, Pose2
from geometry.pose import degrees_hint
from rti_mpcc.config import Vehicle
from rti_mpcc.mission import Dock, DockKind, Straight
from rti_mpcc.model.footprint import body_of
from rti_mpcc.simulation.sections.base import (
    KeyProblem,
    Pair,
    Section,
    Triple,
    VehicleTable,
    read_toml,
    refusal,
)
from rti_mpcc.simulation.sections.goal import too_many_markers
from rti_mpcc.simulation.sections.ground import AreaSection
from rti_mpcc.simulation.sections.mission import ApproachSection, ObjectSection

SPACING = 0.1  # of the bodies of a vehicle along the approach that are checked [m]
ROUNDING = 1e-6  # bodies that overlap by no more touch [m]
Coordinate = Annotated[float, Field(ge=-1e8, le=1e8)]


Pose = Annotated[tuple[Coordinate, Coordinate, float], Field(strict=False)]
Corner = Annotated[tuple[Coordinate, Coordinate], Field(strict=False)]
Outline = Annotated[tuple[Corner, ...], Field(strict=False, min_length=3)]


class MoveSection(ObjectSection):
    """The keys of a straight move, see `Straight`."""

    makes = Straight
    distance: float
    speed: float | None = None
    steering: float | None = None
    tolerance: Pair | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        yield from refusal("", None, self.build, MoveSection)


class DockSection(ObjectSection):
    """A dock, see `Dock`: `pose` of the docked vehicle (x, y [m], heading [rad]); `body` in its frame [m]."""

    name: str
    pose: Pose
    kind: Literal["known", "detected", "charuco"] = "known"
    tolerance: Triple | None = None
    body: Outline | None = None
    board: CharucoBoard | None = None
    approach: ApproachSection | None = None
    contact: MoveSection | None = None
    uncertainty: Pair | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        if hint := degrees_hint("must be <= 6.28319, not", self.pose[2]):
            yield KeyProblem("pose[2]", self.pose[2], hint)
        if not self.name or self.name != self.name.strip() or not self.name.isprintable():
            yield KeyProblem("name", self.name, "must be text in one line, without blanks at its ends")
        if self.board is not None and self.kind != "charuco":
            yield KeyProblem("kind", self.kind, "must be 'charuco' where there is a board")
        else:
            yield from refusal("", None, self.build, DockSection)
        if self.board is not None:
            yield from too_many_markers("board", self.board)

    def build(self) -> Dock:
        """The dock. Raises InputError."""
        return Dock(**self.given() | {"pose": Pose2(*self.pose), "kind": DockKind(self.kind)})


class DocksSection(Section):
    """A whole file: docks, the vehicle that docks there, and what stands around them."""

    docks: Annotated[tuple[DockSection, ...], Field(strict=False, alias="dock", min_length=1)]
    vehicle: VehicleTable = Vehicle()
    area: AreaSection | None = None

    def _problems(self) -> Iterator[KeyProblem]:
        wrong = []
        for (one, first), (other, second) in combinations(enumerate(self.docks), 2):
            if first.name == second.name:
                allowed = f"must be a name of its own, dock[{one}] has it already"
                wrong.append(KeyProblem(f"dock[{other}].name", second.name, allowed))
            taken, board = first.board, second.board
            if taken is not None and board is not None and board.shares_markers(taken):
                markers = f"{taken.markers.start} to {taken.markers.stop - 1} of {taken.dictionary}"
                allowed = f"must leave the markers {markers} to the board of dock {first.name!r}"
                wrong.append(KeyProblem(f"dock[{other}].board.first_marker", board.first_marker, allowed))
        yield from wrong or _overlaps(self.build())

    def build(self) -> Docks:
        """Docks, vehicle and area."""
        docks = {each.name: each.build() for each in self.docks}
        return Docks(docks=docks, vehicle=self.vehicle, area=None if self.area is None else self.area.build())


@dataclass(frozen=True, slots=True, kw_only=True)
class Docks:
    """The docks of a file by name, in its order, the vehicle that docks there, and the area or None."""

    docks: dict[str, Dock]
    vehicle: Vehicle
    area: Area | None


def load_docks(file: str | Path) -> dict[str, Dock]:
    """The docks of a file by name, in its order.

    Raises ScenarioError with one line a problem: `file: key = value: what is allowed`.
    """
    return read_docks(file).docks


def read_docks(file: str | Path) -> Docks:
    """The whole content of a file of docks. Raises as `load_docks`."""
    return read_toml(DocksSection, Path(file), str(file)).build()


def _overlaps(docks: Docks) -> Iterator[KeyProblem]:
    """What the body of a vehicle meets at the docks, and on the approach to them; the first of each dock."""

    def depth_in(area: Area | None, poses: list[Pose2]) -> float:
        rows = np.array([[pose.x, pose.y, pose.phi] for pose in poses])
        return 0.0 if area is None else -float(area.signed_distances(body_of(docks.vehicle), rows).min())

    for place, dock in enumerate(docks.docks.values()):
        pose, approach = dock.pose, dock.approach
        assert pose is not None
        driven: list[tuple[str, object, str, list[Pose2]]]
        driven = [("pose", [pose.x, pose.y, pose.phi], "the docked vehicle", [pose])]
        if approach is not None:
            marks = np.linspace(0.0, approach.length, ceil(approach.length / SPACING) + 1).tolist()
            poses = [pose.compose(Pose2(-approach.direction * mark, 0.0, 0.0)) for mark in marks]
            driven.append(("approach.length", approach.length, "the approach", poses))
        for key, value, what, poses in driven:
            if (depth := depth_in(docks.area, poses)) > ROUNDING:
                clear = f"{what} must be in the area and clear of its obstacles, overlaps by {depth:.2g} m"
                yield KeyProblem(f"dock[{place}].{key}", value, clear)
                break
        outline = dock.body_at(pose)
        body = None if outline is None else Area(obstacles=[outline])
        for _, _, what, poses in driven:
            if (depth := depth_in(body, poses)) > ROUNDING:
                apart = f"must not overlap {what}, does by {depth:.2g} m"
                yield KeyProblem(f"dock[{place}].body", np.asarray(dock.body).tolist(), apart)
                break
