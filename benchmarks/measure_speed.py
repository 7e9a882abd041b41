"""How fast a cycle is, by what it grows, and how exact its first control is; `make bench`.

    OMP_NUM_THREADS=1 python -m benchmarks.measure_speed [--quick] [--docs] [--rounds 3]

Feeds fresh controllers with the recorded inputs of all built-in scenarios, round after round, and measures a
yardstick between them that tells how fast this machine is just then. Prints the tables and writes
runs/bench.json; with `--docs` also docs/performance.json, and some of the tables and the picture of
docs/performance.md. `--quick` tries out all of it on a little of the workload: its figures mean nothing. Exit
status 1 if a target is not met.
"""

from __future__ import annotations

import argparse
import os
import sys
from importlib.metadata import version
from typing import Any

from benchmarks.figures import Target, target_table
from benchmarks.measured import QUICK, Extent, Measured, measure
from benchmarks.speed_tables import blocks, draw, numbers
from benchmarks.speed_targets import targets
from benchmarks.tables import ROOT, command_line, named, origin, replace_block, told, write_json
from rti_mpcc.cli.arguments import integer
from rti_mpcc.simulation import builtin_names

COMMAND = "python -m benchmarks.measure_speed"
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def parsed() -> argparse.Namespace:
    parser = command_line(__doc__, COMMAND)
    parser.add_argument("--quick", action="store_true", help="try out all of it on a little of the workload")
    parser.add_argument("--docs", action="store_true", help="write docs/performance.md and its picture")
    parser.add_argument("--rounds", type=integer(1), default=3, help="that are judged; default: %(default)s")
    return parser.parse_args()


def written(found: Measured, judged: list[Target], asked: argparse.Namespace, source: dict[str, Any]) -> None:
    """The figures in JSON, and with `--docs` in the document."""
    content = {"origin": source, "targets": [one.told() for one in judged], **numbers(found)}
    (ROOT / "runs").mkdir(exist_ok=True)
    write_json(ROOT / "runs" / "bench.json", content)
    if not asked.docs:
        return
    write_json(ROOT / "docs" / "performance.json", content)
    draw(found.sweeps, found.sweep_yardstick.p50, ROOT / "docs" / "pictures" / "performance.png")
    document = ROOT / "docs" / "performance.md"
    replace_block(document, "performance", f"*{named(source, 'Made')}*")
    replace_block(document, "targets", f"{target_table(judged)}\n\n{told(source)}")
    for name, text in blocks(found).items():
        replace_block(document, name, f"{text}\n\n{named(source)}")


def main() -> int:
    asked = parsed()
    for name in ONE_THREAD:
        if os.environ.get(name) != "1":
            raise SystemExit(
                f"{name} = {os.environ.get(name)}: must be 1, the figures are those of one thread"
            )
    extent = QUICK if asked.quick else Extent(scenarios=tuple(builtin_names()), rounds=asked.rounds)
    command = f"{COMMAND} --quick" if asked.quick else f"{COMMAND} --rounds {extent.rounds}"
    source = {**origin(command), "piqp": version("piqp")}
    found = measure(extent)
    judged = targets(found)
    for name, text in blocks(found).items():
        print(f"\n{name}\n{text}")
    print(f"\ntargets\n{target_table(judged)}\n\n{told(source)}")
    written(found, judged, asked, source)
    return int(not all(one.met for one in judged))


if __name__ == "__main__":
    sys.exit(main())
