"""What the controller costs besides its cycles: import, construction and memory, each in fresh processes.

    python -m benchmarks.standing_costs LENGTH

drives a controller on a winding path of so many metres and prints its memory and times as JSON. It imports
what a program on the vehicle would, and nothing to measure with.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

ROOT = Path(__file__).parents[1]
CYCLES = 200
HALF_WIDTH = 2.5
WINDING = ((1, 0.05, 2.5), (1, -0.05, 5.0), (1, 0.05, 2.5))
UNWANTED = ("matplotlib", "filterpy")
IMPORT = """
from time import perf_counter
begun = perf_counter()
import rti_mpcc
rti_mpcc.DockingController
took = perf_counter() - begun
import json, sys
print(json.dumps({"seconds": took, "loaded": [name for name in NAMES if name in sys.modules]}))
"""


def resident() -> float:
    """Memory that this process holds [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


def fresh(*arguments: str) -> Any:
    """What a fresh interpreter prints as JSON. Raises RuntimeError with what it said if it fails."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, *arguments], env=environment, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(arguments)[:80]}: {done.stderr.strip()}")
    return json.loads(done.stdout)


def imported(times: int) -> dict[str, Any]:
    """Seconds of `import rti_mpcc` in so many fresh interpreters, and what of `UNWANTED` it loads."""
    runs = [fresh("-c", f"NAMES = {UNWANTED!r}\n{IMPORT}") for _ in range(times)]
    return {
        "seconds": [run["seconds"] for run in runs],
        "loaded": sorted({name for run in runs for name in run["loaded"]}),
    }


def standing(length: int, times: int) -> dict[str, list[float]]:
    """What `driven` gives in so many fresh interpreters, by name."""
    runs = [fresh("-m", "benchmarks.standing_costs", str(length)) for _ in range(times)]
    return {name: [run[name] for run in runs] for name in runs[0]}


def driven(length: int) -> dict[str, float]:
    """Seconds of construction, and memory [MB] after each step of it and after some cycles."""
    bare = resident()
    from geometry import Corridor, Pose2, ReferencePath
    from rti_mpcc import ControllerConfig, DockingController, VehicleState

    after_import, begun = resident(), perf_counter()
    segments = list(WINDING) * (length // 10)
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), segments)
    path_done = perf_counter()
    corridor = Corridor.from_offsets(path, left=HALF_WIDTH, right=-HALF_WIDTH)
    corridor_done, route = perf_counter(), resident()
    controller = DockingController(path, corridor, ControllerConfig(deadline=None))
    controller_done, built = perf_counter(), resident()
    start = path.parts[0].pose(10.0 * (length // 20))
    state = VehicleState(x=start.x, y=start.y, phi=start.phi, v=0.0, delta=0.0)
    for cycle in range(CYCLES):
        command = controller.step(state, now=cycle * controller.config.cycle)
        x, y, phi, v, delta, _ = command.trajectory.states[1].tolist()  # no dead time: it drives its plan
        state = VehicleState(x=x, y=y, phi=phi, v=v, delta=delta)
    return {
        "path_s": path_done - begun,
        "corridor_s": corridor_done - path_done,
        "controller_s": controller_done - corridor_done,
        "bare_mb": bare,
        "imported_mb": after_import,
        "route_mb": route,
        "built_mb": built,
        "running_mb": resident(),
    }


if __name__ == "__main__":
    print(json.dumps(driven(int(sys.argv[1]))))
