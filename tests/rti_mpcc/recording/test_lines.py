from __future__ import annotations

from rti_mpcc.recording.lines import from_line, to_line

LINE = to_line({"a": 1e-5, "b": [1.5, -2e300, 7, None], "c": "é"}).encode("utf-8")


def intact(line: bytes) -> bool:
    try:
        return from_line(line)[1]
    except ValueError:
        return False


def test_a_line_is_read_as_it_was_written() -> None:
    assert from_line(LINE) == ({"a": 1e-5, "b": [1.5, -2e300, 7, None], "c": "é"}, True)


def test_every_flipped_bit_is_found() -> None:
    """Also where the line says the same all the same, as 1E-05 does."""
    for position in range(len(LINE) - 1):
        for bit in range(8):
            flipped = bytearray(LINE)
            flipped[position] ^= 1 << bit
            assert not intact(bytes(flipped)), (position, bit)
