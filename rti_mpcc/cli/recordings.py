"""`rti-mpcc replay`, `show` and `identify`: a recording compared, shown, or fitted."""

from __future__ import annotations

import argparse
from contextlib import suppress
from math import inf
from pathlib import Path

from rti_mpcc.cli.arguments import DONE, FAILED, Commands, add_folder, add_options, writable_folder
from rti_mpcc.recording import read_recording, replay
from rti_mpcc.recording.identify import identify
from rti_mpcc.recording.mcap_log import mcap_libraries
from rti_mpcc.report import text
from rti_mpcc.report.files import write_extras, write_files, write_json
from rti_mpcc.report.recorded import recorded_summary
from rti_mpcc.report.ride import ride_of_recording


def add_replay(commands: Commands) -> None:
    """Add `replay`."""
    parser = commands.add_parser(
        "replay",
        help="run the controller on a recording and compare",
        description="Drive the controller with the inputs of a recording, and print the first cycle that "
        "differs from the recorded one.",
        epilog="Exit status: 0 identical, 1 a difference, 2 bad input.",
    )
    parser.add_argument("file", metavar="FILE", type=Path, help="file of `run --record`")
    usual = "tolerated difference; 0: bit for bit; "
    usual += "default: 0 on the machine and versions of the recording, 1e-9 elsewhere"
    parser.add_argument("--tolerance", type=_tolerance, metavar="X", help=usual)
    add_options(parser, "--partial", "--dump-failed")
    parser.set_defaults(command=_replay)


def _tolerance(given: str) -> float:
    with suppress(ValueError):
        if 0.0 <= (value := float(given)) < inf:
            return value
    raise argparse.ArgumentTypeError(f"{given!r} must be a number >= 0")


def _replay(args: argparse.Namespace) -> int:
    with text.progress_bar(args.file.name, "cycle {task.completed:.0f}") as progress:
        report = replay(
            args.file,
            tolerance=args.tolerance,
            allow_truncated=args.partial,
            dump_failed=args.dump_failed,
            progress=progress,
        )
    text.print_lines(text.replay_lines(report))
    return DONE if report.identical else FAILED


def add_show(commands: Commands) -> None:
    """Add `show`."""
    parser = commands.add_parser(
        "show",
        help="write figures, pictures and a page of a recording",
        description="Write what `run` writes, of a recording of `run --record` or of your own loop: "
        "summary.json, trajectory.csv, overview.png, timeline.png and page.html. A truncated recording is "
        "shown as far as it goes.",
        epilog="Exit status: 0 written, 2 bad input.",
    )
    add_options(parser, "recording")
    add_folder(parser, "runs/RECORDING")
    add_options(parser, "--no-plots", "--mcap")
    moving = "write an animation, .mp4 or .gif"
    parser.add_argument("--animation", type=Path, metavar="FILE", help=moving)
    parser.set_defaults(command=_show)


def _show(args: argparse.Namespace) -> int:
    if args.mcap is not None:
        mcap_libraries()
    with text.progress_bar(args.recording.name, "cycle {task.completed:.0f}") as progress:
        ride = ride_of_recording(args.recording, progress=progress)
    figures = recorded_summary(ride)
    folder = writable_folder(args.out, args.recording.stem)
    written = write_files(ride, figures, folder, plots=not args.no_plots, page=True)
    written += write_extras(ride, args.mcap, args.animation)
    text.print_tables([text.recorded_table(figures)])
    text.print_written(written)
    return DONE


def add_identify(commands: Commands) -> None:
    """Add `identify`."""
    parser = commands.add_parser(
        "identify",
        help="fit dead times and lags of drive and steering to a recording",
        description="Fit dead time and lag of drive and steering to the commands and measurements of a "
        "recording. Prints the settings, and writes identified.json and identified.png. The drive should "
        "have starts, stops and bends; it needs no dock.",
        epilog="Exit status: 0 fitted, 2 bad input.",
    )
    add_options(parser, "recording", "--partial")
    add_folder(parser, "runs/RECORDING")
    parser.set_defaults(command=_identify)


def _identify(args: argparse.Namespace) -> int:
    # Not at the top: matplotlib takes long to load.
    from rti_mpcc.report import draw
    from rti_mpcc.report.timeline import actuators_figure

    found = identify(read_recording(args.recording, allow_truncated=args.partial))
    folder = writable_folder(args.out, args.recording.stem)
    written = [folder / "identified.json", folder / "identified.png"]
    write_json(found.figures(), written[0])
    draw.save(actuators_figure(args.recording.name, found), written[1])
    for name, fit in (("drive", found.drive), ("steering", found.steering)):
        if fit is None:
            text.print_lines([f"{name}: changes too little to be fitted"])
            continue
        interface = "set-points" if fit.by_setpoints else "rates"
        dead_time = f"dead time {fit.dead_time:.3f} ± {fit.stds[0]:.3f} s"
        lag = f"lag {fit.lag:.3f} ± {fit.stds[1]:.3f} s"
        text.print_lines([f"{name}: {dead_time}, {lag}, gain {fit.gain:.2f}; it follows the {interface}"])
    settings = ", ".join(f"{name}={value}" for name, value in found.model.model_dump().items())
    text.print_lines([f"ControllerConfig(actuators=ActuatorModel({settings}))"])
    text.print_written(written)
    return DONE
