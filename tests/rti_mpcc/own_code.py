"""Classes that docs/contributing.md shows, as a user types them in a module of the own."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

PAGE = Path(__file__).parents[2] / "docs" / "contributing.md"


@contextmanager
def shown_class(name: str, kinds: dict[str, Any], word: str) -> Iterator[Any]:
    """The class `name`, executed in a module of its own; `word`: its key in `kinds`, taken out afterwards."""
    module: Any = ModuleType(f"own_{name}")
    sys.modules[module.__name__] = module
    blocks = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (block,) = (each for each in blocks if f"class {name}" in each)
    exec(compile(block, str(PAGE), "exec"), vars(module))
    yield getattr(module, name)
    del kinds[word], sys.modules[module.__name__]
