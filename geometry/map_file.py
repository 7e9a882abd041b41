"""Occupancy grids: maps in the format of the ROS map_server, and arrays laid out as a ROS OccupancyGrid.

A map is a YAML file beside a picture (PGM or PNG). The YAML file has the keys image (a path relative to the
YAML file), resolution [m], origin, occupied_thresh, free_thresh, negate (0 or 1) and, if given, mode (trinary
only); others are left alone. The picture's first row is its top; origin is the pose x, y, yaw [m, m, rad] of
the lower left corner of its lower left pixel. With the value of a pixel, 0 (black) to 255 (white), or the
mean of red, green and blue,

(A1)  p = (255 - value) / 255, or value / 255 with negate

is how occupied its cell is: it is occupied where p > occupied_thresh, free where p < free_thresh, and unknown
otherwise. What is not opaque is unknown. What an array says: `Area.from_grid`.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import yaml
from numpy.typing import ArrayLike, NDArray
from PIL import Image, UnidentifiedImageError
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from geometry import files
from geometry.arrays import Array, Index, Mask, locked
from geometry.errors import AreaError, shown
from geometry.outline import FARTHEST, outline_at
from geometry.pose import Pose2

_FINEST, _COARSEST = 1e-6, 1e6  # [m] of a cell
_OCCUPIED, _FREE = 0.65, 0.25  # of arrays
_RECTANGLES = 500_000  # each takes some 300 bytes
_RUNS = 2_000_000  # of occupied cells in the rows, that rectangles are put together of

Origin = tuple[float, float, float]


def read_map(file: files.File, *, unknown_is_free: bool = False) -> tuple[Array, Array]:
    """Read a map: its outline (4, 2), and rectangles (n, 4, 2) that make up what is occupied [m].

    All corners run counter-clockwise, and the rectangles do not overlap. Unknown cells count as occupied,
    unless `unknown_is_free`.

    Raises AreaError if a file is missing or cannot be read, an entry is not usable, or no cell is free.
    """
    try:
        entries = _checked(_read_yaml(file))
        levels, most, opaque = _read_picture(Path(file).parent / entries.image)
        value = 255.0 * np.arange(most + 1) / most
        p = (value if entries.negate else 255.0 - value) / 255.0
        unknown_is_solid = not unknown_is_free
        solid = (p > entries.occupied_thresh) | ((p >= entries.free_thresh) & unknown_is_solid)
        cells = solid[levels]
        if opaque is not None:
            cells[~opaque] = unknown_is_solid
        return _map_of(cells[::-1], entries.resolution, entries.origin)
    except AreaError as error:
        raise AreaError(f"{file}: {error}") from error.__cause__


def grid_map(
    array: ArrayLike, resolution: float, origin: Pose2 | Sequence[float], *, unknown_is_free: bool = False
) -> tuple[Array, Array]:
    """Return the same of a grid, see `Area.from_grid`."""
    cells = _solid(array, unknown_is_free)
    if not _FINEST <= resolution <= _COARSEST:
        raise AreaError(f"resolution = {resolution!r}: must be a number from {_FINEST:g} to {_COARSEST:g} m.")
    pose = (origin.x, origin.y, origin.phi) if isinstance(origin, Pose2) else tuple(origin)
    pose = (*pose, 0.0) if len(pose) == 2 else pose
    if len(pose) != 3 or not all(abs(value) <= FARTHEST for value in pose):
        raise AreaError(f"origin = {origin!r}: must be (x, y) or (x, y, yaw), at most {FARTHEST:g}.")
    return _map_of(cells, resolution, pose)


def _solid(array: ArrayLike, unknown_is_free: bool) -> Mask:
    try:
        given = np.asarray(array)
    except (TypeError, ValueError) as error:
        raise AreaError("array must be numbers or bools of shape (rows, columns).") from error
    if given.dtype.kind not in "biuf":
        raise AreaError(f"array has values of type {given.dtype}, they must be numbers or bools.")
    if given.ndim != 2 or given.size == 0:
        raise AreaError(f"array has shape {given.shape}, it must be (rows, columns), one cell at least.")
    with np.errstate(over="ignore"):
        values = given.astype(np.float32)
    unknown = np.isnan(values) | (values == -1.0)
    most = 100.0 if (values > 1.0).any() else 1.0
    odd = ~unknown & ~((values >= 0.0) & (values <= most))
    if odd.any():
        row, column = np.argwhere(odd)[0].tolist()
        raise AreaError(
            f"array[{row}, {column}] = {given[row, column]}: must be 0 to 1, or 0 to 100, or -1 for unknown."
        )
    unknown |= (values > _FREE * most) & (values < _OCCUPIED * most)
    return np.where(unknown, not unknown_is_free, values >= _OCCUPIED * most)


def _map_of(cells: Mask, resolution: float, origin: Origin) -> tuple[Array, Array]:
    """Of solid cells (rows, columns), the first row at the origin x, y, yaw [m, m, rad]."""
    if cells.all():
        raise AreaError("no cell of the map is free, at least one must be.")
    rows, columns = cells.shape
    outline = _corners(np.array([[0, 0, columns, rows]]), resolution, origin)[0]
    return locked(outline), locked(_corners(merged_cells(cells), resolution, origin))


def merged_cells(cells: Mask) -> Index:
    """Return rectangles (n, 4) that make up the cells set in (rows, columns): left, bottom, right, top.

    Each row's runs of such cells, put together with those of the rows above (the next ones) that begin and
    end where they do. Right and top are the first column and row beyond.

    Raises AreaError for far too many.
    """
    change = np.diff(np.pad(cells.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    _refuse_more("runs", int(np.count_nonzero(change > 0)), _RUNS)
    row, left = np.nonzero(change > 0)
    right = np.nonzero(change < 0)[1]
    order = np.lexsort((row, right, left))
    row, left, right = row[order], left[order], right[order]
    first = np.ones(len(row), dtype=np.bool_)
    first[1:] = (np.diff(left) != 0) | (np.diff(right) != 0) | (np.diff(row) != 1)
    _refuse_more("rectangles", int(np.count_nonzero(first)), _RECTANGLES)
    last = np.append(first[1:], True)[: len(row)]
    return np.column_stack([left[first], row[first], right[first], row[last] + 1])


def _refuse_more(of: str, count: int, most: int) -> None:
    if count > most:
        raise AreaError(
            f"occupied cells make {count} {of}, {most} are allowed: take the noise out of the picture."
        )


def _corners(rectangles: Index, resolution: float, origin: Origin) -> Array:
    """Corners (n, 4, 2) [m], counter-clockwise, of rectangles (n, 4) of cells: left, bottom, right, top."""
    return outline_at(resolution * rectangles[:, [[0, 1], [2, 1], [2, 3], [0, 3]]], Pose2(*origin))


class _Loader(yaml.SafeLoader):
    """Allows no aliases: a few lines of them stand for millions of values."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
            raise yaml.composer.ComposerError(None, None, "aliases are not allowed", mark)
        return super().compose_node(parent, index)


