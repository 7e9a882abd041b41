"""Tries the supported Pythons that this machine has, each in an environment of its own: `make pythons`.

    python -m benchmarks.pythons [--version 3.12 ...] [--jobs 2]

Looks for them on PATH and among pyenv's. Each gets the package with all that its tests need in runs/pythons,
docks by an example, and runs tests. Exit status: 0 all that were found passed, 1 one failed, or none was
found.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from time import monotonic

from benchmarks.tables import ROOT, command_line
from rti_mpcc.cli.arguments import integer

VERSIONS = ("3.11", "3.12", "3.13")
TESTS = (
    "tests/geometry",
    "tests/estimation",
    "tests/examples",
    "tests/inputs/test_arguments.py",
    "tests/rti_mpcc/recording",
)
"""Where another Python or numpy shows: annotations, arrays, pickles, a whole ride."""
FOLDER = ROOT / "runs" / "pythons"


def candidates(version: str) -> Iterator[Path]:
    """Files that may be this Python: on PATH, then pyenv's, the latest first."""
    if found := shutil.which(f"python{version}"):
        yield Path(found)
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    folders = (pyenv / "versions").glob(f"{version}.*")
    yield from (each / "bin" / "python" for each in sorted(folders, key=_number, reverse=True))


def _number(folder: Path) -> list[int]:
    return [int(part) for part in folder.name.split(".") if part.isdigit()]


def python_of(version: str) -> Path | None:
    """A file that runs as this Python; pyenv's shims may stand for one that is not chosen, and fail."""
    asking = "import sys; print('%d.%d' % sys.version_info[:2])"
    for each in candidates(version):
        done = subprocess.run([each, "-c", asking], capture_output=True, text=True)
        if done.returncode == 0 and done.stdout.strip() == version:
            return each
    return None


def steps(python: Path, jobs: int) -> dict[str, list[str]]:
    """What is tried with the Python of an environment: name -> command."""
    run = str(python)
    return {
        "install": [run, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "-e", ".[test]"],
        "compile": [run, "-m", "rti_mpcc", "warm"],
        "dock": [run, "examples/dock_with_python.py"],
        "test": [run, "-m", "pytest", "-q", "-n", str(jobs), "--dist", "loadfile", *TESTS],
    }


def tried(version: str, python: Path, jobs: int) -> str:
    """ "passed", or the step that failed."""
    folder = FOLDER / version
    subprocess.run([python, "-m", "venv", "--clear", folder], check=True)
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    for name, command in steps(folder / "bin" / "python", jobs).items():
        print(f"== Python {version}: {name}", flush=True)
        if subprocess.run(command, cwd=ROOT, env=environment).returncode:
            return f"failed: {name}"
    return "passed"


def main() -> int:
    parser = command_line(__doc__, "python -m benchmarks.pythons")
    parser.add_argument("--version", nargs="+", default=VERSIONS, help="only these; default: %(default)s")
    parser.add_argument("--jobs", type=integer(1), default=2, help="test processes; default: %(default)s")
    asked = parser.parse_args()
    results = {}
    for version in asked.version:
        python, begun = python_of(version), monotonic()
        if python is not None:
            results[version] = tried(version, python, asked.jobs)
        said = f"{results[version]}, {monotonic() - begun:.0f} s, {python}" if python else "not found"
        print(f"Python {version}: {said}", flush=True)
    return int(not results or any(result != "passed" for result in results.values()))


if __name__ == "__main__":
    sys.exit(main())
