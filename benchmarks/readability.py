"""How easily README and docs read: Flesch reading ease and words a sentence, the hardest pages first.

    python -m venv own && own/bin/pip install 'textstat<0.7.4' 'setuptools<80'
    own/bin/python benchmarks/readability.py [FOLDER]

Prose alone counts: no code, tables, formulas or names of code.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

NOT_PROSE = (
    r"<!-- begin.*?<!-- end .*?-->",
    r"```.*?```",
    r"^\s*(\||#|!|:::|    ).*?$",
    r"\]\([^)]*\)",
    r"[*_\[]",
)
FEWEST = 60
"""Words of a page that is judged."""


def prose(page: Path) -> str:
    """What is read as sentences."""
    text = page.read_text(encoding="utf-8")
    for pattern in NOT_PROSE:
        text = re.sub(pattern, "", text, flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"`[^`]*`", "name", text)


def main(root: Path) -> None:
    import textstat  # type: ignore[import-not-found, unused-ignore]

    pages = [root / "README.md", *sorted((root / "docs").rglob("*.md"))]
    texts = {page.relative_to(root): text for page in pages if len((text := prose(page)).split()) >= FEWEST}
    rows = [(textstat.flesch_reading_ease(t), textstat.avg_sentence_length(t), p) for p, t in texts.items()]
    for ease, words, page in sorted(rows):
        print(f"{ease:5.1f} {words:5.1f}  {page}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "."))
