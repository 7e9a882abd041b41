"""Maps in the format of the ROS map_server, written here, beside their cells one by one."""

from __future__ import annotations

from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
import yaml
from numpy.typing import NDArray
from PIL import Image

from geometry import Area, AreaError
from geometry.arrays import Array, Index
from geometry.map_file import merged_cells, read_map
from geometry.shape_grid import Body
from tests.geometry.convex_shapes import placed

POINT = Body.of([(0.0, 0.0)])
CAR = np.array([[-0.2, -0.3], [0.7, -0.3], [0.7, 0.3], [-0.2, 0.3]])
ENTRIES: dict[str, Any] = {
    "image": "yard.png",
    "resolution": 0.1,
    "origin": [0.0, 0.0, 0.0],
    "occupied_thresh": 0.65,
    "free_thresh": 0.196,
    "negate": 0,
}

# The first row is the top: the one black cell is the second from the left, in the upper row.
CORNER = np.array([[255, 0, 255], [255, 255, 255]], dtype=np.uint8)


def yaml_file(folder: Path, **changes: Any) -> Path:
    """The YAML file, with other entries, or without those that are None."""
    entries = {key: value for key, value in (ENTRIES | changes).items() if value is not None}
    file = folder / "yard.yaml"
    file.write_text(yaml.safe_dump(entries), encoding="utf-8")
    return file


def written(folder: Path, pixels: NDArray[Any], kind: str | None = None, **changes: Any) -> Path:
    """A map of these pixels, of a kind that pillow knows."""
    picture = Image.fromarray(pixels)
    (picture if kind is None else picture.convert(kind)).save(folder / "yard.png")
    return yaml_file(folder, **changes)


def occupied(file: Path, shape: tuple[int, int], **options: bool) -> list[list[int]]:
    """Which cells of a map are solid, rows from the top, as points in their middles tell."""
    entries = yaml.safe_load(file.read_text(encoding="utf-8"))
    row, column = np.indices(shape)
    middles = in_world(entries, row, column, shape[0])
    found = Area.from_map(file, **options).signed_distances(
        POINT, np.column_stack([middles, np.zeros(len(middles))])
    )
    return (found < 0.0).astype(int).reshape(shape).tolist()


def in_world(entries: dict[str, Any], row: Index, column: Index, rows: int, inside: float = 0.5) -> Array:
    """Points (n, 2) in cells, `inside` from their left and lower sides, rows counted from the top."""
    x, y, yaw = entries["origin"]
    ahead = entries["resolution"] * (np.ravel(column) + inside)
    aside = entries["resolution"] * (rows - 1 - np.ravel(row) + inside)
    return np.column_stack([x + cos(yaw) * ahead - sin(yaw) * aside, y + sin(yaw) * ahead + cos(yaw) * aside])


def test_the_first_row_is_the_top_and_the_origin_the_lower_left_corner(tmp_path: Path) -> None:
    file = written(tmp_path, CORNER, resolution=0.5, origin=[10.0, -3.0, 0.0])
    area = Area.from_map(file)
    assert area.boundary is not None
    np.testing.assert_allclose(area.boundary, [(10.0, -3.0), (11.5, -3.0), (11.5, -2.0), (10.0, -2.0)])
    np.testing.assert_allclose(area.obstacles, [[(10.5, -2.5), (11.0, -2.5), (11.0, -2.0), (10.5, -2.0)]])
    assert not any(each.flags.writeable for each in area.obstacles)


@pytest.mark.parametrize("yaw", [-2.0, 0.0, 0.4, np.pi / 2])
@pytest.mark.parametrize("at", [(0.0, 0.0), (-14.2, 33.1), (1e9, -1e9)])
def test_a_turned_map_has_its_cells_turned_about_the_origin(
    tmp_path: Path, yaw: float, at: tuple[float, float]
) -> None:
    random = np.random.default_rng(3)
    black = random.uniform(size=(13, 9)) < 0.4
    pixels = np.where(black, 0, 255).astype(np.uint8)
    file = written(tmp_path, pixels, resolution=0.25, origin=[*at, yaw])
    assert occupied(file, black.shape) == black.astype(int).tolist()
    # A body beside them, as shapely sees the cells one by one and what is outside of all.
    entries = ENTRIES | {"resolution": 0.25, "origin": [0.0, 0.0, yaw]}
    cells = [cell(entries, int(row), int(column), 13) for row, column in np.argwhere(black)]
    whole = shapely.union_all(cells, grid_size=1e-9)
    outline = shapely.Polygon(read_map(file)[0] - at)
    whole = whole.union(outline.buffer(30.0).difference(outline))
    poses = np.column_stack([random.uniform(-4.0, 4.0, (200, 2)), random.uniform(-4.0, 4.0, 200)])
    moved = poses + np.array([*at, 0.0])
    poses = moved - np.array([*at, 0.0])
    for value, pose in zip(Area.from_map(file).signed_distances(Body.of(CAR), moved), poses, strict=True):
        apart = shapely.distance(shapely.Polygon(placed(CAR, pose)), whole)
        assert value == pytest.approx(apart, abs=1e-6) if apart > 1e-6 else value < 1e-6


