"""The parts of the reproduction: verdicts, schedules, Frenet picture, errors at cusp and end."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from benchmarks.reproduction import causes
from benchmarks.reproduction.comfort import aims, aims_told
from benchmarks.reproduction.content import Section, found, say
from benchmarks.reproduction.docking import verdicts
from benchmarks.reproduction.docking_pictures import HIGHEST, cut_peaks
from benchmarks.reproduction.exactness import error_at, nearest_error, track_smoothness
from benchmarks.reproduction.frenet_picture import frenet_figure, marked_stage, paired
from benchmarks.reproduction.published import Track, published_track
from benchmarks.reproduction.report import counted
from benchmarks.reproduction.runs import Runs, experiment_cases
from benchmarks.reproduction.schedules import SHOWN, schedule, schedules_figure, targets
from benchmarks.reproduction.verdicts import MISSED, claims, missed_causes
from geometry import Pose2, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.ocp.objectives import TargetKind
from rti_mpcc.paper.objective import DynamicContouring, sigma


def test_outcomes_are_counted() -> None:
    lines = ["One: reproduced.", "Two: not reproduced (3).", "Three: not measured.", "It docks."]
    section = Section(name="one", title="One", blocks=[*map(found, lines), say("Not counted: reproduced.")])
    assert counted([section]) == ("Of 3 published or required outcomes 1 are reproduced; 1 not measured.")


def figures(time: float | None, **changes: Any) -> dict[str, Any]:
    usual: dict[str, Any] = {
        "time_to_tolerance_s": time,
        "docked": time is not None,
        "direction_changes": 0,
        "min_clearance_m": 0.3,
        "final_error": {"longitudinal_m": 0.5, "lateral_m": -0.2, "heading_rad": 0.1},
        "last_status": "docked" if time else "blocked",
    }
    return {**usual, **changes}


def test_verdicts_are_computed() -> None:
    inside = {
        "dynamic": figures(30.0),
        "separated": figures(45.9),
        "switched": figures(24.0, direction_changes=1),
    }
    told = verdicts("docking_inside", inside)
    assert told[0].startswith("`dynamic` is inside tolerance after 30.00 s: 9.5 % later than in the paper")
    assert told[1].startswith("`separated` takes 1.53 times `dynamic` (paper 1.52, published code 1.54)")
    assert "with 1 change of direction; the body's clearance is 0.30 m" in told[2]
    assert [line.partition(": ")[2] for line in told[3:]] == [
        "reproduced (here 30.00 s, paper 27.39 s, published code 27.33 s).",
        "reproduced (1.53 times here, paper 1.52, published code 1.54).",
        "not reproduced (0.80 times here, paper 1.80, published code 1.72).",
        "reproduced (`switched` 1 and `dynamic` 0 here, 1 and 0 in the published code).",
    ]
    assert missed_causes("docking_inside", inside) == []
    early = {"dynamic": figures(30.0), "separated": figures(45.0), "switched": figures(None)}
    assert missed_causes("docking_behind", early) == [causes.SEPARATED_BEHIND, causes.SWITCHED_BEHIND]


def test_what_never_came_is_not_compared() -> None:
    behind = {
        "dynamic": figures(30.0),
        "separated": figures(None, direction_changes=2),
        "switched": figures(None),
    }
    told = verdicts("docking_behind", behind)
    assert "it does not dock (status blocked at the end, 0.50 m, −0.20 m and 5.7° off)" in told[2]
    assert [claim.holds(behind) for claim in claims("docking_behind")] == [True, None, True, True, False]
    assert missed_causes("docking_behind", behind) == [causes.SWITCHED_BEHIND]
    assert any("`dynamic`: not measured (– times here, paper 2.07" in line for line in told)
    assert told[-1].endswith("(here it does not dock, clearance of the body 0.30 m; published code −1.35 m).")
    assert verdicts("docking_behind", {**behind, "dynamic": figures(None)})[0] == (
        "`dynamic` never gets inside tolerance."
    )


def spent(time: float | None, share: float, clearance: float = 0.12) -> dict[str, Any]:
    """`share` of the published code's energies in Scenario 1, over its way."""
    energy = {
        "acceleration": share * 0.559,
        "steering_rate": share * 0.413,
        "lateral_acceleration": share * 0.935,
    }
    return {
        "time_to_tolerance_s": time,
        "min_clearance_m": clearance,
        "energy": energy,
        "energy_to_dock": {name: 1.05 * value for name, value in energy.items()},
        "peak": {"acceleration": 0.3},
        "comfort": {"acceleration": 0.4},
        "distance_m": 1e3,
    }


def test_what_default_set_out_for_is_judged_by_the_run() -> None:
    assert all(aim.met for aim in aims(spent(21.0, 0.9), "docking_inside"))
    told = aims_told("docking_inside", aims(spent(21.0, 0.9), "docking_inside"))
    assert told == "Scenario 1: `default` keeps to all that it set out for: reproduced."
    missed = [aim.words for aim in aims(spent(21.5, 1.1, 0.09), "docking_inside") if not aim.met]
    assert missed == [
        "time to tolerance T [s]",
        "clearance [m]",
        "energy of acceleration / published code's",
        "energy of lateral acceleration / published code's",
    ]
    never = aims(spent(None, 0.5), "docking_inside")
    assert not never[0].met
    assert "(time to tolerance T [s] –" in aims_told("docking_inside", never)
    assert MISSED in aims_told("docking_inside", never)


