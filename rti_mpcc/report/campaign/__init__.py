"""The report of `rti-mpcc campaign-report`: how often a campaign docked, where it did not, its worst cases.

`columns` reads the rows, `figures`, `difficulty`, `worst` and `pairs` make numbers of them, the sections and
pictures show these, `report` writes the files.
"""

from __future__ import annotations
