"""A file of docks (TOML): where they are expected, how they are known, and what stands around them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, get_args

import numpy as np
from pydantic import AfterValidator, Field, field_validator

from estimation import CharucoBoard
from geometry import Area, Pose2
from geometry.angles import degrees_hint
from rti_mpcc.config import Vehicle
from rti_mpcc.errors import ConfigError, InputError, ScenarioError
from rti_mpcc.simulation.fields import (
    AreaSection,
    Positive,
    Tolerance,
    VehicleSection,
    area_problems,
    map_problem,
    polygon_problems,
)
from rti_mpcc.simulation.mission import ApproachSection
from rti_mpcc.simulation.section import Section
from rti_mpcc.simulation.solid import SolidThings
from rti_mpcc.simulation.toml_file import Problem, parsed, read_text, settings_problems, told, validated
from rti_mpcc.steps import Approach, Dock, DockKind, Straight
from rti_mpcc.types import Array

SPACING = 0.1
"""Of the bodies of a vehicle along the approach that are checked [m]."""
ROUNDING = 1e-6
"""Bodies that overlap by no more touch [m]."""
Coordinate = Annotated[float, Field(ge=-1e8, le=1e8)]


def _in_radians(heading: float) -> float:
    if hint := degrees_hint("must be <= 6.28319, not", heading):
        raise ValueError(hint)
    return heading


Heading = Annotated[float, AfterValidator(_in_radians)]
Pose = Annotated[tuple[Coordinate, Coordinate, Heading], Field(strict=False)]
Corner = Annotated[tuple[Coordinate, Coordinate], Field(strict=False)]
Outline = Annotated[tuple[Corner, ...], Field(strict=False, min_length=3)]
Uncertainty = Annotated[tuple[Positive, Positive], Field(strict=False)]
Kind = Literal["known", "detected", "charuco"]


class ContactSection(Section):
    """The move that ends in contact, see `Straight`: distance [m], limits [m/s], [rad], tolerance [m], [rad].

    What is not given is as `Straight` has it.
    """

    distance: float = Field(ge=-100.0, le=100.0)
    speed: Positive | None = None
    steering: Positive | None = None
    tolerance: Annotated[tuple[Positive, Positive], Field(strict=False)] | None = None

    @field_validator("distance")
    @classmethod
    def _leads_somewhere(cls, distance: float) -> float:
        if distance == 0.0:
            raise ValueError("must not be 0")
        return distance


class DockSection(Section):
    """A dock, see `Dock`: `pose` of the docked vehicle (x, y [m], heading [rad]); `body` in its frame [m]."""

    name: str
    pose: Pose
    kind: Kind = "known"
    tolerance: Tolerance | None = None
    body: Outline | None = None
    board: CharucoBoard | None = None
    approach: ApproachSection | None = None
    contact: ContactSection | None = None
    uncertainty: Uncertainty | None = None

    @field_validator("name")
    @classmethod
    def _can_be_read(cls, name: str) -> str:
        if not name or name != name.strip() or not name.isprintable():
            raise ValueError("must be text in one line, without blanks at its ends")
        return name

    def build(self) -> Dock:
        """The dock. Raises InputError where `problems` finds some."""
        approach, contact = self.approach, self.contact
        return Dock(
            Pose2(*self.pose),
            name=self.name,
            kind=DockKind(self.kind),
            tolerance=self.tolerance,
            body=None if self.body is None else np.array(self.body),
            board=self.board,
            approach=None if approach is None else Approach(approach.length, approach.direction),
            contact=None if contact is None else Straight(**contact.model_dump(exclude_none=True)),
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
    """The docks of a file by name, in its order.

    Raises ScenarioError with one line a problem: `file: key = value: what is allowed`.
    """
    return read_docks(file).docks


def read_docks(file: str | Path) -> Docks:
    """All that a file of docks says. Raises as `load_docks`; overlaps are told where all else is right."""
    path, source = Path(file), str(file)
    section = validated(DocksSection, parsed(read_text(path), source), source=source, folder=path.parent)
    _refuse(problems(section), source)
    docks = _built(section, source)
    _refuse(list(_overlaps(docks)), source)
    return docks


def _refuse(found: list[Problem], source: str) -> None:
    if found:
        raise ScenarioError(told(found, source))


def _built(section: DocksSection, source: str) -> Docks:
    """Raises ScenarioError for a vehicle that is none, and a map that cannot be read."""
    try:
        vehicle = section.vehicle.build()
    except ConfigError as error:
        raise ScenarioError(told(settings_problems(error, "vehicle", DocksSection), source)) from error
    try:
        area = None if section.area is None else section.area.build()
    except InputError as error:
        assert section.area is not None
        raise ScenarioError(told([map_problem(section.area, error)], source)) from error
    return Docks(docks={each.name: each.build() for each in section.docks}, vehicle=vehicle, area=area)


def problems(section: DocksSection) -> list[Problem]:
    """What is wrong that single values do not show, but what overlaps."""
    checks = (_names, _bodies, _uncertain, _boards, _confused)
    found = [problem for check in checks for problem in check(section)]
    return found if section.area is None else [*found, *area_problems(section.area)]


def _names(section: DocksSection) -> Iterator[Problem]:
    names = [each.name for each in section.docks]
    for place, name in enumerate(names):
        if name in names[:place]:
            allowed = f"must be a name of its own, dock[{names.index(name)}] has it already"
            yield Problem(f"dock[{place}].name", name, allowed)


def _bodies(section: DocksSection) -> Iterator[Problem]:
    for place, each in enumerate(section.docks):
        if each.body is not None:
            yield from polygon_problems(f"dock[{place}].body", each.body)


def _uncertain(section: DocksSection) -> Iterator[Problem]:
    for place, each in enumerate(section.docks):
        if each.uncertainty is not None and (each.body is None or each.approach is None):
            allowed = "only of a dock with a body and an approach"
            yield Problem(f"dock[{place}].uncertainty", list(each.uncertainty), allowed)


def _boards(section: DocksSection) -> Iterator[Problem]:
    """Each board by itself: whether the dock is to have one, and whether its dictionary has its markers."""
    for place, each in enumerate(section.docks):
        by_board, board = each.kind == DockKind.CHARUCO.value, each.board
        if by_board and board is None:
            yield Problem(f"dock[{place}].board", None, "required for kind = 'charuco'")
        if board is None:
            continue
        if not by_board:
            yield Problem(f"dock[{place}].kind", each.kind, "must be 'charuco' where there is a board")
        size = board.dictionary_size
        if size is not None and board.markers.stop > size:
            needed = f"markers {board.markers.start} to {board.markers.stop - 1}"
            allowed = f"must have the {needed} of the board, has 0 to {size - 1}"
            yield Problem(f"dock[{place}].board.dictionary", board.dictionary, allowed)


def _confused(section: DocksSection) -> Iterator[Problem]:
    """Boards that can be taken for one another."""
    boards = [(place, each.board) for place, each in enumerate(section.docks) if each.board is not None]
    for (one, first), (other, second) in combinations(boards, 2):
        if second.shares_markers(first):
            taken = f"markers {first.markers.start} to {first.markers.stop - 1} of {first.dictionary}"
            name = section.docks[one].name
            allowed = f"must leave the {taken} to the board of dock {name!r}"
            yield Problem(f"dock[{other}].board.first_marker", second.first_marker, allowed)


class _Stretch(NamedTuple):
    """Where a vehicle will be: key of the dock and value that say so, in words, and its poses there."""

    key: str
    value: object
    words: str
    poses: list[Pose2]


def _stretches(dock: Dock) -> list[_Stretch]:
    """At the dock, and on the approach to it."""
    pose = dock.pose
    assert pose is not None
    found = [_Stretch("pose", [pose.x, pose.y, pose.phi], "the docked vehicle", [pose])]
    if dock.approach is not None:
        found.append(_Stretch("approach.length", dock.approach.length, "the approach", approach_poses(dock)))
    return found


def _overlaps(docks: Docks) -> Iterator[Problem]:
    """What the body of a vehicle meets at the docks, and on the approach to them."""
    area = None if docks.area is None else SolidThings.of(docks.area)
    for place, dock in enumerate(docks.docks.values()):
        assert dock.pose is not None
        stretches, outline = _stretches(dock), dock.body_at(dock.pose)
        if area is not None and (met := _first_met(stretches, docks.vehicle, area)) is not None:
            at, depth = met
            allowed = f"{at.words} must be in the area and clear of its obstacles, overlaps by {depth:.2g} m"
            yield Problem(f"dock[{place}].{at.key}", at.value, allowed)
        if outline is None:
            continue
        met = _first_met(stretches, docks.vehicle, SolidThings.of(Area(obstacles=[outline])))
        if met is not None:
            at, depth = met
            allowed = f"must not overlap {at.words}, does by {depth:.2g} m"
            yield Problem(f"dock[{place}].body", np.asarray(dock.body).tolist(), allowed)


def _first_met(
    stretches: list[_Stretch], vehicle: Vehicle, solid: SolidThings
) -> tuple[_Stretch, float] | None:
    """The first stretch on which the body overlaps something solid, and how deep at most [m]; None: none."""
    for stretch in stretches:
        rows: Array = np.array([[pose.x, pose.y, pose.phi] for pose in stretch.poses])
        room = float(solid.clearance(rows, vehicle).min())
        if room < -ROUNDING:
            return stretch, -room
    return None


def approach_poses(dock: Dock) -> list[Pose2]:
    """Of the vehicle along the straight last piece of the way into a dock, every `SPACING`; none without."""
    if dock.approach is None or dock.pose is None:
        return []
    length, direction = dock.approach.length, dock.approach.direction
    marks: list[Any] = np.linspace(0.0, length, int(np.ceil(length / SPACING)) + 1).tolist()
    return [dock.pose.compose(Pose2(-direction * mark, 0.0, 0.0)) for mark in marks]


assert set(get_args(Kind)) == {kind.value for kind in DockKind}
