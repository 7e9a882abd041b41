"""Check that the packages `geometry` and `estimation` are the ones this project ships.

Both are common names: a file geometry.py next to a user's script, or another distribution, is found before
ours. Without this check that shows as an ImportError about a missing name somewhere else.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path


def check_packages() -> None:
    """Raise ImportError if an import of them yields another package than the one installed beside `rti_mpcc`.

    Imports nothing, so that a foreign one is not run. The message names the file in the way.
    """
    root = Path(__file__).parent.parent
    for package in ("geometry", "estimation"):
        try:
            spec = find_spec(package)
        except ValueError:  # a module that was made in memory
            found = "<memory>"
        else:
            if spec is None:
                raise ImportError(f"rti_mpcc needs its package '{package}', which is missing from {root}")
            found = spec.origin or str(spec.submodule_search_locations)
        if Path(found).resolve() != (root / package / "__init__.py").resolve():
            raise ImportError(
                f"rti_mpcc needs its own package '{package}' in {root}, but {found} shadows it: "
                "rename that file or take its directory off sys.path"
            )
