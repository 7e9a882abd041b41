"""Recordings of a controller's cycles: written as it drives, read again, and replayed without a clock."""

from __future__ import annotations

from rti_mpcc.qp.problem import dump_problem, load_problem
from rti_mpcc.recording.contents import Cycle, Header, Inputs, Recording, read_recording
from rti_mpcc.recording.mcap_log import McapLog
from rti_mpcc.recording.recorder import FieldDifference, Mismatch, Recorder, ReplayReport, replay
from rti_mpcc.version import Machine

__all__ = [
    "Cycle",
    "FieldDifference",
    "Header",
    "Inputs",
    "Machine",
    "McapLog",
    "Mismatch",
    "Recorder",
    "Recording",
    "ReplayReport",
    "dump_problem",
    "load_problem",
    "read_recording",
    "replay",
]
