"""Check that the packages `geometry` and `estimation` are the ones this project ships.

Both are common names: a file geometry.py next to a user's script, or another distribution, is found before
ours. Without this check that shows as an ImportError about a missing name somewhere else.
"""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

_PACKAGES = ("geometry", "estimation")


def check_packages() -> None:
    """Raise if an import of them yields another package than the one installed beside `rti_mpcc`.

    Imports nothing, so that a foreign one is not run.

    Raises:
        ImportError: a package is missing or shadowed; the message names the file in the way.
    """
    for package in _PACKAGES:
        _check(package)


def _check(package: str) -> None:
    root = Path(__file__).parent.parent
    found = _location(package)
    if found is None:
        raise ImportError(
            f"rti_mpcc needs its package '{package}', which is missing from {root}", name=package
        )
    if not _same(found.parent, root / package):
        raise ImportError(
            f"rti_mpcc needs its own package '{package}' in {root}, but {found} shadows it: "
            "rename that file or take its directory off sys.path",
            name=package,
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
