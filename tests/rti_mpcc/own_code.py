"""Classes that the docs show for a user to type in a module of the own."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

DOCS = Path(__file__).parents[2] / "docs"


def python_blocks(page: Path) -> list[str]:
    """The Python code that a page shows, block after block."""
    return re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), flags=re.DOTALL)


@contextmanager
def shown_class(page: str, name: str, kinds: dict[str, Any], word: str) -> Iterator[Any]:
    """The class `name` of a page, in a module of its own; `word`: its key in `kinds`, removed afterwards."""
    module: Any = ModuleType(f"own_{name}")
    sys.modules[module.__name__] = module
    (block,) = (each for each in python_blocks(DOCS / page) if f"class {name}" in each)
    exec(compile(block, page, "exec"), vars(module))
    yield getattr(module, name)
    del kinds[word], sys.modules[module.__name__]
