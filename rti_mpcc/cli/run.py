"""`rti-mpcc run`: a scenario in closed loop, its table and its files."""

from __future__ import annotations

import argparse
import tomllib
from contextlib import ExitStack
from pathlib import Path
from typing import get_args

from rti_mpcc import config
from rti_mpcc.cli.arguments import DONE, FAILED, Commands, add_folder, add_options, writable_folder
from rti_mpcc.errors import InputError
from rti_mpcc.kernels import make_ready, prepare_process
from rti_mpcc.recording import Recorder
from rti_mpcc.recording.mcap_log import mcap_libraries
from rti_mpcc.report import text
from rti_mpcc.report.files import make_writable, write_extras, write_files
from rti_mpcc.report.ride import CameraFrames, Observer, Ride, ride_of_run
from rti_mpcc.simulation import Scenario, all_succeeded, changed, driver_of, load_scenario, simulate, summary
from rti_mpcc.simulation.goal_feed import GoalSource, source_in
from rti_mpcc.simulation.result import RunResult


def add_run(commands: Commands) -> None:
    """Add `run`."""
    parser = commands.add_parser(
        "run",
        help="run a scenario, print its figures, write its files",
        description="Run a scenario in closed loop, print its figures, and write summary.json, "
        "trajectory.csv, overview.png and timeline.png, on request also page.html, which shows each cycle.",
        # SCENARIO first: after --animate it would be taken for its file.
        usage="%(prog)s [-h] SCENARIO [--method METHOD] [--preset PRESET] [--seed N] [--ride RIDE]\n"
        "                    [--docking-time SECONDS] [--set KEY=VALUE] [--out DIR] [--goal-source SOURCE]\n"
        "                    [--no-plots] [--page] [--mcap FILE] [--animate [FILE]]\n"
        "                    [--record FILE] [--dump-failed DIR]",
        epilog="Exit status: 0 docked, and all steps of its mission succeeded; 1 not docked, or a boundary "
        "was crossed, or a step failed for good; 2 bad input.",
    )
    add_options(parser, "scenario", "--seed", "--method", "--preset")
    rides = "smooth: least acceleration energy, brisk: least time, within comfort; default: the scenario's"
    parser.add_argument("--ride", choices=get_args(config.Ride), help=rides)
    scaled = "duration of the docking, for which the comfort values are scaled"
    parser.add_argument("--docking-time", type=float, metavar="SECONDS", help=scaled)
    parser.add_argument(
        "--set", type=_key, action="append", default=[], metavar="KEY=VALUE",
        help="key of [controller] with a TOML value, such as weights.contouring=5; may be repeated",
    )  # fmt: skip
    add_folder(parser, "runs/<name>")
    sources = [source.value for source in GoalSource]
    known = "filtered detections, the newest detection as it is, or the truth; default: detected"
    parser.add_argument("--goal-source", choices=sources, default=GoalSource.DETECTED.value, help=known)
    add_options(parser, "--no-plots")
    written = "write an animation, .mp4 or .gif; default: animation.mp4, .gif where there is no ffmpeg"
    parser.add_argument("--animate", nargs="?", const="", metavar="FILE", help=written)
    parser.add_argument("--page", action="store_true", help="write page.html, which shows each cycle")
    add_options(parser, "--mcap")
    parser.add_argument("--record", type=Path, metavar="FILE", help="record all cycles, for `replay`, `show`")
    add_options(parser, "--dump-failed")
    parser.set_defaults(command=_run)


def _key(given: str) -> tuple[str, object]:
    """A key and its value, from KEY=VALUE; a word needs no quotes."""
    key, _, value = given.partition("=")
    try:
        return key.strip(), tomllib.loads(f"value = {value}")["value"]
    except tomllib.TOMLDecodeError:
        if value.isidentifier():
            return key.strip(), value
        problem = f"{given!r} must be KEY=VALUE, such as weights.contouring=5"
        raise argparse.ArgumentTypeError(problem) from None


def _run(arguments: argparse.Namespace) -> int:
    scenario = load_scenario(arguments.scenario)
    asked = [("ride", arguments.ride), ("docking_time", arguments.docking_time), *arguments.set]
    if changes := {f"controller.{key}": value for key, value in asked if value is not None}:
        scenario = changed(scenario, changes)
    # simulate() would refuse this, too, but after the folder was made.
    scenario.controller_config(arguments.preset, method=arguments.method)
    detector = scenario.goal.measurement is not None
    source_in(scenario.name, GoalSource(arguments.goal_source), detector=detector)
    if scenario.goal.camera is not None:
        scenario.goal.camera.check()
    if arguments.dump_failed is not None and arguments.record is None:
        raise InputError("--dump-failed needs --record: the recorded cycles are searched for failed ones")
    if arguments.mcap is not None:
        mcap_libraries()
    folder = writable_folder(arguments.out, scenario.name)
    animation = None
    if arguments.animate is not None:
        # Not at the top: matplotlib takes longer to load than a run without pictures needs it.
        from rti_mpcc.report.animation import animation_file

        animation = animation_file(Path(arguments.animate) if arguments.animate else None, folder)
        make_writable(animation.parent)
    result, ride, problem = simulated(scenario, arguments)
    figures = summary(result)
    written = write_files(ride, figures, folder, plots=not arguments.no_plots, page=arguments.page)
    extras = write_extras(ride, arguments.mcap, animation)
    if arguments.record is not None and not problem:
        written.append(arguments.record)
    text.print_tables([text.summary_table(figures)])
    text.print_lines(text.failure_lines(figures.get("mission")))
    text.print_written([*written, *extras])
    if not result.paths:
        text.print_lines([f"{scenario.name}: no route was found: {result.cycles.reason[-1]}"])
    if problem:
        raise OSError(f"{arguments.record}: does not hold the whole run: {problem}")
    whole = all_succeeded(result.mission_result, result.mission)
    crossed = figures["min_clearance_m"] is not None and figures["min_clearance_m"] < 0.0
    return DONE if figures["docked"] and not crossed and whole else FAILED


def simulated(scenario: Scenario, arguments: argparse.Namespace) -> tuple[RunResult, Ride, str]:
    """The run, the same as a ride, and why its recording is not whole, or "" where it is."""
    make_ready(second_process=True)
    source, duration = GoalSource(arguments.goal_source), scenario.simulation.duration
    with ExitStack() as stack:
        core = driver_of(scenario, preset=arguments.preset, method=arguments.method, goal_source=source)
        recorder = camera = None
        if arguments.record is not None:
            arguments.record.parent.mkdir(parents=True, exist_ok=True)
            recorder = Recorder(core, arguments.record, dump_failed=arguments.dump_failed)
            stack.enter_context(recorder)
        if arguments.animate is not None and scenario.goal.camera is not None:
            camera = CameraFrames(scenario.goal.camera)
        observer = Observer(recorder or core)
        prepare_process()
        progress = stack.enter_context(text.progress_bar(scenario.name, "{task.completed:.1f} s"))
        result = simulate(
            scenario,
            preset=arguments.preset,
            method=arguments.method,
            seed=arguments.seed,
            progress=progress and (lambda time: progress(time, duration)),
            controller=observer,
            goal_source=source,
            seen=camera,
        )
    ride = ride_of_run(result, observer.moments, frames=camera.frames if camera else ())
    return result, ride, recorder.problem if recorder else ""
