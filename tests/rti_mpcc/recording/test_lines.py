from __future__ import annotations

import json
from math import inf, nan
from struct import pack

import numpy as np
import pytest

from rti_mpcc.recording.lines import from_line, to_line

CONTENT = {"a": 1e-5, "b": [1.5, -2e300, 7, None], "c": "é"}
LINE = to_line(CONTENT).rstrip()


def back(value: object) -> object:
    return from_line(to_line({"value": value}).rstrip())[0]["value"]


def test_a_line_is_read_as_it_was_written() -> None:
    assert from_line(LINE) == (CONTENT, True)


def test_a_line_is_json_whose_last_entry_is_its_checksum() -> None:
    data = json.loads(LINE)
    assert list(data) == ["a", "b", "c", "crc"]
    assert len(data["crc"]) == 8


def test_every_flipped_bit_is_found() -> None:
    """Also where the line says the same all the same, as 1E-05 does."""
    for position in range(len(LINE)):
        for bit in range(8):
            flipped = bytearray(LINE)
            flipped[position] ^= 1 << bit
            assert not from_line(bytes(flipped))[1], (position, bit)


@pytest.mark.parametrize("line", [b"", b"{", b"[1]", b"3", b"\xff"])
def test_what_is_no_object_says_nothing(line: bytes) -> None:
    assert from_line(line) == ({}, False)


@pytest.mark.parametrize(
    "value", [0.0, -0.0, 1 / 3, 5e-324, 1.7976931348623157e308, 1e-7, inf, -inf, np.nextafter(1.0, 2.0)]
)
def test_numbers_keep_their_bits(value: float) -> None:
    again = back(value)
    assert isinstance(again, float)
    assert pack("<d", again) == pack("<d", value)


def test_any_number_keeps_its_bits() -> None:
    numbers = np.frombuffer(np.random.default_rng(0).bytes(80_000))
    finite = numbers[np.isfinite(numbers)]
    assert np.array(back(finite)).tobytes() == finite.tobytes()


def test_nan_is_always_the_same_object() -> None:
    """Equality of tuples, and so of dataclasses, goes by identity first."""
    assert back([nan, 1.0]) == back([float("nan"), 1.0])


def test_scalars_of_numpy_are_numbers() -> None:
    assert back([np.float64(1.5), np.float32(0.5), np.int64(2), np.bool_(True)]) == [1.5, 0.5, 2, True]
