"""Base libraries are enough for a control loop; where an extra is missing, one sentence names it."""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from importlib.metadata import packages_distributions
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.lists import some_of
from tests.processes import ROOT, fresh
from tests.rti_mpcc.test_layers import PACKAGES, imported, module_name, sources

BASE = ("rti_mpcc", "rti_mpcc.mission", "rti_mpcc.recording", "rti_mpcc.simulation")
"""What a control loop imports, and the plant and the closed loop that stand for a vehicle."""
SIM = ("rti_mpcc.report", "rti_mpcc.cli")
"""Packages that say which extra is missing when they are imported."""
PART_OF = {"pydantic_core": "pydantic", "markupsafe": "jinja2"}
"""Imported libraries that come with another one, in the version that it needs."""
REFUSED = (
    *("matplotlib", "pandas", "rich", "tomlkit", "joblib"),
    *("cv2", "mcap", "mcap_protobuf", "foxglove_schemas_protobuf", "distributed", "dask"),
)
"""Libraries of the extras; jinja2 is none of them, as osqp imports it."""


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def listed() -> dict[str, set[str]]:
    """Distributions of pyproject.toml by their extra, those of the base by ""."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lists = {"": project["dependencies"], **project["optional-dependencies"]}
    return {
        extra: {normal(re.split(r"[\[<>=~;]", line)[0]) for line in lines} - {"rti-mpcc"}
        for extra, lines in lists.items()
    }


@cache
def installed() -> Mapping[str, list[str]]:
    """Distributions by the top-level names that they bring."""
    return packages_distributions()


def imports_by_extra(file: Path) -> dict[str, set[str]]:
    """Distributions that a file imports, by the extra that the function around the import checks, or "" """
    tree = ast.parse(file.read_text(encoding="utf-8"))
    extra_of: dict[ast.AST, str] = {}
    for function in ast.walk(tree):
        if isinstance(function, ast.FunctionDef):
            nodes = list(ast.walk(function))
            for call in nodes:
                if isinstance(call, ast.Call) and getattr(call.func, "id", "") == "check_extra":
                    extra_of |= dict.fromkeys(nodes, ast.literal_eval(call.args[0]))
    found: dict[str, set[str]] = defaultdict(set)
    for node in ast.walk(tree):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom) and node.level == 0:
            names.append(str(node.module))
        for top in {name.partition(".")[0] for name in names} - set(sys.stdlib_module_names) - set(PACKAGES):
            found[extra_of.get(node, "")].add(normal(PART_OF.get(top) or installed()[top][0]))
    return found


def reached(files: dict[str, Path], start: tuple[str, ...]) -> set[str]:
    """Modules of this project that are imported at last, by their names."""
    left, found = list(start), set[str]()
    while left:
        parts = left.pop().split(".")
        for length in range(1, len(parts) + 1):
            name = ".".join(parts[:length])
            if name in files and name not in found:
                found.add(name)
                left += imported(files[name], ROOT)
    return found


def test_pyproject_lists_what_is_imported_and_nothing_else() -> None:
    files = {module_name(file, ROOT): file for file in sources(ROOT)}
    base = reached(files, BASE)
    assert not {name for name in base if name.startswith(SIM)}
    needed: dict[str, set[str]] = defaultdict(set)
    for name, file in files.items():
        for extra, distributions in imports_by_extra(file).items():
            needed[extra or ("" if name in base else "sim")] |= distributions
    needed["sim"] -= needed[""]
    assert needed == {
        extra: names for extra, names in listed().items() if extra not in ("docs", "release", "test")
    }


BLOCK = f"import sys; sys.modules.update(dict.fromkeys({REFUSED}))\n"
"""As if they were not installed: an import of None is a ModuleNotFoundError."""
IN_A_LOOP = """
from rti_mpcc import Corridor, DockingController, GoalMeasurement, Limits, Pose2, ReferencePath, Vehicle
from rti_mpcc.recording import Recorder, replay
from rti_mpcc.simulation.plant import PlantParameters, PlantState, advance, issue

path = ReferencePath.from_segments(start=Pose2(0.0, 0.0, 0.0), segments=[(1, 0.0, 20.0)])
controller = DockingController(path, Corridor.from_offsets(path, left=3.0, right=-3.0))
plant, parameters = PlantState(x=0.0, y=0.0, phi=0.0), PlantParameters.of(Vehicle(), Limits())
with Recorder(controller, "loop.jsonl") as recorder:
    for cycle in range(10):
        seen = GoalMeasurement(stamp=plant.time, x=20.0, y=0.0, phi=0.0)
        command = recorder.step(plant.measured, now=plant.time, measurements=[seen])
        plant = issue(plant, parameters, acceleration=command.acceleration, steering_rate=0.0)
        plant = advance(plant, parameters, plant.time + 0.1)
