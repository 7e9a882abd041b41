"""Film: the views of all cycles of a run or a recording, and the course they were driven on."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from os import PathLike
from pathlib import Path

import numpy as np

from geometry import Area, Corridor, ReferencePath
from rti_mpcc.config import ControllerConfig
from rti_mpcc.errors import InputError
from rti_mpcc.ocp.horizon import read_only
from rti_mpcc.planning.clock import PlayedBack
from rti_mpcc.recording import Cycle, read_recording
from rti_mpcc.recording.contents import Driver, core_of
from rti_mpcc.recording.recorder import run_cycle
from rti_mpcc.report.camera_frames import Frame
from rti_mpcc.report.views import CycleView, ObservedCycle, observed_cycle, view_of
from rti_mpcc.simulation import RunResult
from rti_mpcc.simulation.goal_metrics import rows_at
from rti_mpcc.types import Array, Command

_log = logging.getLogger(__name__)

REPLAYED = 1e-6
"""A replayed plan within this of the recorded one is the same; relative above 1."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Film:
    """What there is to be seen of a run.

    Attributes:
        label: stands over its picture.
        path, corridor: of the course; obstacles are those of each look. None in an area, where each look has
            the path that was planned by then.
        area: where there is no course; None along a path.
        config: the controller's settings.
        views: of all cycles, at least one, in order of time.
        times: (m,) of the views [s], never falling.
        frames: what a camera saw; none without one.
    """

    label: str
    path: ReferencePath | None
    corridor: Corridor | None
    area: Area | None = None
    config: ControllerConfig
    views: tuple[CycleView, ...]
    times: Array
    frames: tuple[Frame, ...] = ()

    def at(self, time: float) -> int:
        """Index of the look at `time` [s]: the last one not after it, the first one before all."""
        return max(0, int(np.searchsorted(self.times, time + 1e-9, side="right")) - 1)


def film_of_run(
    result: RunResult,
    observed: Sequence[ObservedCycle],
    *,
    label: str | None = None,
    frames: Sequence[Frame] = (),
) -> Film:
    """The film of a simulated run and what an `Observer`, and its camera, saw of it.

    By default its label is the scenario.

    Raises InputError if there is nothing to be seen, or if it is not of this run.
    """
    times, truth = result.cycles.times, result.truth
    if len(observed) != len(times):
        raise InputError(f"observed has {len(observed)} cycles: must be those of the run, {len(times)}")
    rows = rows_at(truth, times)
    changes = result.besides if result.area is not None else result.corridors
    scenes = np.searchsorted(np.array([start for start, _ in changes]), times + 1e-9, side="right") - 1
    in_area = result.area is not None
    views = tuple(
        view_of(
            one,
            time=float(time),
            pose=truth.poses[row],
            goal=truth.goals[row],
            corridor=one.corridor if in_area or one.planned is not None else result.corridors[scene][1],
            config=result.config,
            obstacles=result.besides[scene][1] if in_area else None,
        )
        for one, time, row, scene in zip(observed, times, rows, scenes, strict=True)
    )
    name = result.title if label is None else label
    corridor = None if in_area else result.corridors[0][1]
    film = _film(name, result.given_path, corridor, result.config, views, area=result.area)
    return replace(film, frames=tuple(frames))


def film_of_recording(
    file: str | PathLike[str], *, progress: Callable[[int, int], None] | None = None
) -> Film:
    """The film of a recording, or of the whole cycles of one that was cut off.

    Commands, plans and times are the recorded ones. A controller is driven along by the recorded inputs for
    what a recording does not hold, slack and weights of the stages; these are left out from where its plan is
    another one. Cycles that raised are left out.

    Args:
        progress: called after each cycle with how many are done, and how many there are.

    Raises:
        RecordingError: the file cannot be read or is no recording.
        InputError: it holds no cycle.
    """
    recording = read_recording(file, allow_truncated=True)
    config, path = recording.header.config, recording.header.path
    driver = recording.header.driver()
    controller = core_of(driver)
    first, views = controller.corridor, list[CycleView]()
    in_area = first.area is not None
    for done, observed in enumerate(_driven_along(driver, recording.cycles), start=1):
        if observed is not None:
            if controller.corridor.area is not None and controller.path is not None:
                observed = replace(observed, path=controller.path, corridor=controller.corridor)
            now = recording.cycles[done - 1].inputs.now
            time = _later(views[-1].time if views else None, now)
            views.append(_measured_view(observed, time, controller.corridor, config))
        if progress is not None:
            progress(done, len(recording.cycles))
    name = Path(file).name if recording.complete else f"{Path(file).name} (truncated)"
    if in_area:
        return _film(name, None, None, config, tuple(views), area=first.area)
    return _film(name, path, first, config, tuple(views))


def _measured_view(
    observed: ObservedCycle, time: float, corridor: Corridor, config: ControllerConfig
) -> CycleView:
    pose = np.array([observed.state.x, observed.state.y, observed.state.phi])
    read_only(pose)
    return view_of(observed, time=time, pose=pose, goal=None, corridor=corridor, config=config)


def _later(last: float | None, now: float) -> float:
    """Recorded clocks may go back or fail: the film's does not."""
    if last is None:
        return now if isfinite(now) else 0.0
    return max(last, now) if isfinite(now) else last


def _driven_along(driver: Driver, cycles: Sequence[Cycle]) -> Iterator[ObservedCycle | None]:
    """What was seen of each recorded cycle, None of one that raised, while the controller makes it again."""
    controller, same = core_of(driver), True
    for cycle in cycles:
        before = controller.state.plans.solution
        replayed, _ = run_cycle(driver, cycle.number, cycle.inputs, PlayedBack(cycle.decisions))
        if cycle.command is None:
            yield None
            continue
        if same and not _alike(cycle.command, replayed.command):
            same = False
            _log.warning(
                "cycle %d is not replayed as it was recorded: slack and weights of the stages are left out "
                "from there on (`rti-mpcc replay` says what differs)",
                cycle.number,
            )
        after = controller.state.plans.solution
        fresh = after if same and after is not before else None
        yield observed_cycle(cycle.inputs.state, cycle.command, fresh)


def _alike(recorded: Command, replayed: Command | None) -> bool:
    if replayed is None or recorded.source is not replayed.source:
        return False
    one, other = recorded.trajectory.states, replayed.trajectory.states
    return one.shape == other.shape and np.allclose(one, other, rtol=REPLAYED, atol=REPLAYED)


def _film(
    label: str,
    path: ReferencePath | None,
    corridor: Corridor | None,
    config: ControllerConfig,
    views: tuple[CycleView, ...],
    area: Area | None = None,
) -> Film:
    if not views:
        raise InputError(f"{label}: has no cycle to show")
    times = np.array([view.time for view in views])
    read_only(times)
    return Film(label=label, path=path, corridor=corridor, area=area, config=config, views=views, times=times)
