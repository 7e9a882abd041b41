"""Occupancy grids in the format of the ROS map_server: a YAML file beside a picture (PGM or PNG).

The YAML file has the keys image (a path relative to the YAML file), resolution [m], origin, occupied_thresh,
free_thresh, negate (0 or 1) and, if given, mode (trinary only); others are left alone. The picture's first
row is its top; origin is the pose x, y, yaw [m, m, rad] of the lower left corner of its lower left pixel.
With the value of a pixel, 0 (black) to 255 (white), or the mean of red, green and blue,

(M1)  p = (255 - value) / 255, or value / 255 with negate

is how occupied its cell is: it is occupied where p > occupied_thresh, free where p < free_thresh, and unknown
otherwise. What is not opaque is unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, isfinite, sin
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from geometry import files
from geometry.arrays import Array, Index, Mask
from geometry.errors import AreaError, shown
from geometry.outline import FARTHEST

_KEYS = ("image", "resolution", "origin", "occupied_thresh", "free_thresh", "negate")
FINEST, COARSEST = 1e-6, 1e6  # [m] of a cell
_RECTANGLES = 500_000  # each takes some 300 bytes
_RUNS = 2_000_000  # of occupied cells in the rows, that rectangles are put together of


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OccupancyMap:
    """What a map file says.

    Attributes:
        outline: corners (4, 2) of the map, counter-clockwise [m].
        rectangles: corners (n, 4, 2) of rectangles that make up what is occupied, counter-clockwise [m]; they
            do not overlap.
    """

    outline: Array
    rectangles: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entries:
    """What the YAML file says, checked."""

    image: str
    resolution: float
    origin: tuple[float, float, float]
    occupied_thresh: float
    free_thresh: float
    negate: bool


def read_map(file: files.File, *, unknown_is_free: bool = False) -> OccupancyMap:
    """Read a map; its unknown cells count as occupied, unless `unknown_is_free`.

    Raises:
        AreaError: a file is missing or cannot be read, an entry is missing or not usable, or no cell is free.
    """
    entries = _read_entries(file)
    levels, most, opaque = _read_picture(file, entries.image)
    value = 255.0 * np.arange(most + 1) / most
    p = (value if entries.negate else 255.0 - value) / 255.0
    unknown_is_solid = not unknown_is_free
    solid = (p > entries.occupied_thresh) | ((p >= entries.free_thresh) & unknown_is_solid)
    cells = solid[levels]
    if opaque is not None:
        cells[~opaque] = unknown_is_solid
    if cells.all():
        raise AreaError(f"{file}: no cell of the map is free, at least one must be.")
    try:
        return map_of(cells[::-1], entries.resolution, entries.origin)
    except AreaError as error:
        raise AreaError(f"{file}: {error}") from None


def map_of(cells: Mask, resolution: float, origin: tuple[float, float, float]) -> OccupancyMap:
    """Return the map of solid cells (rows, columns), the first row at the origin x, y, yaw [m, m, rad]."""
    rows, columns = cells.shape
    outline = _corners(np.array([[0, 0, columns, rows]]), resolution, origin)[0]
    rectangles = _corners(merged_cells(cells), resolution, origin)
    for each in (outline, rectangles):
        each.setflags(write=False)
    return OccupancyMap(outline=outline, rectangles=rectangles)


def merged_cells(cells: Mask) -> Index:
    """Return rectangles (n, 4) that make up the cells set in (rows, columns): left, bottom, right, top.

    Each row's runs of such cells, put together with those of the rows above (the next ones) that begin and
    end where they do. Right and top are the first column and row beyond.

    Raises:
        AreaError: they are far too many.
    """
    rows, columns = cells.shape
    framed = np.zeros((rows, columns + 2), dtype=np.int8)
    framed[:, 1:-1] = cells
    change = np.diff(framed, axis=1)
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


def _corners(rectangles: Index, resolution: float, origin: tuple[float, float, float]) -> Array:
    """Corners (n, 4, 2) [m], counter-clockwise, of rectangles (n, 4) of cells: left, bottom, right, top."""
    corners = resolution * rectangles[:, [[0, 1], [2, 1], [2, 3], [0, 3]]]
    x, y, yaw = origin
    c, s = cos(yaw), sin(yaw)
    return np.asarray(corners @ np.array([[c, s], [-s, c]]) + np.array([x, y]))


# -- the YAML file -------------------------------------------------------------------------------------------


def _read_entries(file: files.File) -> _Entries:
    try:
        found = files.from_yaml(files.content(file, files.YAML))
    except OSError as error:
        raise AreaError(f"{file}: cannot be read ({error.strerror}).") from error
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise AreaError(f"{file}: is no YAML file (line {line}: {error.problem}).") from error
    except ValueError as error:
        raise AreaError(f"{file}: is no YAML file, or {error}.") from error
    if not isinstance(found, dict):
        raise AreaError(f"{file}: must be a YAML file with the keys {', '.join(_KEYS)}.")
    for key in _KEYS:
        if key not in found:
            raise AreaError(f"{file}: {key} is missing, a map needs {', '.join(_KEYS)}.")
    mode = found.get("mode", "trinary")
    if str(mode).lower() != "trinary":
        raise AreaError(f"{file}: mode = {shown(mode)}: must be trinary, scale and raw are not supported.")
    free, occupied = (_number(file, found, key, 0.0, 1.0) for key in ("free_thresh", "occupied_thresh"))
    if free > occupied:
        raise AreaError(f"{file}: free_thresh = {free} must not be more than occupied_thresh = {occupied}.")
    if found["negate"] not in (0, 1):
        raise AreaError(f"{file}: negate = {shown(found['negate'])}: must be 0 or 1.")
    return _Entries(
        image=_image(file, found["image"]),
        resolution=_number(file, found, "resolution", FINEST, COARSEST),
        origin=_origin(file, found["origin"]),
        occupied_thresh=occupied,
        free_thresh=free,
        negate=bool(found["negate"]),
    )


def _image(file: files.File, value: Any) -> str:
    if not isinstance(value, str) or not value or "\0" in value:
        raise AreaError(f"{file}: image = {shown(value)}: must be the name of a PGM or PNG file.")
    return value


def _origin(file: files.File, value: Any) -> tuple[float, float, float]:
    x, y, yaw = (
        (_float(each) for each in value) if isinstance(value, list) and len(value) == 3 else (None,) * 3
    )
    if x is None or y is None or yaw is None or max(abs(x), abs(y), abs(yaw)) > FARTHEST:
        raise AreaError(
            f"{file}: origin = {shown(value)}: must be [x, y, yaw], numbers of at most {FARTHEST:g}."
        )
    return x, y, yaw


def _number(file: files.File, found: dict[str, Any], key: str, least: float, most: float) -> float:
    value = _float(found[key])
    if value is None or not least <= value <= most:
        raise AreaError(f"{file}: {key} = {shown(found[key])}: must be a number from {least:g} to {most:g}.")
    return value


def _float(value: Any) -> float | None:
    """A finite number, or nothing; PyYAML takes 5e-2 for a text, other readers don't."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    try:
        number = float(value)
    except (ValueError, OverflowError):
        return None
    return number if isfinite(number) else None


