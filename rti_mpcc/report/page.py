"""Pages as one HTML file that needs nothing else, by jinja2 and the templates beside this file."""

from __future__ import annotations

import re
from base64 import b64encode
from itertools import count
from pathlib import Path
from typing import Any

from jinja2 import ChoiceLoader, Environment, FileSystemLoader, PackageLoader, StrictUndefined
from markupsafe import Markup, escape
from matplotlib.figure import Figure

from rti_mpcc.report import draw
from rti_mpcc.report.text import in_words, number, percent

_MARKED = re.compile(r"`([^`]*)`|(?<!\w)([A-Za-zθδ])_([A-Za-zθδ]+)(?:\^([a-z]+))?")
"""Code between backticks, or a letter with an index: q_c, θ_k, a_lat, q_N^e."""


def rendered(template: str, title: str, *folders: Path, **given: Any) -> str:
    """The page of a template that extends page.html, with what it is given; `folders`: of other templates."""
    environment = Environment(
        loader=ChoiceLoader([PackageLoader("rti_mpcc.report"), FileSystemLoader(folders)]),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters = (embedded, in_words, marked, number, percent, safe_json)
    environment.filters |= {one.__name__: one for one in filters}
    environment.globals["next"] = next
    counters = {"contents": [], "table_numbers": count(1), "figure_numbers": count(1)}
    return environment.get_template(template).render(title=title, **counters, **given).lstrip()


def embedded(picture: bytes | Figure) -> str:
    """A picture as an address that holds all of it."""
    data = draw.png(picture) if isinstance(picture, Figure) else picture
    return f"data:image/png;base64,{b64encode(data).decode('ascii')}"


def safe_json(data: str) -> Markup:
    """JSON as the text of a script element, which no string of it can end."""
    return Markup(data.replace("<", "\\u003c"))


def marked(text: object) -> Markup:
    """Escaped; what stands between backticks is code, elsewhere q_c and q_N^e are set as symbols."""
    return Markup(_MARKED.sub(_in_html, str(escape(text))))


def _in_html(found: re.Match[str]) -> str:
    code, base, below, above = found.groups()
    if code is not None:
        return f"<code>{code}</code>"
    return f"<i>{base}</i><sub>{below}</sub>" + (f"<sup>{above}</sup>" if above else "")
