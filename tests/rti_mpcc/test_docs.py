"""What the documents say of the code is there: labels, names, files, links, the constants."""

from __future__ import annotations

import ast
import pkgutil
import re
import shlex
import tomllib
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

import pytest

import rti_mpcc
from benchmarks.measure_deviations import PAGES
from benchmarks.measure_results import constant_rows
from benchmarks.tables import table
from benchmarks.variations import VARIATIONS
from rti_mpcc.cli import main
from rti_mpcc.mission.step import STEPS
from rti_mpcc.report.files import TRAJECTORY
from rti_mpcc.simulation import builtin_names, load_scenario, simulate, summary
from rti_mpcc.simulation.sections.mission import StepSection, table_of
from rti_mpcc.types import Reason

ROOT = Path(__file__).parents[2]
PACKAGES = ("geometry", "estimation", "rti_mpcc")
CODE = (*PACKAGES, "benchmarks", "tests", "examples")
PAGES_OF_LABELS = [ROOT / "docs" / "method.md", *sorted((ROOT / "docs" / "decisions").glob("*.md"))]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
LINKING = [ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md", *DOCUMENTS]
LABEL = re.compile(r"\(([A-Z]\d{1,2})\)")
DEFINED = re.compile(r"(?:^ *\(|\\tag\{)([A-Z]\d{1,2})(?:\) {2}\S|\})", flags=re.MULTILINE)
"""A label at the start of a line, with its formula after two spaces, or the label of a rendered formula."""


DOTTED = r"(?:geometry|estimation|rti_mpcc)(?:\.(?!py`|md`)\w+)+"
"""A full name of the code; what is listed behind it and a colon are its members."""
PENDING: tuple[str, ...] = ()
"""Named already, and being written."""


def sources(*packages: str) -> Iterator[Path]:
    for package in packages:
        yield from sorted((ROOT / package).rglob("*.py"))


def docstrings(file: Path) -> str:
    """Those of a module and of its classes and functions."""
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    nodes = (
        node for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if isinstance(node, kinds)
    )
    return "\n".join(ast.get_docstring(node) or "" for node in nodes)


def in_documents() -> Counter[str]:
    """How often each label is defined in method.md and the decisions."""
    return Counter(
        label for page in PAGES_OF_LABELS for label in DEFINED.findall(page.read_text(encoding="utf-8"))
    )


def anchors(page: Path) -> set[str]:
    """What GitHub makes of the headings of a page."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    headings = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def test_each_label_is_defined_where_it_can_be_found() -> None:
    in_code = {file: set(DEFINED.findall(docstrings(file))) for file in sources(*PACKAGES)}
    defined = set(in_documents()).union(*in_code.values())
    used = {label for file in sources(*CODE) for label in LABEL.findall(file.read_text(encoding="utf-8"))}
    assert {"M1", "F1", "H4", "O4", "T1", "P2", "E3", "K1"} <= used
    assert used <= defined
    assert set(in_documents()) <= used
    for page in DOCUMENTS:
        assert set(LABEL.findall(page.read_text(encoding="utf-8"))) <= defined, page


def test_the_keys_of_each_step_are_those_of_the_code() -> None:
    page = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `(\w+)` \|(.*)\|(.*)\|$", page, flags=re.MULTILINE)
    told = {kind: [tuple(re.findall(r"`(\w+)`", cell)) for cell in cells] for kind, *cells in rows}
    for kind in STEPS:
        section = table_of(kind)
        keys = {n: f for n, f in section.model_fields.items() if n not in {"kind", *StepSection.model_fields}}
        assert told[kind] == [
            tuple(n for n, f in keys.items() if f.is_required() is needed) for needed in (True, False)
        ]


def test_no_label_is_defined_twice_in_the_documents() -> None:
    assert [label for label, times in in_documents().items() if times > 1] == []


def test_each_letter_of_a_deviation_is_on_one_page() -> None:
    index = (ROOT / "docs" / "decisions" / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| \[\d+\]\((.+?)\) \| .* \| ([a-w, ]*)\|$", index, flags=re.MULTILINE)
    assert [page for page, _ in rows] == [
        page.name for page in PAGES_OF_LABELS[1:] if page.name != "README.md"
    ]
    letters = [letter for _, listed in rows for letter in re.findall(r"[a-w]", listed)]
    assert sorted(letters) == list("abcdefghijklmnoprstuvw")  # (q) is given up
    assert {each.letter for each in VARIATIONS} == set("".join(PAGES.values()))
    listed = dict(rows)
    for page, written in PAGES.items():
        assert "<!-- begin deviations -->" in (ROOT / "docs" / "decisions" / page).read_text(encoding="utf-8")
        assert set(written) <= set(re.findall(r"[a-w]", listed[page])), page


def test_the_table_of_constants_is_that_of_the_code() -> None:
    page = (ROOT / "docs" / "decisions" / "04-solver-settings.md").read_text(encoding="utf-8")
    rows = table(["constant", "where", "value"], constant_rows())
    assert f"<!-- begin constants -->\n{rows}\n<!-- end constants -->" in page


@pytest.mark.parametrize(("page", "lines"), [("README.md", 150), ("docs/method.md", 250)])
def test_what_is_read_first_is_short(page: str, lines: int) -> None:
    """Its formulas do not count: their sources are not read."""
    text = re.sub(r"```math\n.*?```\n", "", (ROOT / page).read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(text.splitlines()) <= lines


@pytest.mark.parametrize("page", DOCUMENTS, ids=name)
def test_blocks_end_where_they_begin(page: Path) -> None:
    marks = re.findall(r"^<!-- (begin|end) (\w+) -->$", page.read_text(encoding="utf-8"), flags=re.MULTILINE)
    begun, ended = marks[::2], marks[1::2]
    assert [("begin", block) for _, block in ended] == begun
    assert [("end", block) for _, block in begun] == ended
    assert len(set(begun)) == len(begun)


@pytest.mark.parametrize("page", LINKING, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if link.startswith("http"):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if name(target) in PENDING and not target.exists():
            continue
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", DOCUMENTS, ids=name)
def test_names_and_files_of_the_code_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for found, listed in re.findall(rf"`({DOTTED})`(?:: ((?:`[\w.]+`(?:, )?)+))?", text):
        pkgutil.resolve_name(found)
        for member in re.findall(r"`([\w.]+)`", listed):
            pkgutil.resolve_name(f"{found}.{member}")
    for found in re.findall(r"`((?:geometry|estimation|rti_mpcc|tests|benchmarks)/[\w./]*)`", text):
        assert (ROOT / found).exists() or found in PENDING, found


def classes() -> dict[str, list[type]]:
    """All classes of the packages by name."""
    found: dict[str, list[type]] = {}
    for package in PACKAGES:
        for module in pkgutil.walk_packages([str(ROOT / package)], f"{package}."):
            for name, value in vars(import_module(module.name)).items():
                if isinstance(value, type):
                    found.setdefault(name, []).append(value)
    return found


def test_attributes_of_classes_exist() -> None:
    known = classes()
    for page in DOCUMENTS:
        for name, attribute in re.findall(r"`([A-Z]\w+)\.(\w+)", page.read_text(encoding="utf-8")):
            fields = [{*dir(each), *getattr(each, "model_fields", ())} for each in known.get(name, ())]
            assert any(attribute in each for each in fields), f"{page.name}: {name}.{attribute}"


LEFT_BEHIND = re.compile(
    r"\b(begun|begins? anew|the begin|told|gone on with|mended|made for|in vain|so many|so long"
    r"|moving picture|comes out so|another way|the way that|who stands|what stands|what fills|no way"
    r"|plans way|looks soon)\b",
    flags=re.IGNORECASE,
)
"""Words that have a better one: one word for one thing, the field's."""


@pytest.mark.parametrize("page", DOCUMENTS, ids=name)
def test_pages_use_the_words_of_the_field(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert LEFT_BEHIND.findall(text) == []


def test_reasons_and_scenarios_do_too() -> None:
    texts = [f"{reason.value} {reason.message}" for reason in Reason]
    texts += [load_scenario(name).description for name in builtin_names()]
    assert [text for text in texts if LEFT_BEHIND.findall(text)] == []


def test_all_that_a_ride_is_written_as_and_all_public_names_are_documented() -> None:
    files, reference = (ROOT.joinpath("docs", page).read_text() for page in ("files.md", "reference.md"))
    figures = {*TRAJECTORY, *summary(simulate(load_scenario("bay_perpendicular")))}
    assert {name for name in figures if f"`{name}`" not in files} == set()
    listed = re.findall(r"^::: .*?(\w+)$", reference, flags=re.MULTILINE)
    assert {*rti_mpcc.__all__} - {*listed} == {"__version__"}


@pytest.mark.parametrize("page", DOCUMENTS, ids=name)
def test_commands_and_blocks_can_be_typed(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = page.read_text(encoding="utf-8")
    monkeypatch.setattr("rti_mpcc.cli.exit_status", lambda parser, argv: 0 if parser.parse_args(argv) else 1)
    for line in re.findall(r"^ *(?:\$ )?rti-mpcc ((?!is )[a-z-].*)$", text, flags=re.MULTILINE):
        assert main(shlex.split(line, comments=True)) == 0, line
    for kind, read in (("toml", tomllib.loads), ("python", ast.parse)):
        for block in re.findall(rf"^```{kind}\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE):
            read(block)


def test_the_help_of_each_command_does_too(capsys: pytest.CaptureFixture[str]) -> None:
    main(["--help"])
    commands = re.findall(r"^    (\w+) ", capsys.readouterr().out, flags=re.MULTILINE)
    assert {"run", "campaign", "warm"} < set(commands)
    for command in ("", *commands):
        main([*command.split(), "--help"])
        assert LEFT_BEHIND.findall(capsys.readouterr().out) == [], command