# -- the picture ---------------------------------------------------------------------------------------------


def _read_picture(file: files.File, image: str) -> tuple[NDArray[Any], int, Mask | None]:
    """Levels (rows, columns), 0 to the one returned with them, and which pixels are opaque; None: all."""
    where = Path(file).parent / image
    try:
        return _levels(files.picture(where))
    except UnidentifiedImageError as error:
        raise AreaError(f"{file}: {where} is no picture, it must be PGM or PNG.") from error
    except ValueError as error:
        raise AreaError(f"{file}: {where} {error}.") from error
    except OSError as error:
        reason = getattr(error, "strerror", None) or error
        raise AreaError(f"{file}: {where} cannot be read as PGM or PNG ({reason}).") from error


def _levels(picture: Image.Image) -> tuple[NDArray[Any], int, Mask | None]:
    if picture.mode == "F":
        raise ValueError("is a picture of floats, its levels must be whole numbers")
    if picture.mode.startswith("I"):
        return np.asarray(picture), 65535, None
    if picture.mode in ("1", "L") and "transparency" not in picture.info:
        return np.asarray(picture.convert("L")), 255, None
    has_alpha = "A" in picture.getbands() or "transparency" in picture.info
    pixels = np.asarray(picture.convert("RGBA" if has_alpha else "RGB"))
    opaque = pixels[..., 3] == 255 if has_alpha else None
    return pixels[..., :3].sum(axis=2, dtype=np.uint16), 3 * 255, opaque
