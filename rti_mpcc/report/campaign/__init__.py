"""The report of `rti-mpcc campaign-report`: how often a campaign docked, where it did not, its worst cases.

`rows` reads them, `figures`, `losses`, `difficulty`, `pairs` and `worst` make numbers of them, `words` and
`pictures` show these, `report` writes the files.
"""

from __future__ import annotations
