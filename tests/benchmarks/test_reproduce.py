"""`make reproduce`: page, numbers, pictures, refusals; with runs of a second each."""

from __future__ import annotations

import json
from base64 import b64decode
from dataclasses import replace
from pathlib import Path
from re import findall

import pytest

from benchmarks.reproduction.__main__ import main, reproduce
from benchmarks.reproduction.runs import Cases, Runs
from rti_mpcc.simulation import changed, load_scenario
from rti_mpcc.simulation.batch import Case

PICTURES = {
    "comfort_front.png",
    "docking_behind_plane.png",
    "docking_behind_time.png",
    "docking_inside_plane.png",
    "docking_inside_time.png",
    "frenet.png",
    "full_course.png",
    "full_course_along.png",
    "mission_over_time.png",
    "mission_plane.png",
    "weight_schedules.png",
}


def short(case: Case, seconds: float = 1.0) -> Case:
    return replace(case, scenario=changed(case.scenario, {"simulation.duration": seconds}))


pytestmark = pytest.mark.usefixtures("elsewhere")


@pytest.mark.acceptance
def test_everything_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    whole, course = Cases.of(0), short(Case(scenario=load_scenario("docking_inside")), 0.2)
    cases = Cases(
        experiments=list(map(short, whole.experiments)),
        comforts=[short(case, 0.1) for case in whole.comforts],
        mission=short(whole.mission, 0.5),
        courses=[course] * 2,
    )
    Path("there").mkdir()
    reproduce(cases, Path("there"), 1)
    said = capsys.readouterr()
    assert said.err == ""
    assert "there/reproduce.html" in said.out
    assert "default docks on all random courses: not reproduced (0 of 2)." in said.out
    folder = Path("there")
    assert {file.name for file in folder.iterdir()} == {"reproduce.html", "reproduce.json", *PICTURES}

    page = (folder / "reproduce.html").read_text(encoding="utf-8")
    sources = findall(r'src="([^"]*)"', page)
    assert len(sources) == len(PICTURES)
    embedded = {b64decode(source.removeprefix("data:image/png;base64,")) for source in sources}
    assert embedded == {(folder / name).read_bytes() for name in PICTURES}
    assert all(link.startswith("#") for link in findall(r'href="([^"]*)"', page))
    assert "<script" not in page
    for told in (
        "27.39",
        "30.66",
        "CARLA",
        "Drawn courses",
        "does not dock",
        "2.080",
        "default</code> docks 0 of 2",
    ):
        assert told in page

    numbers = json.loads((folder / "reproduce.json").read_text(encoding="utf-8"))
    assert list(numbers["sections"]) == [
        "about",
        "frenet",
        "schedules",
        "parameters",
        "full-course",
        "docking-inside",
        "docking-behind",
        "mission",
        "comfort",
        "courses",
    ]
    inside = numbers["sections"]["docking-inside"]["figures"]
    assert [run["method"] for run in inside] == ["dynamic", "separated", "switched", "dynamic"]
    for run in inside[:3]:
        assert f"<td>{run['min_clearance_m']:.2f}</td>" in page
        assert f"<td>{run['rms']['steering']:.3f}</td>" in page


@pytest.mark.acceptance
@pytest.mark.parametrize("count", [0, 2])
def test_runs_are_told_apart(count: int) -> None:
    whole = Cases.of(0)
    first, second, _, fourth, *_ = (short(case, 0.1) for case in whole.experiments)
    cases = Cases(
        experiments=[first],
        comforts=[second] * 3,
        mission=short(whole.mission, 0.5),
        courses=[fourth] * count,
    )
    runs = Runs.driven(cases, jobs=1)
    assert len(runs.courses) == count
    assert [outcome.figures["method"] for outcome in runs.comforts] == ["separated"] * 3
    assert runs.figures("docking_inside")["method"] == "dynamic"
    assert runs.mission is not None
    assert runs.mission.figures["scenario"] == "docking_mission"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--courses", "-1"], "'-1' must be an integer >= 0"),
        (["--jobs", "0"], "'0' must be an integer >= 1"),
        (["docking_inside"], "unrecognized arguments: docking_inside"),
        (["--out", "file"], "file: File exists"),
    ],
)
def test_bad_input_is_refused_before_the_runs(
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    Path("file").write_text("")
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert message in said.err
    assert said.out == ""
