"""Time that `McapLog` takes for a cycle of docking_inside, and the size of its file.

python -m benchmarks.measure_mcap
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from time import thread_time

import numpy as np

from rti_mpcc.recording import McapLog
from rti_mpcc.report.ride import Observer, ride_of_run
from rti_mpcc.simulation import driver_of, load_scenario, simulate


def main() -> int:
    """Print p50, p99 and the largest time [ms] of thread CPU, and the size."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    scenario = load_scenario("docking_inside")
    observer = Observer(driver_of(scenario))
    ride = ride_of_run(simulate(scenario, controller=observer), observer.moments)
    with tempfile.TemporaryDirectory() as folder:
        file, spent = Path(folder) / "ride.mcap", []
        with McapLog(file) as log:
            for moment in ride.moments:
                began = thread_time()
                log.write_moment(moment, ride.config)
                spent.append(1e3 * (thread_time() - began))
        size = file.stat().st_size
    p50, p99, most = np.percentile(spent, (50, 99, 100))
    seconds = ride.end - ride.moments[0].time
    sys.stdout.write(f"a cycle: p50 {p50:.3f} ms, p99 {p99:.3f} ms, max {most:.1f} ms\n")
    sys.stdout.write(f"{size / 1000:.0f} kB for {seconds:.0f} s\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
