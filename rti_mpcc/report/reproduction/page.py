"""Sections as one HTML file that needs nothing else: pictures are embedded, there are no scripts."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from html import escape
from itertools import count
from re import sub

from rti_mpcc.report.reproduction.content import Block, Paragraph, Picture, Section, Table

STYLE = """
body { font: 16px/1.5 Georgia, "Times New Roman", serif; color: #111; max-width: 62rem; margin: 2rem auto;
  padding: 0 1rem; }
h1, h2, nav, table, figcaption, caption { font-family: "Helvetica Neue", Arial, sans-serif; }
h2 { margin-top: 3rem; border-bottom: 1px solid #999; }
nav ol { columns: 2; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: 1rem 0; font-size: 0.82rem; }
caption { text-align: left; font-weight: bold; padding-bottom: 0.3rem; }
th, td { padding: 0.15rem 0.6rem; border-bottom: 1px solid #ccc; text-align: right; vertical-align: top; }
thead th { border-bottom: 2px solid #333; }
tbody th, .word { text-align: left; font-weight: normal; }
figure { margin: 1.5rem 0; }
img { max-width: 100%; height: auto; }
figcaption { font-size: 0.85rem; }
.verdict { border-left: 4px solid #0072b2; padding-left: 0.8rem; }
code { font-size: 0.9em; }
@media print {
  body { max-width: none; margin: 0; font-size: 10pt; }
  h2 { break-after: avoid; }
  table, figure { break-inside: avoid; }
  .wide { overflow: visible; }
  table { font-size: 7pt; }
  table.long { break-inside: auto; }
  a { color: inherit; text-decoration: none; }
}
"""
_LONG = 15
"""Tables with more rows may be broken over two pages."""


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
    rows = "\n".join(f"<tr>{_row(table, row)}</tr>" for row in table.rows)
    long = ' class="long"' if len(table.rows) > _LONG else ""
    caption = f"<caption>Table {number}. {_text(table.caption)}</caption>"
    return (
        f'<div class="wide"><table{long}>{caption}\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{rows}\n</tbody></table></div>"
    )


def _row(table: Table, row: Sequence[str]) -> str:
    name = f'<th scope="row">{_text(row[0])}</th>'
    cells = (f"<td{_kind(table, place)}>{_text(cell)}</td>" for place, cell in enumerate(row[1:], start=1))
    return name + "".join(cells)


def _kind(table: Table, column: int) -> str:
    return ' class="word"' if column == 0 or column in table.worded else ""


def _picture(picture: Picture, number: int) -> str:
    data = b64encode(picture.png).decode("ascii")
    return (
        f'<figure><img alt="{escape(picture.told)}" src="data:image/png;base64,{data}">\n'
        f"<figcaption>Figure {number}. {_text(picture.caption)}</figcaption></figure>"
    )


def _text(text: str) -> str:
    """Escaped, with code between backticks."""
    return sub(r"`([^`]*)`", r"<code>\1</code>", escape(text, quote=False))
