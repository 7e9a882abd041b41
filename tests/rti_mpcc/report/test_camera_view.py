"""The camera's picture beside a film."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from rti_mpcc.report.camera_view import CameraView
from tests.rti_mpcc.report.frames import grey_frame


def test_the_last_picture_before_a_time_is_shown() -> None:
    axes = Figure().add_subplot()
    view = CameraView(axes, (grey_frame(1.0, 10), grey_frame(2.0, 20)))
    shown = (
        (0.5, 200, "no picture yet"),
        (1.0, 10, ""),
        (1.9, 10, ""),
        (2.0, 20, ""),
        (9.0, 20, ""),
        (0.0, 200, "no picture yet"),
    )
    for time, grey, word in shown:
        view.show(time)
        assert np.unique(np.asarray(axes.images[0].get_array())).tolist() == [grey]
        assert axes.texts[0].get_text() == word


def test_it_has_no_axes_and_changes_picture_and_word() -> None:
    axes = Figure().add_subplot()
    view = CameraView(axes, (grey_frame(1.0, 10),))
    assert not axes.axison
    assert axes.get_title() == "camera"
    assert view.moving == [axes.images[0], axes.texts[0]]
