"""The version of this package."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("rti-mpcc")
except PackageNotFoundError:  # run from its sources, without being installed
    __version__ = "0+unknown"
