"""Files that somebody else wrote: read, or refused in one line of the caller's error class, and status 2."""

from __future__ import annotations

import os
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest
from PIL import Image

from geometry import Area, AreaError, InputError, PathError, ReferencePath, files
from rti_mpcc.errors import RecordingError, ScenarioError
from rti_mpcc.recording import load_problem, read_recording
from rti_mpcc.recording.contents import FORMAT, VERSION, to_line
from rti_mpcc.simulation import load_scenario
from rti_mpcc.simulation.campaign import read_rows
from rti_mpcc.simulation.docks_file import load_docks
from tests.rti_mpcc.cli_runs import SCENARIO

Reader = Callable[[Path], object]
Asked = tuple[Reader, type[InputError], str]
READERS: dict[str, Asked] = {
    "scenario": (load_scenario, ScenarioError, "file.toml"),
    "docks": (load_docks, ScenarioError, "file.toml"),
    "map": (Area.from_map, AreaError, "file.yaml"),
    "path": (ReferencePath.from_csv, PathError, "file.csv"),
    "recording": (read_recording, RecordingError, "file.jsonl"),
    "problem": (load_problem, RecordingError, "file.npz"),
    "campaign": (lambda file: read_rows(file.parent), InputError, "rows.jsonl"),
}
MAP = (
    "image: {image}\nresolution: 0.1\norigin: [0, 0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.2\nnegate: 0\n"
)
CORNERS = np.array([[255, 0, 255], [255, 255, 255]], dtype=np.uint8)


def refusal(reader: Reader, error: type[InputError], file: Path) -> str:
    with pytest.raises(error) as refused:
        reader(file)
    said = str(refused.value)
    assert len(said.splitlines()) == 1
    assert len(said) < 600
    return said


@pytest.fixture(params=READERS)
def asked(request: pytest.FixtureRequest) -> Asked:
    found: Asked = READERS[request.param]
    return found


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no pipes")
def test_a_pipe_is_refused_and_not_waited_for(asked: Asked, tmp_path: Path) -> None:
    reader, error, name = asked
    os.mkfifo(tmp_path / name)
    assert "it is no regular file" in refusal(reader, error, tmp_path / name)


def test_a_file_that_is_far_too_large_is_refused_unread(asked: Asked, tmp_path: Path) -> None:
    reader, error, name = asked
    with (tmp_path / name).open("wb") as stream:
        stream.truncate(files.RECORDING + 1)  # takes no place on the disk
    tracemalloc.start()
    said = refusal(reader, error, tmp_path / name)
    taken = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert " MB are allowed" in said
    assert taken < 1e6


def test_a_byte_order_mark_says_nothing(tmp_path: Path) -> None:
    mark = b"\xef\xbb\xbf"
    file = tmp_path / "short.toml"
    file.write_bytes(mark + SCENARIO.replace("DURATION", "1.0").encode())
    assert load_scenario(file).name == "short"
    (tmp_path / "track.csv").write_bytes(mark + b"x,y,heading,direction\n0,0,0,1\n1,0,0,1\n")
    assert ReferencePath.from_csv(tmp_path / "track.csv").length == 1.0
    Image.fromarray(CORNERS).save(tmp_path / "yard.png")
    (tmp_path / "yard.yaml").write_bytes(mark + MAP.format(image="yard.png").encode())
    assert len(Area.from_map(tmp_path / "yard.yaml").obstacles) == 1


# -- TOML ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["scenario", "docks"])
@pytest.mark.parametrize(
    ("text", "said"),
    [
        (".".join("a" * 20_000) + " = 1\n", "has a key of more than 32 parts"),
        ("[" + ".".join(['"a b"'] * 20_000) + "]\n", "has a key of more than 32 parts"),
        ('x = { t = """y"""", ' + " . ".join("a" * 100) + ' = "z" }\n', "has a key of more than 32 parts"),
        ("x = " + "[" * 30_000 + "]" * 30_000 + "\n", "is nested more than 32 deep"),
        ("x = " + "[" * 40 + "]" * 40 + "\n", "is nested more than 32 deep"),
        ("x = " + "{a=" * 40 + "1" + "}" * 40 + "\n", "is nested more than 32 deep"),
        (f"x = {'9' * 5_000}\n", "is not TOML that is read here, it "),
        (f"x = 0x{'f' * 5_000}\n", "has a whole number of more than 64 bits"),
        (f"x = [1, [{2**63}]]\n", "has a whole number of more than 64 bits"),
    ],
    ids=["dotted", "header", "behind a text", "arrays", "deep", "tables", "digits", "hexadecimal", "64 bits"],
)
def test_toml_that_takes_far_more_than_its_size_is_refused(
    kind: str, text: str, said: str, tmp_path: Path
) -> None:
    reader, error, name = READERS[kind]
    (tmp_path / name).write_text(text, encoding="utf-8")
    assert said in refusal(reader, error, tmp_path / name)


