"""Tables, pictures and files of a run. Figures load matplotlib, so nothing is imported here."""

from __future__ import annotations
