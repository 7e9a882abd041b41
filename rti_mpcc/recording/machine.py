"""What decides over the last bits of a computation besides the program: processor and library versions."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = ("rti-mpcc", "numpy", "scipy", "osqp", "shapely", "filterpy", "numba")
"""Those whose version counts."""

_CPUINFO = Path("/proc/cpuinfo")
_CPU_LINES = ("model name", "cpu family", "model", "stepping")


@dataclass(frozen=True, slots=True, kw_only=True)
class Machine:
    """Where a recording was made. Names no host, user or folder.

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
        """The one that this runs on."""
        versions = {
            "python": platform.python_version(),
            "libc": " ".join(platform.libc_ver()).strip(),
            **{package: _version(package) for package in PACKAGES},
        }
        return cls(architecture=platform.machine(), processor=_processor(), versions=versions)


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def _processor() -> str:
    """Model, family and stepping of the first processor: a model's name alone may stand for several."""
    try:
        lines = _CPUINFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return platform.processor()
    known: dict[str, str] = {}
    for line in lines:
        name, _, value = line.partition(":")
        if name.strip() in _CPU_LINES:
            known.setdefault(name.strip(), value.strip())
    return ", ".join(f"{name} {value}" for name, value in known.items()) or platform.processor()
