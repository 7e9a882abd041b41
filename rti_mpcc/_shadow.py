"""Check that the package `geometry` is the one this project ships.

`geometry` is a common name: a file geometry.py next to a user's script, or another distribution, is found
before ours. Without this check that shows as an ImportError about a missing name somewhere else.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

_PACKAGE = "geometry"


def check_geometry() -> None:
    """Raise if `import geometry` yields another package than the one installed beside `rti_mpcc`.

    Imports nothing, so that a foreign `geometry` is not run.

    Raises:
        ImportError: `geometry` is missing or shadowed; the message names the file in the way.
    """
    root = Path(__file__).parent.parent
    found = _location(_PACKAGE)
    if found is None:
        raise ImportError(
            f"rti_mpcc needs its package '{_PACKAGE}', which is missing from {root}", name=_PACKAGE
        )
    if not _same(found.parent, root / _PACKAGE):
        raise ImportError(
            f"rti_mpcc needs its own package '{_PACKAGE}' in {root}, but {found} shadows it: "
            "rename that file or take its directory off sys.path",
            name=_PACKAGE,
            path=str(found),
        )


def _location(package: str) -> Path | None:
    """File that an import of `package` yields, loaded already or not; None if there is none."""
    module = sys.modules.get(package)
    if module is not None:
        file = getattr(module, "__file__", None)
        directories = list(getattr(module, "__path__", []))
    else:
        spec = importlib.util.find_spec(package)
        if spec is None:
            return None
        file = spec.origin
        directories = list(spec.submodule_search_locations or [])
    if file is not None:
        return Path(file)
    # A directory without __init__.py has no file; a module made in memory has not even a directory.
    return Path(directories[0]) / "__init__.py" if directories else Path("<memory>")


def _same(one: Path, other: Path) -> bool:
    """Whether two directories are the same one, also where an installer links instead of copying."""
    return one == other or one.resolve() == other.resolve()
