"""Recordings of a controller's cycles: written as it drives, read again, and replayed without a clock."""

from __future__ import annotations

from rti_mpcc.recording.compare import FieldDifference
from rti_mpcc.recording.contents import Cycle, Header, Inputs, Recording
from rti_mpcc.recording.machine import Machine
from rti_mpcc.recording.problem_file import dump_problem, load_problem
from rti_mpcc.recording.reader import read_recording
from rti_mpcc.recording.recorder import Recorder
from rti_mpcc.recording.replay import Mismatch, ReplayReport, replay

__all__ = [
    "Cycle",
    "FieldDifference",
    "Header",
    "Inputs",
    "Machine",
    "Mismatch",
    "Recorder",
    "Recording",
    "ReplayReport",
    "dump_problem",
    "load_problem",
    "read_recording",
    "replay",
]
