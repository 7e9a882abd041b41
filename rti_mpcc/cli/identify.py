"""`rti-mpcc identify`: dead times and lags of drive and steering, from a recording."""

from __future__ import annotations

import argparse
from pathlib import Path

from rti_mpcc.cli.arguments import DONE, Commands, add_folder, writable_folder
from rti_mpcc.recording import read_recording
from rti_mpcc.recording.identify import Identified, identify
from rti_mpcc.report.files import write_json
from rti_mpcc.report.text import tell_lines, tell_written


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
    parser.add_argument("file", metavar="RECORDING", type=Path, help="file of a `Recorder` or `run --record`")
    parser.add_argument("--partial", action="store_true", help="use the whole cycles of a cut-off recording")
    add_folder(parser, "runs/RECORDING")
    parser.set_defaults(command=_identify)


def _identify(arguments: argparse.Namespace) -> int:
    from rti_mpcc.report import draw
    from rti_mpcc.report.timeline import actuators_figure

    found = identify(read_recording(arguments.file, allow_truncated=arguments.partial))
    folder = writable_folder(arguments.out, arguments.file.stem)
    written = [folder / "identified.json", folder / "identified.png"]
    write_json(found.figures(), written[0])
    draw.save(actuators_figure(arguments.file.name, found), written[1])
    tell_lines(_lines(found))
    tell_written(written)
    return DONE


def _lines(found: Identified) -> list[str]:
    """Both fits, and the settings that follow, for Python and for scenario files."""
    lines = []
    for name, fit in (("drive", found.drive), ("steering", found.steering)):
        if fit is None:
            lines.append(f"{name}: changes too little to be fitted")
            continue
        interface = "set-points" if fit.by_setpoints else "rates"
        lines.append(
            f"{name}: dead time {fit.dead_time:.3f} ± {fit.stds[0]:.3f} s, lag {fit.lag:.3f} ± "
            f"{fit.stds[1]:.3f} s, gain {fit.gain:.2f}; it follows the {interface}"
        )
    settings = ", ".join(f"{name}={value}" for name, value in found.model.model_dump().items())
    lines.append(f"ControllerConfig(actuators=ActuatorModel({settings}))")
    return lines
