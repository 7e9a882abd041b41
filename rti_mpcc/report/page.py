"""Pages as one HTML file that needs nothing else, by the templates beside this file."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from itertools import count
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from rti_mpcc.report.axes import png
from rti_mpcc.report.content import Section
from rti_mpcc.report.numbers import counted, in_words, number, percent

_SYMBOL = re.compile(r"(?<!\w)([A-Za-zθδ])_([A-Za-zθδ]+)(?:\^([a-z]+))?")
"""A letter with an index: q_c, θ_k, a_lat, q_N^e."""


def html_page(title: str, sections: Sequence[Section]) -> str:
    """The page of sections made as values."""
    return rendered("sections.html", title, given=sections)


def rendered(template: str, title: str, **given: Any) -> str:
    """The page of a template that extends page.html, with what it is given."""
    environment = Environment(
        loader=PackageLoader("rti_mpcc.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters = (counted, embedded, in_words, marked, number, percent)
    environment.filters |= {one.__name__: one for one in filters}
    environment.globals |= {"next": next, "zip": zip}
    counted_up = {"contents": [], "table_numbers": count(1), "figure_numbers": count(1)}
    return environment.get_template(template).render(title=title, **counted_up, **given).lstrip()


def embedded(picture: bytes | Figure) -> str:
    """A picture as an address that holds all of it."""
    data = png(picture) if isinstance(picture, Figure) else picture
    return f"data:image/png;base64,{b64encode(data).decode('ascii')}"


def marked(text: object) -> Markup:
    """Escaped; what stands between backticks is code, elsewhere q_c and q_N^e are set as symbols."""
    parts = str(escape(text)).split("`")
    if len(parts) % 2 == 0:  # a backtick without its other one is a backtick
        parts[-2:] = ["`".join(parts[-2:])]
    return Markup(
        "".join(
            f"<code>{part}</code>" if place % 2 else _SYMBOL.sub(_symbol, part)
            for place, part in enumerate(parts)
        )
    )


def _symbol(found: re.Match[str]) -> str:
    base, below, above = found.groups()
    return f"<i>{base}</i><sub>{below}</sub>" + (f"<sup>{above}</sup>" if above else "")
