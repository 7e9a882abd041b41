"""What benchmarks.measure_deviations patches is where it says."""

from __future__ import annotations

from importlib import import_module

import pytest

from benchmarks.variations import VARIATIONS


@pytest.mark.parametrize("name", sorted({name for each in VARIATIONS for name in each.patches}))
def test_every_constant_that_is_patched_is_there(name: str) -> None:
    module, _, constant = name.rpartition(".")
    assert hasattr(import_module(module), constant)
