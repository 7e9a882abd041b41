"""The window, without one: what is drawn for a cycle, and what buttons, slider and keys do."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.backend_bases import KeyEvent, MouseButton, MouseEvent
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rti_mpcc.model.layout import DELTA, DELTA_DOT, A, V
from rti_mpcc.report.film import Film
from rti_mpcc.report.inside import figures_of
from rti_mpcc.report.viewer import SIZE, TICK, Viewer
from rti_mpcc.report.views import CycleView
from rti_mpcc.types import Array, Source, Status


@pytest.fixture
def viewer(film: Film) -> Viewer:
    return opened(film)


def opened(film: Film, *, drawn: bool = False) -> Viewer:
    """A window that is not drawn: that takes its time."""
    figure = Figure(figsize=SIZE, dpi=40)
    if drawn:
        FigureCanvasAgg(figure)
    return Viewer(film, figure)


def press(viewer: Viewer, key: str) -> None:
    canvas = viewer.figure.canvas
    canvas.callbacks.process("key_press_event", KeyEvent("key_press_event", canvas, key))


def click(viewer: Viewer, axes: Any, share: float = 0.5) -> None:
    """Press and release the mouse on axes, so far from their left end."""
    canvas, box = viewer.figure.canvas, axes.get_window_extent()
    at = (box.x0 + share * box.width, 0.5 * (box.y0 + box.y1))
    for name in ("button_press_event", "button_release_event"):
        canvas.callbacks.process(name, MouseEvent(name, canvas, *at, button=MouseButton.LEFT))


def curve(line: Any) -> Array:
    return np.asarray(line.get_xydata())


def test_the_first_cycle_is_shown_at_first(viewer: Viewer, film: Film) -> None:
    assert viewer.index == 0
    assert viewer.text.get_text().startswith("cycle 1 of 33, 0.00 s: ")
    assert viewer.slider.valmin == 0.0
    assert viewer.slider.valmax == pytest.approx(3.2)
    assert viewer.button.label.get_text() == "play"


def test_slider_shows_the_cycle_of_its_time(viewer: Viewer, film: Film) -> None:
    viewer.slider.set_val(2.04)
    assert viewer.index == 20
    view = film.views[20]
    plan = view.observed.command.trajectory
    ahead = plan.times - plan.times[0]
    assert curve(viewer.scene.plan) == pytest.approx(plan.states[:, :2])
    for line, values in zip(
        viewer.plan.lines,
        (plan.states[:, V], plan.states[:, DELTA], plan.controls[:, A], plan.controls[:, DELTA_DOT]),
        strict=True,
    ):
        drawn = curve(line)
        assert drawn[:, 0] == pytest.approx(ahead)
        assert drawn[: len(values), 1] == pytest.approx(values)
    assert [bar.get_width() for bar in viewer.bars.bars.patches][3] == pytest.approx(
        view.observed.command.diagnostics.weights.goal_position
    )
    assert viewer.text.get_text().startswith("cycle 21 of 33, 2.00 s: ")


def test_click_on_the_slider_moves_it(viewer: Viewer) -> None:
    click(viewer, viewer.slider.ax, share=0.75)
    assert viewer.index == pytest.approx(24, abs=1)


def test_slack_and_weights_are_those_of_the_stages(viewer: Viewer, film: Film) -> None:
    viewer.go(3.0)
    view = film.views[viewer.index]
    inside = view.observed.inside
    assert inside is not None
    ahead = inside.times - inside.times[0]
    assert curve(viewer.stages.slack) == pytest.approx(np.stack([ahead[1:], 1e3 * inside.slack], axis=-1))
    assert curve(viewer.stages.lack)[:, 1] == pytest.approx(1e3 * view.lack)
    for name, line in zip(
        ("lag", "contouring", "progress_reward", "acceleration", "steering_rate"),
        viewer.stages.weights,
        strict=True,
    ):
        values = getattr(inside.weights, name)
        assert curve(line) == pytest.approx(np.stack([ahead[: len(values)], values], axis=-1))


def test_without_a_qp_there_is_nothing_of_one(film: Film) -> None:
    bare = replace(film.views[5], observed=replace(film.views[5].observed, inside=None))
    viewer = opened(replace(film, views=(*film.views[:5], bare, *film.views[6:])))
    viewer.go(0.5)
    assert [len(curve(line)) for line in (viewer.stages.slack, *viewer.stages.weights)] == [0] * 6
    viewer.go(0.6)
    assert len(curve(viewer.stages.slack)) == len(film.views[6].lack)


def test_limits_are_drawn_and_named(viewer: Viewer, film: Film) -> None:
    limits = film.config.limits
    for line, name, limit in zip(
        viewer.plan.lines,
        ("v [m/s]", "delta [rad]", "a [m/s²]", "delta_dot [rad/s]"),
        (limits.speed, limits.steering, limits.acceleration, limits.steering_rate),
        strict=True,
    ):
        axes: Any = line.axes
        assert axes.get_ylabel() == name
        assert axes.get_title(loc="right") == f"limit ±{limit:g}"
        drawn = [one.get_ydata() for one in axes.get_lines() if one is not line]
        assert np.unique(np.asarray(drawn)).tolist() == [-limit, limit]


def test_play_goes_on_until_the_end_and_begins_again(viewer: Viewer, film: Film) -> None:
    viewer.tick()
    assert viewer.index == 0
    viewer.go(2.95)
    click(viewer, viewer.button.ax)
    assert viewer.playing
    assert viewer.button.label.get_text() == "pause"
    viewer.tick()
    assert viewer.slider.val == pytest.approx(2.95 + TICK)
    assert viewer.index == 30
    click(viewer, viewer.button.ax)
    assert not viewer.playing
    viewer.tick()
    assert viewer.index == 30
    viewer.toggle()
    for _ in range(4):
        viewer.tick()
    assert (viewer.index, viewer.playing) == (len(film.views) - 1, False)
    assert viewer.button.label.get_text() == "play"
    viewer.toggle()
    assert (viewer.index, viewer.playing) == (0, True)


def test_keys(viewer: Viewer) -> None:
    visited = []
    for key in ("right", "right", "left", "up", "down", "end", "right", "home", "left", "pageup", "x"):
        press(viewer, key)
        visited.append(viewer.index)
    assert visited == [1, 2, 1, 11, 1, 32, 32, 0, 0, 32, 32]
    press(viewer, " ")
    assert viewer.playing
    press(viewer, "right")
    assert (viewer.index, viewer.playing) == (1, False)


def test_cycles_at_the_same_time_are_all_reached(film: Film) -> None:
    times = film.times.copy()
    times[3:6] = times[3]
    viewer = opened(replace(film, times=times))
    visited = []
    for _ in range(7):
        press(viewer, "right")
        visited.append(viewer.index)
    assert visited == [1, 2, 3, 4, 5, 6, 7]


def test_what_is_redrawn_is_the_same_as_if_all_was(film: Film) -> None:
    viewer = opened(film, drawn=True)
    canvas: Any = viewer.figure.canvas
    for time in (0.5, 1.5, 2.5):
        viewer.go(time)
    redrawn = np.array(canvas.buffer_rgba())
    canvas.draw()
    assert (np.array(canvas.buffer_rgba()) == redrawn).all()
    viewer.go(0.5)
    assert (np.array(canvas.buffer_rgba()) != redrawn).any()


def test_a_saved_picture_has_what_moves(viewer: Viewer, tmp_path: Any) -> None:
    for name, time in (("begin", 0.0), ("end", 3.2)):
        viewer.go(time)
        viewer.figure.savefig(tmp_path / f"{name}.png")
    assert (tmp_path / "begin.png").read_bytes() != (tmp_path / "end.png").read_bytes()


def test_one_cycle_is_a_film(film: Film) -> None:
    viewer = opened(replace(film, views=film.views[:1], times=film.times[:1]))
    viewer.toggle()
    viewer.tick()
    assert (viewer.index, viewer.playing) == (0, False)


def told(view: CycleView, **changes: Any) -> str:
    command = view.observed.command
    diagnostics = replace(command.diagnostics, **changes)
    command = replace(command, status=Status.FAILED, source=Source.SHIFTED_PLAN, diagnostics=diagnostics)
    return figures_of(replace(view, observed=replace(view.observed, command=command)), 4, 9)


def test_text_tells_status_reason_solver_and_times(film: Film) -> None:
    text = told(
        film.views[9],
        time_to_go=7.321,
        reason="the plan came after the deadline",
        solver_status="run time limit reached",
        iterations=35,
        residuals=(1.5e-3, 2e-4),
        failed=True,
        retried=True,
        deadline_missed=True,
        slack=0.0123,
        prepare_ms=1.26,
        feedback_ms=2.5,
        solve_ms=2.0,
        step_ms=4.0,
    )
    assert text.splitlines() == [
        "cycle 5 of 9, 0.90 s: failed",
        "driven: shifted plan; objective: arrival, 7.32 s to go",
        "reason: the plan came after the deadline",
        "solver: run time limit reached, 35 iterations, residuals 1.5e-03, 2.0e-04, not accepted, "
        "sought twice, deadline missed",
        f"largest slack 12.3 mm, {len(film.views[9].planes.points)} active half-planes",
        "prepare 1.3 ms, feedback 2.5 ms (solver 2.0 ms), whole step 4.0 ms",
    ]
    nothing = told(film.views[9], time_to_go=None, reason="", solver_status="", iterations=0)
    assert "\nreason: -\nsolver: no QP, 0 iterations" in nothing


def test_nothing_is_cut_off(viewer: Viewer) -> None:
    viewer.go(3.0)
    viewer.figure.draw_without_rendering()
    whole = viewer.figure.bbox
    (legend,) = viewer.figure.legends
    boxes = [axes.get_tightbbox() for axes in viewer.figure.axes]
    for box in (*boxes, legend.get_window_extent(), viewer.text.get_window_extent()):
        assert box is not None
        assert box.x0 >= whole.x0
        assert box.y0 >= whole.y0
        assert box.x1 <= whole.x1
        assert box.y1 <= whole.y1
