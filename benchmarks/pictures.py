"""Makes the pictures of README and docs by the commands that stand below them.

    python -m benchmarks.pictures [NAME ...]

Each command writes into runs/; the picture goes to docs/pictures, and command and commit below it. A picture
of a page needs chromium; without it that picture stays. docs/pictures/performance.png is from `make bench`.
"""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PIL import Image

from benchmarks.tables import ROOT, command_line, named, origin, replace_block

FOLDER = ROOT / "docs" / "pictures"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next(filter(None, map(shutil.which, BROWSERS)), None)
"""The first of them that this machine has."""
WINDOW = (1400, 860)
"""Of a page [pixels]."""
MOST_PIXELS = 800
"""Width of a photograph."""
REPRODUCTION = "python -m benchmarks.reproduction --courses 0"


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture of a document.

    Attributes:
        name: file in docs/pictures, and the block of the document below it.
        page: the document; command: that makes the picture.
        source: what it writes, relative to the root; part: of a page, as its address names it.
    """

    name: str
    page: str
    command: str
    source: str
    part: str = ""

    @property
    def block(self) -> str:
        """Name of the block."""
        return Path(self.name).stem

    def write(self) -> bool:
        """The file in docs/pictures; False if there is no browser for it."""
        source, target = ROOT / self.source, FOLDER / self.name
        if source.suffix == ".html":
            return photographed(f"{source.as_uri()}#{self.part}", target)
        if target.suffix == ".jpg":
            with Image.open(source) as image:
                image.thumbnail((MOST_PIXELS, MOST_PIXELS))
                image.convert("RGB").save(target, quality=85)
        else:
            shutil.copyfile(source, target)
        return True


PICTURES = (
    Picture(
        "docking_behind.png",
        "README.md",
        "rti-mpcc run docking_behind",
        "runs/docking_behind/overview.png",
    ),
    Picture(
        "bay_perpendicular_plan.png",
        "README.md",
        "rti-mpcc plan bay_perpendicular",
        "runs/bay_perpendicular/plan.png",
    ),
    Picture(
        "paper_printed_docking_inside.png",
        "docs/decisions/07-paper-presets.md",
        "rti-mpcc run docking_inside --preset paper_printed",
        "runs/docking_inside/overview.png",
    ),
    Picture(
        "docking_noisy_timeline.png",
        "docs/results.md",
        "rti-mpcc run docking_noisy --seed 3",
        "runs/docking_noisy/timeline.png",
    ),
    Picture(
        "page.png",
        "docs/command-line.md",
        "rti-mpcc run docking_noisy --seed 3 --page",
        "runs/docking_noisy/page.html",
        "cycle=660",
    ),
    Picture("docks.png", "docs/docks.md", "rti-mpcc docks examples/docks.toml", "runs/docks/docks.png"),
    Picture(
        "charuco_docking.jpg",
        "docs/using.md",
        "python examples/charuco_docking.py",
        "runs/charuco_docking/last.png",
    ),
    Picture("comfort_front.png", "docs/results.md", REPRODUCTION, "runs/reproduce/comfort_front.png"),
    Picture("docking_mission.png", "docs/missions.md", REPRODUCTION, "runs/reproduce/mission_over_time.png"),
)


def photographed(address: str, target: Path) -> bool:
    """A page as a browser shows it; False if there is no browser."""
    if BROWSER is None:
        return False
    size = ",".join(map(str, WINDOW))
    options = "--hide-scrollbars", "--virtual-time-budget=5000", f"--window-size={size}"
    browser(*options, f"--screenshot={target}", address)
    return True


def browser(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the browser without a window, at most two minutes. Raises CalledProcessError if it fails."""
    assert BROWSER is not None
    command = [BROWSER, "--headless", "--no-sandbox", *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=120)


def run(command: str) -> int:
    """Run a command of the documents with this interpreter and these files; returns its exit status."""
    program, *arguments = shlex.split(command)
    module = ["-m", "rti_mpcc"] if program == "rti-mpcc" else []
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg"}
    return subprocess.run([sys.executable, *module, *arguments], cwd=ROOT, env=environment).returncode


def make(pictures: Sequence[Picture]) -> list[str]:
    """Make the pictures; returns what failed."""
    failed, before = [], ""
    for picture in pictures:
        source = origin(picture.command)
        if picture.command != before and run(picture.command):
            failed.append(picture.name)
            continue
        before = picture.command
        if not picture.write():
            print(f"{picture.name}: no browser ({', '.join(BROWSERS)}); it stays as it is")
            continue
        text = f"*{named(source, 'Made')[:-1]}: {Path(picture.source).name}.*"
        replace_block(ROOT / picture.page, picture.block, text)
    return failed


def main() -> int:
    parser = command_line(__doc__, "python -m benchmarks.pictures")
    parser.add_argument("names", nargs="*", metavar="NAME", help="only pictures with NAME in their names")
    names = parser.parse_args().names or [""]
    failed = make([each for each in PICTURES if any(name in each.name for name in names)])
    print(f"failed: {', '.join(failed) or 'none'}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
