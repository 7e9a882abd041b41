"""The Python code of README.md runs as typed, block after block, and docks."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"


def test_the_python_blocks_run_as_typed_and_dock(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(blocks) == 5
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, str(README), "exec"), names)
    known, expected, comfort, detected, replayed = capsys.readouterr().out.splitlines()
    assert known.startswith("docked after")
    assert expected == "docks after about 26.6 s"
    assert comfort.startswith("Comfort(acceleration=0.206")
    assert detected.startswith(("docked 0.0", "docked -0.0"))
    assert replayed == "identical"
