"""Pages of the reproduction's report."""

from __future__ import annotations

import pytest

from benchmarks.reproduction.content import Picture, Section, Table, found, say
from benchmarks.reproduction.report import html_page
from tests.rti_mpcc.report.pages import parsed


def test_page_has_everything_in_one_file() -> None:
    table = Table(caption="Times <T>.", heads=["run", "T [s]"], rows=[["dynamic & others", "27.39"]])
    picture = Picture(name="one", png=b"\x89PNG", caption="A picture.", told='"told"')
    one = Section(name="first", title="`dynamic` alone", blocks=[say("a < b"), table, picture, found("so")])
    two = Section(name="second", title="Second", blocks=[table])
    page = html_page("Title", [one, two])
    parser = parsed(page)
    assert parser.fetched == ["#first", "#second", "data:image/png;base64,iVBORw=="]
    assert "<script" not in page
    for told in ("<code>dynamic</code> alone", "dynamic &amp; others", "a &lt; b", 'class="verdict">so'):
        assert told in page
    text = "".join(parser.text)
    for caption in ("Table 1. Times <T>.", "Table 2. Times <T>.", "Figure 1. A picture."):
        assert caption in text
    assert 'id="second"' in page


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("with q_c = 1", "with <i>q</i><sub>c</sub> = 1"),
        ("∫a_lat² and q_N^e", "∫<i>a</i><sub>lat</sub>² and <i>q</i><sub>N</sub><sup>e</sup>"),
        ("`q_c` of constant_50", "<code>q_c</code> of constant_50"),
        ("a ` alone", "a ` alone"),
    ],
)
def test_symbols_and_code_are_set_apart(text: str, shown: str) -> None:
    page = html_page("Title", [Section(name="one", title="One", blocks=[say(text)])])
    assert f"<p>{shown}</p>" in page


def test_rows_that_belong_together_are_ruled_off() -> None:
    table = Table(caption="", heads=["run"], rows=[["a"], ["b"], ["c"], ["d"]], group=2)
    page = html_page("Title", [Section(name="one", title="One", blocks=[table])])
    assert [row.partition(">")[0] for row in page.split("<tr")[2:]] == ["", ' class="last"'] * 2
