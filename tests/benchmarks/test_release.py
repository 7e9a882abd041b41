"""README on an index has no link that leads nowhere; a release has one version."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from benchmarks.pythons import python_of
from benchmarks.release import disagreements, for_index, unreleased, version_of
from benchmarks.tables import ROOT

URL = "https://example.org/us/rti-mpcc"
README = (ROOT / "README.md").read_text(encoding="utf-8")
TARGET = re.compile(r"\]\(([^)\s]+)\)")


def test_links_lead_to_the_files_of_the_tag() -> None:
    text = for_index(README, URL, "1.2.3")
    links = TARGET.findall(text)
    assert len(links) == len(TARGET.findall(README))
    for link in links:
        match = re.fullmatch(rf"{URL}/(blob|raw)/v1\.2\.3/([^#]+)(#.+)?", link)
        assert match, link
        assert (ROOT / match[2]).exists(), link
    assert f"![Reversing past two narrowings into a goal behind the path end]({URL}/raw/v1.2.3/docs/" in text


def test_without_an_address_the_words_stay_and_the_pictures_go() -> None:
    text = for_index(README, "", "1.2.3")
    assert TARGET.findall(text) == []
    assert "![" not in text
    assert "Made by" not in text
    assert "docs/using.md" in text
    assert re.findall(r"```.*?```", text, flags=re.DOTALL) == re.findall(
        r"```.*?```", README, flags=re.DOTALL
    )


def test_anchors_and_addresses_of_the_web_stay() -> None:
    text = "[a](#limits), [b](https://example.com/x.md), [c](docs/using.md#install)\n"
    kept = "[a](#limits), [b](https://example.com/x.md), "
    assert for_index(text, "", "1") == f"{kept}c\n"
    assert for_index(text, URL, "1") == f"{kept}[c]({URL}/blob/v1/docs/using.md#install)\n"


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for name in ("pyproject.toml", "CHANGELOG.md", "CITATION.cff"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def test_all_name_one_version(tree: Path) -> None:
    assert disagreements(tree, [f"v{version_of(tree)}", "measured"]) == []


def test_what_is_not_released_yet_is_told(tree: Path) -> None:
    changelog = tree / "CHANGELOG.md"
    changelog.write_text("## [Unreleased]\n\n### Changed\n\n- One.\n\n## [0.1.0] - 2026-11-21\n\n- Two.\n")
    assert unreleased(tree) == ["- One."]


@pytest.mark.parametrize("file", ["pyproject.toml", "CHANGELOG.md", "CITATION.cff"])
def test_another_version_is_named(tree: Path, file: str) -> None:
    version, text = version_of(tree), (tree / file).read_text(encoding="utf-8")
    (tree / file).write_text(text.replace(version, "9.9.9"), encoding="utf-8")
    assert any("9.9.9" in line and version in line for line in disagreements(tree, []))


def test_another_tag_is_named(tree: Path) -> None:
    assert disagreements(tree, ["v0.0.1"]) == [f"tag of HEAD: v0.0.1, expected v{version_of(tree)}"]


def test_a_python_is_one_that_runs_as_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path / "shims"))
    monkeypatch.setenv("PYENV_ROOT", str(tmp_path))
    for file, says in (("shims/python3.12", "exit 127"), ("versions/3.12.1/bin/python", "echo 3.12")):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).write_text(f"#!/bin/sh\n{says}\n", encoding="ascii")
        (tmp_path / file).chmod(0o755)
    assert python_of("3.12") == tmp_path / "versions/3.12.1/bin/python"
    assert python_of("3.13") is None
