"""Tables, pictures and files of a run. Figures load matplotlib, so no library is imported here."""

from __future__ import annotations

from geometry.errors import check_extra

# At the door of all modules here, and of the command line, which imports them.
check_extra("sim", "the command line, pictures and tables need", "rich", "pandas", "matplotlib", "jinja2")