def cell(entries: dict[str, Any], row: int, column: int, rows: int) -> shapely.Polygon:
    low, high = (in_world(entries, np.array(row), np.array(column), rows, inside) for inside in (0.0, 1.0))
    across = in_world(entries, np.array(row), np.array(column + 1), rows, 0.0)
    return shapely.Polygon([low[0], across[0], high[0], low[0] + high[0] - across[0]])


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("shape", [(1, 1), (1, 12), (12, 1), (17, 23)])
def test_rectangles_cover_each_cell_once(share: float, shape: tuple[int, int]) -> None:
    cells = np.random.default_rng(1).uniform(size=shape) < share
    times = np.zeros(shape, dtype=np.int64)
    for left, bottom, right, top in merged_cells(cells):
        times[bottom:top, left:right] += 1
    np.testing.assert_array_equal(times, cells)


def test_thresholds_are_not_reached_by_what_is_equal_to_them(tmp_path: Path) -> None:
    # p = 0.2 at 204 and 0.6 at 102, exactly as 51 / 255 and 153 / 255 are.
    pixels = np.array([[205, 204, 203, 103, 102, 101]], dtype=np.uint8)
    file = written(tmp_path, pixels, free_thresh=0.2, occupied_thresh=0.6)
    assert occupied(file, (1, 6)) == [[0, 1, 1, 1, 1, 1]]
    assert occupied(file, (1, 6), unknown_is_free=True) == [[0, 0, 0, 0, 0, 1]]


def test_negated_white_is_occupied(tmp_path: Path) -> None:
    pixels = np.array([[50, 51, 52, 152, 153, 154]], dtype=np.uint8)
    for negate in (1, True):
        file = written(tmp_path, pixels, free_thresh=0.2, occupied_thresh=0.6, negate=negate)
        assert occupied(file, (1, 6)) == [[0, 1, 1, 1, 1, 1]]
        assert occupied(file, (1, 6), unknown_is_free=True) == [[0, 0, 0, 0, 0, 1]]
    file = written(tmp_path, pixels, free_thresh=0.2, occupied_thresh=0.6, negate=False)
    assert occupied(file, (1, 6), unknown_is_free=True) == [[1, 1, 1, 0, 0, 0]]


@pytest.mark.parametrize("content", [b"P2\n# a comment\n3 2\n255\n255 0 255\n255 255 255\n", None])
def test_a_plain_and_a_binary_pgm_are_read(tmp_path: Path, content: bytes | None) -> None:
    image = tmp_path / "maps" / "yard.pgm"
    image.parent.mkdir()
    if content is None:
        Image.fromarray(CORNER).save(image)
        assert image.read_bytes().startswith(b"P5")
    else:
        image.write_bytes(content)
    for name in ("maps/yard.pgm", str(image)):
        assert occupied(yaml_file(tmp_path, image=name), (2, 3)) == [[0, 1, 0], [0, 0, 0]]


@pytest.mark.parametrize("kind", ["RGB", "P", "RGBA", "LA"])
def test_colours_are_read(tmp_path: Path, kind: str) -> None:
    assert occupied(written(tmp_path, CORNER, kind), (2, 3)) == [[0, 1, 0], [0, 0, 0]]


def test_the_mean_of_a_colour_counts(tmp_path: Path) -> None:
    # Means of 205, 204 and 102, 101.
    pixels = np.array([[[255, 255, 105], [255, 255, 102], [0, 51, 255], [0, 48, 255]]], dtype=np.uint8)
    file = written(tmp_path, pixels, free_thresh=0.2, occupied_thresh=0.6)
    assert occupied(file, (1, 4)) == [[0, 1, 1, 1]]
    assert occupied(file, (1, 4), unknown_is_free=True) == [[0, 0, 0, 1]]


