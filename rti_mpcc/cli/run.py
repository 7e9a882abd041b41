"""`rti-mpcc run`: a scenario in closed loop, its table and its files."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple, get_args

from rti_mpcc.cli.arguments import DOCKED, NOT_DOCKED, Commands, add_dump_failed, seed
from rti_mpcc.config import Ride
from rti_mpcc.errors import InputError
from rti_mpcc.paper import METHODS
from rti_mpcc.process import prepare_process
from rti_mpcc.recording import Recorder
from rti_mpcc.report.camera_frames import CameraFrames, Frame
from rti_mpcc.report.console import progress_bar, tell_lines, tell_run
from rti_mpcc.report.files import make_writable, write_files
from rti_mpcc.report.views import ObservedCycle, Observer
from rti_mpcc.simulation import (
    Controller,
    GoalSource,
    RunResult,
    Scenario,
    changed,
    driver_of,
    load_scenario,
    simulate,
    summary,
)
from rti_mpcc.simulation.goal_feed import source_in
from rti_mpcc.simulation.mission import all_succeeded
from rti_mpcc.simulation.scenario import PRESETS


def add_to(commands: Commands) -> None:
    """Add the command."""
    run = commands.add_parser(
        "run",
        help="run a scenario, print its figures, write its files",
        description="Run a scenario in closed loop, print its figures, and write summary.json, "
        "trajectory.csv, overview.png and timeline.png.",
        # SCENARIO first: after --animate it would be taken for its file.
        usage="%(prog)s [-h] SCENARIO [--method METHOD] [--preset PRESET] [--seed N]\n"
        "                    [--ride RIDE] [--docking-time SECONDS] [--out DIR] [--goal-source SOURCE]\n"
        "                    [--no-plots]\n"
        "                    [--animate [FILE]] [--record FILE] [--dump-failed DIR]",
        epilog="Exit status: 0 docked, and all steps of its mission succeeded, 1 not docked, or a boundary "
        "was crossed, or a step failed for good, 2 bad input.",
    )
    run.add_argument("scenario", metavar="SCENARIO", help="name of a built-in scenario, or a .toml file")
    run.add_argument("--seed", type=seed, default=0, metavar="N", help="of all noise; default: %(default)s")
    add_run_options(run)
    run.set_defaults(command=_run)


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """What can be asked for of one run besides its scenario and seed."""
    parser.add_argument("--method", choices=METHODS, default="dynamic", help="default: %(default)s")
    parser.add_argument("--preset", choices=PRESETS, default="default", help="default: %(default)s")
    parser.add_argument(
        "--ride",
        choices=get_args(Ride),
        help="smooth: least acceleration energy, brisk: least time, within comfort; default: what the "
        "scenario says, else smooth",
    )
    parser.add_argument(
        "--docking-time",
        type=float,
        metavar="SECONDS",
        help="how long the docking shall take: the comfort values are scaled so that it is expected to",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="where files go; default: runs/<name>")
    parser.add_argument(
        "--goal-source",
        choices=[source.value for source in GoalSource],
        default=GoalSource.DETECTED.value,
        help="what tells the goal in a scenario with [goal.measurement]: filtered detections, the newest "
        "detection as it is, or the truth; default: %(default)s",
    )
    parser.add_argument("--no-plots", action="store_true", help="write no pictures")
    parser.add_argument(
        "--animate",
        nargs="?",
        const="",
        metavar="FILE",
        help="write a moving picture, .mp4 or .gif; default: animation.mp4 beside the other files, .gif "
        "where ffmpeg is not installed",
    )
    parser.add_argument("--record", type=Path, metavar="FILE", help="record all cycles, for `replay`")
    add_dump_failed(parser)


def _run(arguments: argparse.Namespace) -> int:
    return run_scenario(load_scenario(arguments.scenario), arguments)


def run_scenario(scenario: Scenario, arguments: argparse.Namespace) -> int:
    """Run it by the options of `add_run_options` and a seed, tell and write; the exit status."""
    if arguments.ride is not None:
        scenario = changed(scenario, {"controller.ride": arguments.ride})
    if arguments.docking_time is not None:
        scenario = changed(scenario, {"controller.docking_time": arguments.docking_time})
    # simulate() would find what is wrong, too, but after the folder was made.
    scenario.controller_config(arguments.preset, method=arguments.method)
    source_in(
        scenario.name,
        GoalSource(arguments.goal_source),
        detector=scenario.goal.measurement is not None,
    )
    if scenario.goal.camera is not None:
        scenario.goal.camera.check()
    if arguments.dump_failed is not None and arguments.record is None:
        raise InputError("--dump-failed needs --record: what is recorded is looked through for failed cycles")
    folder = arguments.out if arguments.out is not None else Path("runs") / scenario.name
    animation = _animation(arguments.animate, folder)
    for place in [folder, *(file.parent for file in animation)]:
        make_writable(place)
    result, observed, frames, problem = simulated(scenario, arguments)
    figures = summary(result)
    written = write_files(result, figures, folder, plots=not arguments.no_plots)
    for file in animation:
        _animate(result, observed, frames, file)
    if arguments.record is not None and not problem:
        written = (*written, arguments.record)
    written = (*written, *animation)
    tell_run(figures, written)
    if result.planning is not None and not result.paths:
        tell_lines([f"{scenario.name}: no way was found: {result.cycles.reason[-1]}"])
    if problem:
        raise OSError(f"{arguments.record}: does not hold the whole run: {problem}")
    whole = all_succeeded(result.mission_result, result.mission)
    crossed = figures["min_clearance_m"] is not None and figures["min_clearance_m"] < 0.0
    return DOCKED if figures["docked"] and not crossed and whole else NOT_DOCKED


def _animation(asked: str | None, folder: Path) -> tuple[Path, ...]:
    """The animation to write, if one is asked for: "" leaves the name open. Raises InputError."""
    if asked is None:
        return ()
    # Not at the top: matplotlib takes longer to load than a run without pictures needs it.
    from rti_mpcc.report.animation import animation_file

    return (animation_file(Path(asked) if asked else None, folder),)


def _animate(
    result: RunResult, observed: Sequence[ObservedCycle], frames: Sequence[Frame], file: Path
) -> None:
    from rti_mpcc.report.animation import animate_run

    with progress_bar(file.name, "{task.completed:.1f} s") as progress:
        animate_run(result, observed, file, frames=frames, progress=progress)


class Simulated(NamedTuple):
    """A run, what was seen of its cycles, and by its camera; why its recording is not whole, or ""."""

    result: RunResult
    observed: Sequence[ObservedCycle]
    frames: Sequence[Frame]
    problem: str


def simulated(scenario: Scenario, arguments: argparse.Namespace) -> Simulated:
    """The run, recorded and looked at if that is asked for."""
    source, duration = GoalSource(arguments.goal_source), scenario.simulation.duration
    with ExitStack() as stack:
        core = driver_of(scenario, preset=arguments.preset, method=arguments.method, goal_source=source)
        controller: Controller = core
        observer = camera = recorder = None
        if arguments.record is not None:
            arguments.record.parent.mkdir(parents=True, exist_ok=True)
            recorder = Recorder(core, arguments.record, dump_failed=arguments.dump_failed)
            controller = stack.enter_context(recorder)
        if arguments.animate is not None:
            controller = observer = Observer(controller)
            if scenario.goal.camera is not None:
                camera = CameraFrames(scenario.goal.camera)
        prepare_process()
        progress = stack.enter_context(progress_bar(scenario.name, "{task.completed:.1f} s"))
        result = simulate(
            scenario,
            preset=arguments.preset,
            method=arguments.method,
            seed=arguments.seed,
            progress=progress and (lambda time: progress(time, duration)),
            controller=controller,
            goal_source=source,
            seen=camera,
        )
    return Simulated(
        result=result,
        observed=observer.observed if observer else (),
        frames=camera.frames if camera else (),
        problem=recorder.problem if recorder else "",
    )
