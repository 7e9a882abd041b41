"""Builds wheel and sdist of HEAD into dist/ and checks them for a package index: `make dist`.

    python -m benchmarks.release [--url https://HOST/OWNER/rti-mpcc]

Version, changelog and CITATION.cff have to agree, nothing may be unreleased, and a tag of HEAD has to be
theirs. An index shows README without the files that it links to: with --url (or PROJECT_URL) its links lead
to the files of the tag there; without, their words stay, and pictures are left out. Nothing is uploaded.
Exit status: 0 built, 1 refused.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

from benchmarks.compare_speed import files_of
from benchmarks.tables import ROOT, command_line, git

FENCE = re.compile(r"(^```.*?^```\n)", flags=re.DOTALL | re.MULTILINE)
LOCAL = r"\((?!https?:|#)(?P<path>[^)#\s]*)(?P<anchor>#[^)\s]*)?\)"
"""The target of a link to a file, in brackets."""
PICTURE = re.compile(
    rf"!\[(?P<words>[^\]]*)\]{LOCAL}\n*(?:<!-- begin (?P<block>\w+) -->.*?<!-- end (?P=block) -->\n*)?",
    re.DOTALL,
)
"""A picture, and the block below it that says how it was made."""
LINK = re.compile(rf"(?<!!)\[(?P<words>[^\]]*)\]{LOCAL}")
URLS = """[project.urls]
Source = "{url}"
Changelog = "{url}/blob/v{version}/CHANGELOG.md"

"""


def for_index(readme: str, url: str, version: str) -> str:
    """README with links that do not need the files next to it."""
    parts = FENCE.split(readme)
    for i in range(0, len(parts), 2):  # the others are code
        if url:
            parts[i] = re.sub(rf"(!\[[^\]]*\]){LOCAL}", rf"\1({url}/raw/v{version}/\g<path>)", parts[i])
            parts[i] = LINK.sub(rf"[\g<words>]({url}/blob/v{version}/\g<path>\g<anchor>)", parts[i])
        else:
            parts[i] = LINK.sub(r"\g<words>", PICTURE.sub("", parts[i]))
    return "".join(parts)


def version_of(tree: Path) -> str:
    """The version of pyproject.toml."""
    project = tomllib.loads((tree / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return str(project["version"])


def disagreements(tree: Path, tags: list[str]) -> list[str]:
    """Where a version is another one than that of pyproject.toml."""
    version = version_of(tree)
    changelog = (tree / "CHANGELOG.md").read_text(encoding="utf-8")
    citation = (tree / "CITATION.cff").read_text(encoding="utf-8")
    released = re.search(r"^## \[(\d\S*)\] - (\S+)$", changelog, flags=re.MULTILINE)
    cited = re.search(r"^version: (\S+)$", citation, flags=re.MULTILINE)
    dated = re.search(r"^date-released: (\S+)$", citation, flags=re.MULTILINE)
    found = [
        ("latest release in CHANGELOG.md", released and released[1], version),
        ("version in CITATION.cff", cited and cited[1], version),
        ("date in CITATION.cff", dated and dated[1], released and released[2]),
        *(("tag of HEAD", tag, f"v{version}") for tag in tags if re.match(r"v\d", tag)),
    ]
    return [f"{name}: {value}, expected {wanted}" for name, value, wanted in found if value != wanted]


def unreleased(tree: Path) -> list[str]:
    """What CHANGELOG.md has under [Unreleased]."""
    changelog = (tree / "CHANGELOG.md").read_text(encoding="utf-8")
    _, _, pending = changelog.partition("## [Unreleased]")
    return re.findall(r"^- .*", pending.partition("\n## ")[0], flags=re.MULTILINE)


def build(tree: Path, out: Path, url: str) -> None:
    """Wheel and sdist of a tree, whose README is changed."""
    version, readme, project = version_of(tree), tree / "README.md", tree / "pyproject.toml"
    readme.write_text(for_index(readme.read_text(encoding="utf-8"), url, version), encoding="utf-8")
    if url:
        text = project.read_text(encoding="utf-8")
        urls = URLS.format(url=url, version=version)
        project.write_text(text.replace("[project.scripts]", f"{urls}[project.scripts]"), encoding="utf-8")
    shutil.rmtree(out, ignore_errors=True)
    subprocess.run([sys.executable, "-m", "build", "--outdir", out, tree], check=True)
    subprocess.run([sys.executable, "-m", "twine", "check", "--strict", *sorted(out.iterdir())], check=True)


def main() -> int:
    parser = command_line(__doc__, "python -m benchmarks.release")
    parser.add_argument(
        "--url", default=os.environ.get("PROJECT_URL", ""), help="of the repository; default: PROJECT_URL"
    )
    url = str(parser.parse_args().url).rstrip("/")
    tags = (git("tag", "--points-at", "HEAD") or "").split()
    with files_of("HEAD") as tree:
        if wrong := [*disagreements(tree, tags), *(f"unreleased: {line}" for line in unreleased(tree))]:
            print("\n".join(wrong), file=sys.stderr)
            return 1
        if f"v{version_of(tree)}" not in tags:
            print(f"HEAD has no tag v{version_of(tree)} yet: whoever publishes sets it", file=sys.stderr)
        if not url:
            print("no --url: README on the index has no links and pictures", file=sys.stderr)
        build(tree, ROOT / "dist", url)
    return 0


if __name__ == "__main__":
    sys.exit(main())