print(plant.v > 0.0, recorder.problem == "", replay("loop.jsonl").identical)
"""
ON_A_MAP = """
from pathlib import Path
from rti_mpcc import Area, Dock, DockingController, DockingMission, Pose2, VehicleState, Wait, plan_manoeuvre

Path("free.pgm").write_bytes(b"P5 40 40 255 " + bytes([254] * 1600))
entries = {"image": "free.pgm", "resolution": 0.5, "origin": [-10.0, -10.0, 0.0], "negate": 0}
entries |= {"occupied_thresh": 0.65, "free_thresh": 0.2}
Path("free.yaml").write_text("".join(f"{key}: {value}\\n" for key, value in entries.items()))
area, goal = Area.from_map("free.yaml"), Pose2(4.0, 0.0, 0.0)
mission = DockingMission(DockingController.in_area(area), [Dock(goal), Wait(1.0)])
command = mission.step(VehicleState(x=-4.0, y=0.0, phi=0.0, v=0.0, delta=0.0), now=0.0)
print(command.mission.kind == "dock", plan_manoeuvre(Pose2(-4.0, 0.0, 0.0), goal, area).found)
"""
IN_SIMULATION = """
from rti_mpcc.simulation import changed, load_scenario, simulate

result = simulate(changed(load_scenario("docking_inside"), {"simulation.duration": 0.5}))
print(len(result.cycles.speed) > 1)
"""


WRITES = "from rti_mpcc import simulation as s; s.scenario_text(s.load_scenario('docking_inside'))"
DRIVES = "from rti_mpcc.simulation import batch; batch.drive_all([])"
SPREADS = """
from pathlib import Path
from rti_mpcc.simulation.campaign import run_campaign
run_campaign([], Path(), dask="tcp://nowhere")
"""
DETECTS = "import rti_mpcc as r; r.CharucoGoalDetector(r.Camera(), r.CharucoBoard())"


def without_extras(code: str, folder: Path, *arguments: str) -> CompletedProcess[str]:
    """A fresh process that has the base libraries only."""
    return fresh("-c", BLOCK + code, *arguments, folder=folder)


def test_the_base_is_enough_for_a_loop_on_a_map_and_in_simulation(tmp_path: Path) -> None:
    done = without_extras(IN_A_LOOP + ON_A_MAP + IN_SIMULATION, tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["True"] * 6


MISSING = (
    ("import rti_mpcc.report.overview", "the command line, pictures and tables need rich", "sim"),
    (WRITES, "writing a scenario file needs tomlkit", "sim"),
    (DRIVES, "driving many runs needs joblib", "sim"),
    (SPREADS, "a Dask cluster needs distributed", "cluster"),
    ("from rti_mpcc.recording import McapLog; McapLog('ride.mcap')", "an MCAP file needs mcap", "mcap"),
    (DETECTS, "detecting a ChArUco board needs OpenCV", "vision"),
)
TRIED = """
for code in sys.argv[1:]:
    try:
        exec(code)
    except Exception as error:
        print(type(error).__name__, error, sep=": ")
"""


def test_a_missing_extra_is_named_in_one_sentence(tmp_path: Path) -> None:
    done = without_extras(TRIED, tmp_path, *(code for code, *_ in MISSING))
    assert done.stdout.splitlines() == [
        f"MissingExtraError: {need}, which is not installed: pip install '.[{extra}]' in rti-mpcc's folder"
        for _, need, extra in MISSING
    ]


@pytest.mark.parametrize(
    "arguments",
    some_of(["run docking_behind", "show ride.jsonl", "campaign docking_behind --count 2", "warm"], 4),
)
def test_the_command_line_says_what_to_install(arguments: str, tmp_path: Path) -> None:
    code = "from rti_mpcc.__main__ import run_command\nsys.exit(run_command())"
    done = without_extras(code, tmp_path, *arguments.split())
    assert done.stderr == (
        "rti-mpcc: error: the command line, pictures and tables need rich, which is not installed: "
        "pip install '.[sim]' in rti-mpcc's folder\n"
    )
    assert (done.returncode, done.stdout, list(tmp_path.iterdir())) == (2, "", [])


def test_the_script_is_the_command_that_says_it() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["scripts"] == {"rti-mpcc": "rti_mpcc.__main__:run_command"}


def test_the_refused_libraries_are_those_of_the_extras() -> None:
    lists = listed()
    extras = set().union(*(lists[extra] for extra in ("sim", "vision", "mcap", "cluster")))
    assert {normal(installed()[name][0]) for name in REFUSED} - {"dask"} == extras - {"jinja2"}
