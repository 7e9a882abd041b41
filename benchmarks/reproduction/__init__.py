"""The experiments of the paper, driven again: figures, tables, a page with three sources side by side.

`runs` says what is driven, a module an experiment makes its section, `page` puts them into one HTML file.
"""

from __future__ import annotations