def _read_yaml(file: files.File) -> dict[str, Any]:
    try:
        found = yaml.load(files.content(file, files.YAML), _Loader)
    except OSError as error:
        raise AreaError(f"cannot be read ({error.strerror}).") from error
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise AreaError(f"is no YAML file (line {line}: {error.problem}).") from error
    except Exception as error:  # PyYAML lets through whatever its tags and numbers run into
        raise AreaError("is no YAML file, or has a value that YAML does not allow.") from error
    try:
        files.check_plain(found)
    except ValueError as error:
        raise AreaError(f"is no YAML file, or {error}.") from error
    if not isinstance(found, dict):
        raise AreaError(f"must be a YAML file with the keys {_KEYS}.")
    return found


def _no_truth_value(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError("must be a number")
    return value


# PyYAML takes 5e-2 for a text, other readers don't: a text is tried as a number.
_Number = Annotated[float, BeforeValidator(_no_truth_value)]
_Share = Annotated[_Number, Field(ge=0.0, le=1.0, description="a number from 0 to 1")]
_Place = Annotated[_Number, Field(ge=-FARTHEST, le=FARTHEST)]
_Length = Annotated[_Number, Field(ge=_FINEST, le=_COARSEST)]


class _Entries(BaseModel):
    """The entries of the YAML file; the description of each says what is allowed."""

    model_config = ConfigDict(allow_inf_nan=False)

    image: str = Field(pattern=r"^[^\x00]+$", description="the name of a PGM or PNG file")
    resolution: _Length = Field(description=f"a number from {_FINEST:g} to {_COARSEST:g}")
    origin: tuple[_Place, _Place, _Place] = Field(description=f"[x, y, yaw], numbers of at most {FARTHEST:g}")
    occupied_thresh: _Share
    free_thresh: _Share
    negate: Annotated[bool, BeforeValidator((False, True).index)] = Field(description="0 or 1")
    mode: Annotated[Literal["trinary"], BeforeValidator(lambda value: str(value).lower())] = Field(
        default="trinary", description="trinary, scale and raw are not supported"
    )


_KEYS = ", ".join(name for name, field in _Entries.model_fields.items() if field.is_required())


def _checked(found: dict[str, Any]) -> _Entries:
    try:
        entries = _Entries.model_validate(found)
    except ValidationError as error:
        problem = error.errors()[0]
        key = str(problem["loc"][0])
        if problem["type"] == "missing":
            raise AreaError(f"{key} is missing, a map needs {_KEYS}.") from None
        allowed = _Entries.model_fields[key].description
        raise AreaError(f"{key} = {shown(found[key])}: must be {allowed}.") from None
    free, occupied = entries.free_thresh, entries.occupied_thresh
    if free > occupied:
        raise AreaError(f"free_thresh = {free} must not be more than occupied_thresh = {occupied}.")
    return entries


def _read_picture(file: Path) -> tuple[NDArray[Any], int, Mask | None]:
    """Levels (rows, columns), 0 to the one returned with them, and which pixels are opaque; None: all."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            picture = Image.open(BytesIO(files.content(file, files.TABLE)), formats=("PNG", "PPM"))
        if picture.width * picture.height > files.PIXELS:
            raise Image.DecompressionBombError
        picture.load()
    except UnidentifiedImageError as error:
        raise AreaError(f"{file} is no picture, it must be PGM or PNG.") from error
    except Image.DecompressionBombError as error:
        raise AreaError(f"{file} has too many pixels, {files.PIXELS} are allowed.") from error
    except (OSError, SyntaxError, EOFError, ValueError, OverflowError) as error:
        reason = getattr(error, "strerror", None) or error
        raise AreaError(f"{file} cannot be read as PGM or PNG ({reason}).") from error
    if picture.mode == "F":
        raise AreaError(f"{file} is a picture of floats, its levels must be whole numbers.")
    if picture.mode.startswith("I"):
        return np.asarray(picture), 65535, None
    if picture.mode in ("1", "L") and "transparency" not in picture.info:
        return np.asarray(picture.convert("L")), 255, None
    pixels = np.asarray(picture.convert("RGBA"))
    return pixels[..., :3].sum(axis=2, dtype=np.uint16), 3 * 255, pixels[..., 3] == 255
