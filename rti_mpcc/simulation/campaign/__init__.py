"""Campaigns: many drawn docking problems at a level of difficulty, driven by whatever cores there are."""

from __future__ import annotations

from rti_mpcc.simulation.campaign.case import CampaignCase, Problems, drive_case
from rti_mpcc.simulation.campaign.engine import Engine, ProcessEngine
from rti_mpcc.simulation.campaign.levels import DisturbanceRange, Level, at_level
from rti_mpcc.simulation.campaign.row import (
    CampaignRow,
    CaseOutcome,
    CourseFigures,
    DisturbanceFigures,
    Lines,
    SceneFigures,
)
from rti_mpcc.simulation.campaign.rows_file import RowsFile, Tally, read_rows, read_times
from rti_mpcc.simulation.campaign.runner import run_campaign
from rti_mpcc.simulation.campaign.settings import CampaignSettings, read_settings

__all__ = [
    "CampaignCase",
    "CampaignRow",
    "CampaignSettings",
    "CaseOutcome",
    "CourseFigures",
    "DisturbanceFigures",
    "DisturbanceRange",
    "Engine",
    "Level",
    "Lines",
    "Problems",
    "ProcessEngine",
    "RowsFile",
    "SceneFigures",
    "Tally",
    "at_level",
    "drive_case",
    "read_rows",
    "read_settings",
    "read_times",
    "run_campaign",
]
