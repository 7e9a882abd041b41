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

import warnings
from dataclasses import dataclass
from math import cos, isfinite, sin
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from PIL import Image, UnidentifiedImageError

from geometry.arrays import Array, Index, Mask
from geometry.errors import AreaError

_KEYS = ("image", "resolution", "origin", "occupied_thresh", "free_thresh", "negate")
FINEST, COARSEST = 1e-6, 1e6  # [m] of a cell
FARTHEST = 1e12  # [m] that the origin may be from (0, 0)


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


def read_map(file: str | PathLike[str], *, unknown_is_free: bool = False) -> OccupancyMap:
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
    cells = np.where(opaque, solid[levels], unknown_is_solid)
    if cells.all():
        raise AreaError(f"{file}: no cell of the map is free, at least one must be.")
    return map_of(cells[::-1], entries.resolution, entries.origin)


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
    """
    rows, columns = cells.shape
    framed = np.zeros((rows, columns + 2), dtype=np.int8)
    framed[:, 1:-1] = cells
    change = np.diff(framed, axis=1)
    row, left = np.nonzero(change > 0)
    right = np.nonzero(change < 0)[1]
    order = np.lexsort((row, right, left))
    row, left, right = row[order], left[order], right[order]
    first = np.ones(len(row), dtype=np.bool_)
    first[1:] = (np.diff(left) != 0) | (np.diff(right) != 0) | (np.diff(row) != 1)
    last = np.append(first[1:], True)[: len(row)]
    return np.column_stack([left[first], row[first], right[first], row[last] + 1])


def _corners(rectangles: Index, resolution: float, origin: tuple[float, float, float]) -> Array:
    """Corners (n, 4, 2) [m], counter-clockwise, of rectangles (n, 4) of cells: left, bottom, right, top."""
    corners = resolution * rectangles[:, [[0, 1], [2, 1], [2, 3], [0, 3]]]
    x, y, yaw = origin
    c, s = cos(yaw), sin(yaw)
    return np.asarray(corners @ np.array([[c, s], [-s, c]]) + np.array([x, y]))


# -- the YAML file -------------------------------------------------------------------------------------------


def _read_entries(file: str | PathLike[str]) -> _Entries:
    try:
        found = yaml.safe_load(Path(file).read_bytes())
    except OSError as error:
        raise AreaError(f"{file}: cannot be read ({error.strerror}).") from error
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise AreaError(f"{file}: is no YAML file (line {line}: {error.problem}).") from error
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise AreaError(f"{file}: is no YAML file, or has a value that YAML does not allow.") from error
    if not isinstance(found, dict):
        raise AreaError(f"{file}: must be a YAML file with the keys {', '.join(_KEYS)}.")
    for key in _KEYS:
        if key not in found:
            raise AreaError(f"{file}: {key} is missing, a map needs {', '.join(_KEYS)}.")
    mode = found.get("mode", "trinary")
    if str(mode).lower() != "trinary":
        raise AreaError(f"{file}: mode = {mode!r}: must be trinary, scale and raw are not supported.")
    free, occupied = (_number(file, found, key, 0.0, 1.0) for key in ("free_thresh", "occupied_thresh"))
    if free > occupied:
        raise AreaError(f"{file}: free_thresh = {free} must not be more than occupied_thresh = {occupied}.")
    if found["negate"] not in (0, 1):
        raise AreaError(f"{file}: negate = {found['negate']!r}: must be 0 or 1.")
    return _Entries(
        image=_image(file, found["image"]),
        resolution=_number(file, found, "resolution", FINEST, COARSEST),
        origin=_origin(file, found["origin"]),
        occupied_thresh=occupied,
        free_thresh=free,
        negate=bool(found["negate"]),
    )


def _image(file: str | PathLike[str], value: Any) -> str:
    if not isinstance(value, str) or not value or "\0" in value:
        raise AreaError(f"{file}: image = {value!r}: must be the name of a PGM or PNG file.")
    return value


def _origin(file: str | PathLike[str], value: Any) -> tuple[float, float, float]:
    x, y, yaw = (
        (_float(each) for each in value) if isinstance(value, list) and len(value) == 3 else (None,) * 3
    )
    if x is None or y is None or yaw is None or max(abs(x), abs(y), abs(yaw)) > FARTHEST:
        raise AreaError(f"{file}: origin = {value!r}: must be [x, y, yaw], numbers of at most {FARTHEST:g}.")
    return x, y, yaw


def _number(file: str | PathLike[str], found: dict[str, Any], key: str, least: float, most: float) -> float:
    value = _float(found[key])
    if value is None or not least <= value <= most:
        raise AreaError(f"{file}: {key} = {found[key]!r}: must be a number from {least:g} to {most:g}.")
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


def _read_picture(file: str | PathLike[str], image: str) -> tuple[Index, int, Mask]:
    """Levels (rows, columns), 0 to the one returned with them, and which pixels are opaque."""
    where = Path(file).parent / image
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(where) as picture:
                if picture.format not in ("PNG", "PPM") or picture.mode == "F":
                    kind = f"{picture.format} ({picture.mode})"
                    raise AreaError(f"{file}: {where} is a picture in {kind}, it must be PGM or PNG.")
                return _levels(picture)
    except (Image.DecompressionBombWarning, Image.DecompressionBombError) as error:
        raise AreaError(
            f"{file}: {where} has too many pixels, {Image.MAX_IMAGE_PIXELS} are allowed."
        ) from error
    except UnidentifiedImageError as error:
        raise AreaError(f"{file}: {where} is no picture, it must be PGM or PNG.") from error
    except AreaError:
        raise
    except (OSError, SyntaxError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise AreaError(f"{file}: {where} cannot be read as PGM or PNG ({reason}).") from error


def _levels(picture: Image.Image) -> tuple[Index, int, Mask]:
    if picture.mode.startswith("I"):
        deep = np.asarray(picture).astype(np.int64)
        return deep, 65535, np.ones(deep.shape, dtype=np.bool_)
    if "A" in picture.getbands() or "transparency" in picture.info:
        pixels = np.asarray(picture.convert("RGBA"))
        opaque = pixels[..., 3] == 255
    else:
        pixels = np.asarray(picture.convert("RGB"))
        opaque = np.ones(pixels.shape[:2], dtype=np.bool_)
    return pixels[..., :3].sum(axis=2, dtype=np.int64), 3 * 255, opaque
