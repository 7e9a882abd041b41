"""How the lines of methods look in the figures of the report."""

from __future__ import annotations

from typing import Any

from rti_mpcc.report import draw

PUBLISHED = "dynamic, published code"
BEYOND = "dynamic, preset default"
_DASHDOT = (0.0, (6.0, 1.5, 1.0, 1.5))
_LOOKS: dict[str, dict[str, Any]] = {
    "dynamic": {"color": draw.BLUE, "linestyle": "solid", "linewidth": 1.8},
    "separated": {"color": draw.PINK, "linestyle": (0.0, (5.0, 2.0)), "linewidth": 1.5},
    "switched": {"color": draw.RED, "linestyle": _DASHDOT, "linewidth": 1.5},
    "constant_1": {"color": draw.RED, "linestyle": (0.0, (1.0, 1.0)), "linewidth": 1.8},
    "constant_50": {"color": draw.PINK, "linestyle": _DASHDOT, "linewidth": 1.5},
    "constant_100": {"color": draw.GREEN, "linestyle": (0.0, (5.0, 2.0)), "linewidth": 1.5},
    BEYOND: {"color": draw.GREEN, "linestyle": (0.0, (6.0, 1.2, 1.0, 1.2, 1.0, 1.2)), "linewidth": 1.6},
    PUBLISHED: {"color": draw.BLACK, "linestyle": (0.0, (4.0, 2.0)), "linewidth": 0.9},
}


def look(name: str) -> dict[str, Any]:
    """Colour, dashes and width of the line of a method, with its name as label."""
    return {**_LOOKS[name], "label": name}