# -- maps ----------------------------------------------------------------------------------------------------


def aliased(key: str) -> str:
    """Nine lists of nine times the one before, in a text of 600 bytes."""
    lists = ["a0: &a0 [lol, lol, lol, lol, lol, lol, lol, lol, lol]"]
    lists += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 9)]
    return "\n".join(
        [*lists, MAP.format(image="yard.png").replace(f"{key}:", "left_alone:"), f"{key}: *a8\n"]
    )


@pytest.mark.parametrize("key", ["mode", "negate", "image", "origin", "resolution"])
def test_aliases_in_a_map_are_refused(key: str, tmp_path: Path) -> None:
    file = tmp_path / "yard.yaml"
    file.write_text(aliased(key), encoding="utf-8")
    assert "aliases are not allowed" in refusal(Area.from_map, AreaError, file)


@pytest.mark.parametrize(
    "line",
    [
        "mode: " + "x" * 10_000,
        "negate: " + "[a, " * 20 + "]" * 20,
        "mode: 0x" + "f" * 6_000,
        "mode: 1" + ":1" * 4_000,
        "mode: !!timestamp never",
        "mode: !!bool perhaps",
        'mode: !!int ""',
        "mode: 9" + ":9" * 300 + ".5",
    ],
    ids=["long", "deep", "hexadecimal", "sexagesimal", "timestamp", "bool", "empty", "float"],
)
def test_odd_values_in_a_map_are_refused(line: str, tmp_path: Path) -> None:
    file = tmp_path / "yard.yaml"
    lines = [each for each in MAP.format(image="yard.png").splitlines() if each[:6] != line[:6]]
    file.write_text("\n".join([*lines, line]), encoding="utf-8")
    refusal(Area.from_map, AreaError, file)


def board(folder: Path, size: int) -> Path:
    """The map of a checkerboard, of some kilobytes."""
    cells = (np.add.outer(np.arange(size), np.arange(size)) % 2 * 255).astype(np.uint8)
    Image.fromarray(cells).save(folder / "board.png")
    file = folder / "board.yaml"
    file.write_text(MAP.format(image="board.png"), encoding="utf-8")
    return file


def test_a_checkerboard_is_read_in_little_memory_or_refused(tmp_path: Path) -> None:
    tracemalloc.start()
    assert len(Area.from_map(board(tmp_path, 900)).obstacles) == 405_000
    assert tracemalloc.get_traced_memory()[1] < 250e6
    tracemalloc.reset_peak()
    said = refusal(Area.from_map, AreaError, board(tmp_path, 1_200))
    assert said.endswith(
        "occupied cells make 720000 rectangles, 500000 are allowed: take the noise out of the picture."
    )
    said = refusal(Area.from_map, AreaError, board(tmp_path, 2_400))
    assert "occupied cells make 2880000 runs, 2000000 are allowed" in said
    assert tracemalloc.get_traced_memory()[1] < 150e6
    tracemalloc.stop()


# -- recordings ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "content",
    [
        b"[" * 100_000,
        b'{"a":' * 100_000,
        b'{"format":"%s","version":' % FORMAT.encode() + b"[" * 900 + b"]" * 900 + b"}",
        b'{"format":"%s","version":' % FORMAT.encode() + b"9" * 6_000 + b"}",
        to_line({"format": FORMAT, "version": VERSION, "config": [[[[[]]]]]}),
    ],
)
def test_recordings_of_anything_are_refused(content: bytes, tmp_path: Path) -> None:
    file = tmp_path / "run.jsonl"
    file.write_bytes(content + b"\n")
    refusal(read_recording, RecordingError, file)


def test_a_problem_that_is_far_larger_unpacked_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "qp.npz"
    with ZipFile(file, "w", ZIP_DEFLATED) as archive, archive.open("q.npy", "w") as stream:
        for _ in range(21):
            stream.write(bytes(10_000_000))
    assert "it has more than 200 MB" in refusal(load_problem, RecordingError, file)
