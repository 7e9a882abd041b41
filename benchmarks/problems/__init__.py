"""Random docking problems, each with a motion that proves that it can be docked: courses and scenes."""

from __future__ import annotations
