"""The formulas of the docs are rendered by the script, the styles and the fonts in docs/assets."""

from __future__ import annotations

import re
from html import escape
from pathlib import Path

import pytest

from benchmarks.pictures import BROWSER
from tests.rti_mpcc.report.pages import browsed

DOCS = Path(__file__).parents[2] / "docs"
ASSETS = DOCS / "assets"
FONTS_LEFT_OUT = {
    *("amsrm", "boldsymbol", "mathbb", "mathbf", "mathcal"),
    *("mathfrak", "mathscr", "mathsf", "mathtt", "texttt"),
}
"""Classes of formulas whose fonts are not in docs/assets."""


def formulas() -> list[str]:
    pages = (page.read_text(encoding="utf-8") for page in sorted(DOCS.rglob("*.md")))
    return [found for page in pages for found in re.findall(r"^```math\n(.*?)^```", page, re.S | re.M)]


@pytest.mark.skipif(BROWSER is None, reason="needs a browser")
def test_a_browser_renders_each_formula_and_its_labels(tmp_path: Path) -> None:
    written = formulas()
    blocks = "\n".join(f'<div class="arithmatex">\\[\n{escape(each)}\\]</div>' for each in written)
    scripts = "\n".join(
        f'<script src="{(ASSETS / name).as_uri()}"></script>'
        for name in ("katex/katex.min.js", "formulas.js")
    )
    page = tmp_path / "formulas.html"
    page.write_text(f'<!doctype html>\n<meta charset="utf-8">\n{blocks}\n{scripts}', encoding="utf-8")
    shown = browsed(page, tmp_path)  # an error of the script would be on its console
    assert shown.count('class="katex-html"') == len(written) > 20
    text = re.sub(r"<[^>]+>", "", shown)
    for label in (label for each in written for label in re.findall(r"\\tag\{(\w+)\}", each)):
        assert f"({label})" in text
    classes = {name for names in re.findall(r'class="([^"]*)"', shown) for name in names.split()}
    assert not classes & FONTS_LEFT_OUT
