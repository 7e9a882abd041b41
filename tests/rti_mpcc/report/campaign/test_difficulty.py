"""Bins, against counts made by hand, and their pictures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.difficulty import BINS, COURSE, DISTURBANCES, Bin, Scale, bins, varying
from rti_mpcc.report.campaign.difficulty_picture import success_figure, time_figure
from rti_mpcc.report.campaign.figures import success_interval, time_over_yardstick
from tests.rti_mpcc.report.campaign.made_up import CALM, campaign, docked, raised, stalled

SCALES = {scale.column: scale for scale in COURSE + DISTURBANCES}


def parts(read: Campaign, scale: Scale) -> list[Bin]:
    return bins(read, scale, time_over_yardstick(read))


def test_only_what_varies_is_shown(tmp_path: Path) -> None:
    noise = (0.01, 0.01, 0.0, 0.0, 0.0)
    read = campaign(
        tmp_path,
        docked(0, course={"length_m": 20.0}),
        docked(1, course={"length_m": 30.0}, disturbances=replace(CALM, state_noise=noise)),
        replace(raised(2), course=None, disturbances=None),
    )
    assert [scale.column for scale in varying(read, COURSE)] == ["goal_beside_m", "length_m"]
    # x and y have the same noise in all cases: one of them is enough.
    assert [scale.column for scale in varying(read, DISTURBANCES)] == ["noise_x_m"]
    assert varying(campaign(tmp_path, docked(0)), COURSE) == []


def test_few_values_have_a_bin_each(tmp_path: Path) -> None:
    rows = [docked(0, 20.0), docked(1, 26.0), stalled(2), docked(3, 40.0, -0.2, course={"cusps": 1})]
    one, two = parts(campaign(tmp_path, *rows), SCALES["cusps"])
    assert (one.low, one.high, one.cases, one.docked, one.collisions) == (0.0, 0.0, 3, 2, 0)
    assert one.rate == pytest.approx(2.0 / 3.0)
    assert one.interval == pytest.approx(success_interval(2, 3))
    assert one.time == {"p25": 21.5, "p50": 23.0, "p75": 24.5}
    assert one.over_yardstick == pytest.approx(23.0 / 15.0)
    assert (two.low, two.cases, two.docked, two.collisions) == (1.0, 1, 1, 1)
    assert one.told()["interval"] == list(one.interval)


def test_many_values_are_parted_evenly(tmp_path: Path) -> None:
    rows = [docked(i, course={"length_m": 10.0 + i}) for i in range(60)]
    rows[7] = stalled(7, course={"length_m": 17.0})
    found = parts(campaign(tmp_path, *rows), SCALES["length_m"])
    assert len(found) == BINS
    assert [one.cases for one in found] == [10] * BINS
    assert [one.docked for one in found] == [9, 10, 10, 10, 10, 10]
    assert (found[0].low, found[0].high, found[0].middle) == (10.0, 19.0, 14.5)
    assert found[-1].high == 69.0


def test_sides_count_alike_where_a_scale_is_a_size(tmp_path: Path) -> None:
    rows = [docked(i, course={"goal_turned_rad": turned}) for i, turned in enumerate((-0.3, 0.3, 0.1))]
    found = parts(campaign(tmp_path, *rows), SCALES["goal_turned_rad"])
    assert [(one.low, one.cases) for one in found] == [(0.1, 1), (0.3, 2)]


def test_equal_values_stay_together(tmp_path: Path) -> None:
    rooms = [1.0] * 30 + [1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7]
    rows = [docked(i, course={"room_m": room}) for i, room in enumerate(rooms)]
    found = parts(campaign(tmp_path, *rows), SCALES["room_m"])
    assert (found[0].low, found[0].high) == (1.0, 1.0)
    assert sum(one.cases for one in found) == 37


def test_a_case_without_a_course_is_in_no_bin(tmp_path: Path) -> None:
    rows = [docked(0), replace(raised(1), course=None), docked(2, course={"cusps": 1})]
    assert sum(one.cases for one in parts(campaign(tmp_path, *rows), SCALES["cusps"])) == 2


def test_pictures_show_the_bins(tmp_path: Path) -> None:
    rows = [docked(i, 20.0 + i, course={"cusps": i % 2, "length_m": 20.0 + i}) for i in range(6)]
    rows += [stalled(6), stalled(7, course={"cusps": 1})]
    read = campaign(tmp_path, *rows)
    shown = [(SCALES[name], parts(read, SCALES[name])) for name in ("length_m", "cusps")]
    success, time = success_figure(read, shown), time_figure(shown)
    for figure, values in ((success, [75.0, 75.0]), (time, [22.0, 23.0])):
        axes = figure.axes[1]
        assert axes.get_xlabel() == "cusps"
        assert np.asarray(axes.lines[0].get_xydata()) == pytest.approx(
            np.array([[0.0, values[0]], [1.0, values[1]]])
        )
    crosses = next(line for line in success.axes[1].lines if line.get_label() == "did not dock")
    assert np.asarray(crosses.get_xdata()).tolist() == [0.0, 1.0]


def test_pictures_of_nothing_but_losses(tmp_path: Path) -> None:
    read = campaign(tmp_path, stalled(0), raised(1, course={"cusps": 1}))
    shown = [(SCALES["cusps"], parts(read, SCALES["cusps"]))]
    assert [one.time["p50"] for one in shown[0][1]] == [None, None]
    success_figure(read, shown).draw_without_rendering()
    time_figure(shown).draw_without_rendering()
