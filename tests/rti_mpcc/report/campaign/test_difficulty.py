"""Bins, against counts made by hand, and their pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rti_mpcc.report.campaign.difficulty import BINS, COURSE, DISTURBANCES, bins, told, varying
from rti_mpcc.report.campaign.figures import success_interval
from rti_mpcc.report.campaign.pictures import success_figure, time_figure
from tests.rti_mpcc.report.campaign.made_up import CALM, campaign, docked, raised, stalled

SCALES = {scale.column: scale for scale in COURSE + DISTURBANCES}


def test_only_what_varies_is_shown(tmp_path: Path) -> None:
    noise = (0.01, 0.01, 0.0, 0.0, 0.0)
    read = campaign(
        tmp_path,
        docked(0, course={"length_m": 20.0}),
        docked(1, course={"length_m": 30.0}, disturbances=replace(CALM, state_noise=noise)),
        replace(raised(2), course=None, disturbances=None),
    )
    assert [scale.column for scale in varying(read.rows, COURSE)] == ["goal_beside_m", "length_m"]
    # x and y have the same noise in all cases: one of them is enough.
    assert [scale.column for scale in varying(read.rows, DISTURBANCES)] == ["noise_x_m"]
    assert varying(campaign(tmp_path, docked(0)).rows, COURSE) == []


def test_few_values_have_a_bin_each(tmp_path: Path) -> None:
    rows = [docked(0, 20.0), docked(1, 26.0), stalled(2), docked(3, 40.0, -0.2, course={"cusps": 1})]
    one, two = told(bins(campaign(tmp_path, *rows).rows, SCALES["cusps"]))
    assert one == {
        "low": 0.0,
        "high": 0.0,
        "middle": 0.0,
        "cases": 3,
        "docked": 2,
        "collisions": 0,
        "rate": pytest.approx(2.0 / 3.0),
        "interval": pytest.approx(list(success_interval(2, 3))),
        "time": {"p25": 21.5, "p50": 23.0, "p75": 24.5},
        "over_yardstick": pytest.approx(23.0 / 15.0),
    }
    assert (two["low"], two["cases"], two["docked"], two["collisions"]) == (1.0, 1, 1, 1)
    json.dumps([one, two], allow_nan=False)


def test_many_values_are_parted_evenly(tmp_path: Path) -> None:
    rows = [docked(i, course={"length_m": 10.0 + i}) for i in range(60)]
    rows[7] = stalled(7, course={"length_m": 17.0})
    found = bins(campaign(tmp_path, *rows).rows, SCALES["length_m"])
    assert len(found) == BINS
    assert found["cases"].tolist() == [10] * BINS
    assert found["docked"].tolist() == [9, 10, 10, 10, 10, 10]
    assert found[["low", "high", "middle"]].iloc[0].tolist() == [10.0, 19.0, 14.5]
    assert found["high"].max() == 69.0


def test_sides_count_alike_where_a_scale_is_a_size(tmp_path: Path) -> None:
    rows = [docked(i, course={"goal_turned_rad": turned}) for i, turned in enumerate((-0.3, 0.3, 0.1))]
    found = bins(campaign(tmp_path, *rows).rows, SCALES["goal_turned_rad"])
    assert found[["low", "cases"]].to_numpy().tolist() == [[0.1, 1], [0.3, 2]]


def test_equal_values_stay_together(tmp_path: Path) -> None:
    rooms = [1.0] * 30 + [1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7]
    rows = [docked(i, course={"room_m": room}) for i, room in enumerate(rooms)]
    found = bins(campaign(tmp_path, *rows).rows, SCALES["room_m"])
    assert found[["low", "high"]].iloc[0].tolist() == [1.0, 1.0]
    assert found["cases"].sum() == 37


def test_a_case_without_a_course_is_in_no_bin(tmp_path: Path) -> None:
    rows = [docked(0), replace(raised(1), course=None), docked(2, course={"cusps": 1})]
    assert bins(campaign(tmp_path, *rows).rows, SCALES["cusps"])["cases"].sum() == 2


def test_pictures_show_the_bins(tmp_path: Path) -> None:
    rows = [docked(i, 20.0 + i, course={"cusps": i % 2, "length_m": 20.0 + i}) for i in range(6)]
    rows += [stalled(6), stalled(7, course={"cusps": 1})]
    read = campaign(tmp_path, *rows)
    shown = [(SCALES[name], bins(read.rows, SCALES[name])) for name in ("length_m", "cusps")]
    success, time = success_figure(read.rows, shown), time_figure(shown)
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
    shown = [(SCALES["cusps"], bins(read.rows, SCALES["cusps"]))]
    assert [one["time"]["p50"] for one in told(shown[0][1])] == [None, None]
    success_figure(read.rows, shown).draw_without_rendering()
    time_figure(shown).draw_without_rendering()
