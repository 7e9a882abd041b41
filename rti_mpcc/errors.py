"""Exceptions raised on purpose; all derive from `RtiMpccError`, bad input also from `ValueError`."""

from __future__ import annotations

from geometry.errors import BAD_INPUT as BAD_INPUT
from geometry.errors import ConfigError as ConfigError
from geometry.errors import CorridorError as CorridorError
from geometry.errors import InputError as InputError
from geometry.errors import MissingExtraError as MissingExtraError
from geometry.errors import PathError as PathError
from geometry.errors import RtiMpccError as RtiMpccError


class ScenarioError(InputError):
    """A scenario file cannot be read, or says something that is not allowed."""


class RecordingError(InputError):
    """A recording cannot be read: it is none, not whole, changed, or from another version."""


class CampaignError(RtiMpccError):
    """A campaign cannot go on: its cluster is gone, or workers cannot be started. What is done is kept."""
