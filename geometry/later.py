"""Public names of a package whose modules are imported when one of them is first used."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def import_later(
    package: str, names_of: Mapping[str, Sequence[str]]
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Return the `__getattr__` and the `__dir__` (PEP 562) of the package with this name; `names_of`: its
    public names by the module that has them."""
    module_of = {name: module for module, names in names_of.items() for name in names}
    namespace = vars(sys.modules[package])

    def find(name: str) -> Any:
        if name not in module_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        namespace[name] = found = getattr(import_module(module_of[name]), name)
        return found

    return find, lambda: sorted({*namespace, *module_of})