def test_the_least_energy_is_that_of_the_shorter_way() -> None:
    """12 D²/T³ by the published trajectory where this run's way is longer."""
    track = published_track("docking_inside", "dynamic")
    way = np.hypot(*np.diff(track.poses[:, :2], axis=0).T).sum()
    for mine, shorter in ((1e3, way), (5.0, 5.0)):
        last = aims({**spent(20.0, 1.0), "distance_m": mine}, "docking_inside")[-1]
        assert last.value == pytest.approx(0.559 / (12.0 * shorter**2 / 20.0**3))


def test_a_peak_is_cut_off_and_told() -> None:
    calm, hard = Figure().subplots(1, 2)
    calm.plot([0.0, 1.0, 2.0], [0.0, 0.4, -0.4])
    hard.plot([0.0, 1.0, 2.0], [-0.5, 3.7, 0.5])
    hard.plot([0.0, 1.0, 2.0], [-0.5, -2.0, 0.5])
    kept = calm.get_ylim()
    cut_peaks([calm, hard])
    assert calm.get_ylim() == kept
    assert not calm.texts
    assert hard.get_ylim() == (-HIGHEST, HIGHEST)
    assert [text.get_text() for text in hard.texts] == ["to 3.7 m/s²", "to −2.0 m/s²"]


@pytest.mark.parametrize("name", targets())
def test_schedules_are_the_weights_of_the_controller(name: str) -> None:
    config, target = ControllerConfig.paper(), targets()[name]
    weights, theta = config.weights, np.arange(*SHOWN, 0.5)
    values = schedule(config, target, theta)
    stages = DynamicContouring().weights(config, target, theta, np.ones(len(theta) - 1))
    assert values.lag[:-1] == pytest.approx(stages.lag[:-1])  # the last stage has more
    assert values.contouring == pytest.approx(stages.contouring)
    assert values.progress_reward[:-1] == pytest.approx(stages.progress_reward)
    assert values.goal[0] == pytest.approx(stages.goal[0])
    pose = target.kind is TargetKind.POSE
    wanted = sigma(target.stop - theta, weights) * weights.goal[0] if pose else np.zeros(len(theta))
    assert values.goal == pytest.approx(wanted)


def test_the_drawn_schedules_are_these_curves() -> None:
    figure = schedules_figure()
    config = ControllerConfig.paper()
    for column, target in enumerate(targets().values()):
        for row, field in enumerate(("lag", "contouring", "progress_reward", "goal")):
            line = figure.axes[3 * row + column].lines[0]
            theta = np.asarray(line.get_xdata(), dtype=float)
            assert line.get_ydata() == pytest.approx(getattr(schedule(config, target, theta), field))


def test_references_are_paired_to_their_stages() -> None:
    plan = paired(1e3)
    c, s = np.cos(plan.feet[:, 2]), np.sin(plan.feet[:, 2])
    along = np.stack([c, s], axis=-1) * plan.lag[:, None]
    across = np.stack([-s, c], axis=-1) * plan.contouring[:, None]
    assert plan.feet[:, :2] + along + across == pytest.approx(plan.states[:, :2])
    assert np.abs(plan.lag).max() < 0.25 < np.abs(plan.contouring).max()
    axes = frenet_figure([plan]).axes[0]
    assert axes.get_aspect() == 1.0
    stage = marked_stage(plan)
    marked = {str(line.get_label()): np.asarray(line.get_xydata()) for line in axes.lines}
    assert marked["$e_l$ of one stage"][0] == pytest.approx(plan.feet[stage, :2])
    assert marked["$e_c$ of one stage"][1] == pytest.approx(plan.states[stage, :2])


def test_errors_are_in_the_frame_of_the_wanted_pose() -> None:
    wanted = Pose2(1.0, 2.0, 0.5 * np.pi)
    error = error_at(np.array([0.9, 2.2, 0.5 * np.pi + 2.0 * np.pi + 0.1]), wanted)
    assert error == pytest.approx((0.2, 0.1, 0.1))
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 1.9, 1.5], [3.0, 3.0, 0.0]])
    assert nearest_error(poses, wanted) == pytest.approx(error_at(poses[1], wanted))


def test_smoothness_is_taken_part_by_part() -> None:
    # 10 m forward at 1 m/s, 10 m back at 2 m/s; the last 4 m of each part are left out.
    path = ReferencePath.from_segments(Pose2(0.0, 0.0, 0.0), [(1, 0.0, 10.0), (-1, 0.0, 10.0)])
    x = np.concatenate([np.linspace(0.0, 9.9, 100), np.linspace(10.0, 0.2, 50)])
    forward = np.arange(150) < 100
    track = Track(
        times=np.linspace(0.0, 14.9, 150),
        poses=np.stack([x, np.zeros(150), np.zeros(150)], axis=-1),
        v=np.where(forward, 1.0, -2.0),
        delta=np.where(forward, 0.1, -0.2),
        acceleration=np.zeros(150),
        steering_rate=np.where(forward, np.where(x < 5.95, 0.3, 9.0), np.where(x > 4.05, -0.5, 9.0)),
    )
    found = [track_smoothness(track, path, part, 4.0, 2.0) for part in range(2)]
    assert found[0] == pytest.approx((0.3, 0.5 * np.tan(0.1)))
    assert found[1] == pytest.approx((0.5, 2.0 * np.tan(0.2)))
    assert track_smoothness(track, path, 0, 20.0, 2.0) is None


def test_all_experiments_are_driven_once() -> None:
    cases = [(case.scenario.name, case.method, case.preset) for case in experiment_cases()]
    assert len(cases) == len(set(cases)) == 13
    assert ("path_following", "constant_50", "paper") in cases
    assert ("docking_behind", "dynamic", "default") in cases
    with pytest.raises(InputError, match="docking_inside, switched, paper: was not driven"):
        Runs(experiments=[]).of("docking_inside", "switched")
