"""Drives scenarios and prints the time of each cycle but the first ones as JSON [ms]; run by compare_speed.

Run as a file, with the tree to be timed on PYTHONPATH: it imports no more than any version of this one has.
"""

from __future__ import annotations

import json
import sys

from rti_mpcc.simulation import load_scenario, simulate


def main() -> None:
    drives = (simulate(load_scenario(name)) for name in sys.argv[1:])
    print(json.dumps([ms for drive in drives for ms in drive.cycles.step_ms[1:].tolist()]))


if __name__ == "__main__":
    main()
