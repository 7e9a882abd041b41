"""Colours that stay apart for colour-blind readers (Okabe and Ito 2008), and what all figures share."""

from __future__ import annotations

BLACK = "#000000"
GREY = "#8c8c8c"
ORANGE = "#e69f00"
SKY = "#56b4e9"
GREEN = "#009e73"
BLUE = "#0072b2"
RED = "#d55e00"
PINK = "#cc79a7"
COLORS = (BLACK, GREY, ORANGE, SKY, GREEN, BLUE, RED, PINK)

WEIGHTS = (("lag", BLACK), ("contouring", BLUE), ("progress reward", ORANGE), ("goal position", RED))
"""Effective weights in the order of `Moment.weights`: name and colour."""

DPI = 130
"""Resolution of the written pictures [dots/inch]."""
