"""The version of this package, and what else decides over the last bits of a computation."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("rti-mpcc", "numpy", "scipy", "osqp", "piqp", "shapely", "filterpy", "numba")
"""The packages whose version counts."""

_CPU_LINES = ("model name", "cpu family", "model", "stepping")


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """Where a computation was made. Names no host, user or folder.

    Attributes:
        architecture: such as x86_64.
        processor: its model as far as the system tells it.
        versions: of Python, the C library and `PACKAGES`, by name; "" where unknown.
    """

    architecture: str
    processor: str
    versions: dict[str, str]

    @classmethod
    def here(cls) -> Machine:
        """The machine that this runs on."""
        versions = {"python": platform.python_version(), "libc": " ".join(platform.libc_ver()).strip()}
        versions |= {package: _version(package) for package in PACKAGES}
        return cls(architecture=platform.machine(), processor=_processor(), versions=versions)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _processor() -> str:
    """Model, family and stepping of the first processor: a model's name alone may stand for several."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    known: dict[str, str] = {}
    for name, _, value in (line.partition(":") for line in lines):
        if name.strip() in _CPU_LINES:
            known.setdefault(name.strip(), value.strip())
    return ", ".join(f"{name} {value}" for name, value in known.items()) or platform.processor()


__version__ = _version("rti-mpcc") or "0+unknown"  # where it runs from its sources, without being installed
