"""How a vehicle comes to its goal, and what its arrivals are like."""

from __future__ import annotations

from typing import Literal

Ride = Literal["smooth", "brisk"]
"""What an arrival is to be like, within comfort.

smooth: of least acceleration energy; its acceleration falls evenly, and is that of comfort at either end.
brisk: of least time, with the comfort acceleration as far as its jerk allows; some 15 % shorter.
"""
