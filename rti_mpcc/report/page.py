"""Sections as one HTML file that needs nothing else: pictures are embedded, there are no scripts."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from html import escape
from itertools import count

from rti_mpcc.report.content import Block, Paragraph, Picture, Section, Table

STYLE = """
body { font: 16px/1.5 Georgia, "Times New Roman", serif; color: #111; max-width: 66rem; margin: 2rem auto;
  padding: 0 1rem; }
h1, h2, nav, table, .caption { font-family: "Helvetica Neue", Arial, sans-serif; }
h1, h2 { line-height: 1.25; }
h2 { margin-top: 3rem; border-bottom: 1px solid #999; }
nav ol { columns: 20rem 2; }
.wide { overflow-x: auto; margin-bottom: 1.5rem; }
table { border-collapse: collapse; font-size: 0.82rem; font-variant-numeric: tabular-nums; }
th, td { padding: 0.15rem 0.5rem; border-bottom: 1px solid #ccc; text-align: right; vertical-align: top; }
thead th { border-bottom: 2px solid #333; vertical-align: bottom; }
tbody th { font-weight: normal; }
tbody th, td { white-space: nowrap; }
tbody th, .word { text-align: left; }
td.told { min-width: 7rem; white-space: normal; }
.last th, .last td { border-bottom: 1px solid #333; }
figure { margin: 1.5rem 0; }
img { max-width: 100%; height: auto; }
.caption { font-size: 0.85rem; margin: 1.5rem 0 0.4rem; }
figcaption.caption { margin-top: 0.4rem; }
.verdict { border-left: 4px solid #0072b2; padding-left: 0.8rem; }
code { font-size: 0.9em; }
sub, sup { line-height: 0; }
@media print {
  body { max-width: none; margin: 0; padding: 0; font-size: 10pt; }
  h2, p.caption { break-after: avoid; }
  table, figure { break-inside: avoid; }
  .wide { overflow: visible; }
  .caption { font-size: 8.5pt; }
  table { font-size: 7pt; }
  th, td { padding: 0.1rem 0.25rem; }
  td.told { min-width: 4rem; }
  table.long { break-inside: auto; }
  tr { break-inside: avoid; }
  a { color: inherit; text-decoration: none; }
}
"""
_LONG = 15
"""Tables with more rows may be broken over two pages."""
_SYMBOL = re.compile(r"(?<!\w)([A-Za-zθδ])_([A-Za-zθδ]+)(?:\^([a-z]+))?")
"""A letter with an index: q_c, θ_k, a_lat, q_N^e."""


def html_page(title: str, sections: Sequence[Section]) -> str:
    """The whole page: title, table of contents, sections. Tables and figures are numbered in order."""
    numbers = {Table: count(1), Picture: count(1)}
    listed = "\n".join(
        f'<li><a href="#{escape(section.name)}">{_text(section.title)}</a></li>' for section in sections
    )
    body = "\n".join(_section(section, place, numbers) for place, section in enumerate(sections, start=1))
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escape(title)}</title>
<style>{STYLE}</style>
</head>
<body>
<h1>{escape(title)}</h1>
<nav aria-label="Contents">
<h2>Contents</h2>
<ol>
{listed}
</ol>
</nav>
{body}
</body>
</html>
"""


def _section(section: Section, place: int, numbers: dict[type, count[int]]) -> str:
    blocks = "\n".join(_block(block, numbers) for block in section.blocks)
    head = f"<h2>{place}. {_text(section.title)}</h2>"
    return f'<section id="{escape(section.name)}">\n{head}\n{blocks}\n</section>'


def _block(block: Block, numbers: dict[type, count[int]]) -> str:
    if isinstance(block, Paragraph):
        kind = ' class="verdict"' if block.verdict else ""
        return f"<p{kind}>{_text(block.text)}</p>"
    number = next(numbers[type(block)])
    return _table(block, number) if isinstance(block, Table) else _picture(block, number)


def _table(table: Table, number: int) -> str:
    heads = "".join(
        f'<th scope="col"{_kind(table, place)}>{_text(head)}</th>' for place, head in enumerate(table.heads)
    )
    rows = "\n".join(
        f"<tr{_group_end(table, place)}>{_row(table, row)}</tr>" for place, row in enumerate(table.rows, 1)
    )
    long = ' class="long"' if len(table.rows) > _LONG else ""
    # Not a <caption>: that is as wide as its table, and where the table is scrolled it would be cut.
    caption = f'<p class="caption" id="table-{number}"><b>Table {number}.</b> {_text(table.caption)}</p>'
    return (
        f'{caption}\n<div class="wide" tabindex="0"><table{long} aria-labelledby="table-{number}">\n'
        f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}\n</tbody></table></div>"
    )


def _row(table: Table, row: Sequence[str]) -> str:
    name = f'<th scope="row"{_kind(table, 0)}>{_text(row[0])}</th>'
    cells = (f"<td{_kind(table, place)}>{_text(cell)}</td>" for place, cell in enumerate(row[1:], start=1))
    return name + "".join(cells)


def _group_end(table: Table, place: int) -> str:
    return ' class="last"' if table.group and place % table.group == 0 else ""


def _kind(table: Table, column: int) -> str:
    if column in table.sentences:
        return ' class="word told"'
    return ' class="word"' if column == 0 or column in table.worded else ""


def _picture(picture: Picture, number: int) -> str:
    data = b64encode(picture.png).decode("ascii")
    return (
        f'<figure><img alt="{escape(picture.told)}" src="data:image/png;base64,{data}">\n'
        f'<figcaption class="caption"><b>Figure {number}.</b> {_text(picture.caption)}</figcaption></figure>'
    )


def _text(text: str) -> str:
    """Escaped; what stands between backticks is code, elsewhere q_c and q_N^e are set as symbols."""
    parts = escape(text, quote=False).split("`")
    if len(parts) % 2 == 0:  # a backtick without its other one is a backtick
        parts[-2:] = ["`".join(parts[-2:])]
    return "".join(
        f"<code>{part}</code>" if place % 2 else _SYMBOL.sub(_symbol, part)
        for place, part in enumerate(parts)
    )


def _symbol(found: re.Match[str]) -> str:
    base, below, above = found.groups()
    return f"<i>{base}</i><sub>{below}</sub>" + (f"<sup>{above}</sup>" if above else "")