def test_what_is_not_opaque_is_unknown(tmp_path: Path) -> None:
    pixels = np.array([[[255, 255, 255, 255], [255, 255, 255, 254], [0, 0, 0, 0], [0, 0, 0, 255]]], np.uint8)
    file = written(tmp_path, pixels)
    assert occupied(file, (1, 4)) == [[0, 1, 1, 1]]
    assert occupied(file, (1, 4), unknown_is_free=True) == [[0, 0, 0, 1]]


def test_other_keys_and_forms_of_numbers_are_read(tmp_path: Path) -> None:
    Image.fromarray(CORNER).save(tmp_path / "yard.png")
    file = tmp_path / "yard.yaml"
    file.write_text(
        "image: yard.png\nresolution: 5e-1\norigin: [1, 2.0, 0]\noccupied_thresh: 1\nfree_thresh: 0.5\n"
        "negate: 0\nmode: Trinary\nversion: 2\n",
        encoding="utf-8",
    )
    np.testing.assert_allclose(read_map(file)[0], [(1, 2), (2.5, 2), (2.5, 3), (1, 3)])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        *[
            ({key: None}, f"{key} is missing, a map needs image, resolution, origin, occ.*, negate.")
            for key in ENTRIES
        ],
        ({"image": 5}, r"image = 5: must be the name of a PGM or PNG file\."),
        ({"image": "other.png"}, r".*other.png cannot be read as PGM or PNG \(No such file or directory\)\."),
        ({"image": "yard.yaml"}, r".*yard.yaml is no picture, it must be PGM or PNG\."),
        ({"image": "short.png"}, r".*short.png cannot be read as PGM or PNG \(.*\)\."),
        ({"resolution": 0.0}, r"resolution = 0.0: must be a number from 1e-06 to 1e\+06\."),
        ({"resolution": float("nan")}, r"resolution = nan: must be a number from .*"),
        ({"resolution": True}, r"resolution = True: must be a number from .*"),
        ({"resolution": "fine"}, r"resolution = 'fine': must be a number from .*"),
        ({"resolution": 10**400}, r"is no YAML file, or has a whole number of more than 64 bits\."),
        ({"origin": [0.0, float("nan"), 0.0]}, r"origin = \[0.0, nan, 0.0\]: must be \[x, y, yaw\], .*"),
        ({"origin": [0.0, 1e13, 0.0]}, r"origin = .*: must be \[x, y, yaw\], numbers of at most 1e\+12\."),
        ({"origin": 5}, r"origin = 5: must be \[x, y, yaw\], .*"),
        ({"occupied_thresh": 1.5}, r"occupied_thresh = 1.5: must be a number from 0 to 1\."),
        ({"free_thresh": -0.1}, r"free_thresh = -0.1: must be a number from 0 to 1\."),
        ({"free_thresh": 0.7}, r"free_thresh = 0.7 must not be more than occupied_thresh = 0.65\."),
        ({"negate": "maybe"}, r"negate = 'maybe': must be 0 or 1\."),
        ({"mode": "scale"}, r"mode = 'scale': must be trinary, scale and raw are not supported\."),
        ({"free_thresh": 0.0}, r"no cell of the map is free, at least one must be\."),
    ],
)
def test_bad_maps_are_refused(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    file = written(tmp_path, CORNER, **changes)
    (tmp_path / "short.png").write_bytes((tmp_path / "yard.png").read_bytes()[:50])
    with pytest.raises(AreaError, match=rf"(?s)^{file}: {message}$"):
        Area.from_map(file)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"image: [yard.png\nresolution: 0.1\n", r"is no YAML file \(line 2: .*\)\."),
        (b"P5\n3 2\n255\n\x00\xff\x00", r"is no YAML file, or has a value that YAML does not allow\."),
        (b"[" * 50 + b"]" * 50, r"is no YAML file, or is nested more than 32 deep\."),
        (b"", "must be a YAML file with the keys image, .*"),
    ],
)
def test_what_is_no_map_file_is_refused(tmp_path: Path, content: bytes, message: str) -> None:
    file = tmp_path / "yard.yaml"
    file.write_bytes(content)
    with pytest.raises(AreaError, match=rf"^{file}: {message}$"):
        Area.from_map(file)


@pytest.mark.parametrize("rows", [8_001, 1_000_000])  # pillow refuses the larger one itself
def test_a_picture_that_is_far_too_large_is_refused(tmp_path: Path, rows: int) -> None:
    (tmp_path / "yard.png").write_bytes(b"P5\n8000 %d\n255\n" % rows)
    with pytest.raises(AreaError, match=r"yard.png has too many pixels, 64000000 are allowed\.$"):
        Area.from_map(yaml_file(tmp_path))
