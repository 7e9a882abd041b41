"""Libraries of the optional extras in pyproject.toml: one sentence says which extra is to be installed."""

from __future__ import annotations

from importlib.util import find_spec

from geometry.errors import MissingExtraError

_NAMES = {"cv2": "OpenCV"}
"""Names of libraries in messages, where they differ from the name that is imported."""


def check_extra(extra: str, need: str, *libraries: str) -> None:
    """Raise MissingExtraError if one of the libraries is not installed. None of them is loaded.

    Args:
        extra: the extra that brings the libraries.
        need: start of the message, with its verb: "an MCAP file needs".
        libraries: top-level names as they are imported.
    """
    for library in libraries:
        if find_spec(library) is None:
            raise missing_extra(extra, f"{need} {_NAMES.get(library, library)}, which is not installed")


def missing_extra(extra: str, problem: str) -> MissingExtraError:
    """The error that names a problem and the extra that solves it."""
    return MissingExtraError(f"{problem}: pip install '.[{extra}]' in rti-mpcc's folder")
