"""A mission of some seconds."""

from __future__ import annotations

from rti_mpcc.simulation import Scenario, scenario_from_dict

BODY = [[-4.0, -1.0], [-2.0, -1.0], [-2.0, 1.0], [-4.0, 1.0]]


def short(**changes: object) -> Scenario:
    """Two metres in reverse to a dock, a wait, and on to the contact."""
    data = {
        "name": "short",
        "start": {"pose": [3.0, 0.0, 0.0]},
        "area": {"boundary": [[-8.0, -6.0], [14.0, -6.0], [14.0, 6.0], [-8.0, 6.0]]},
        "goal": {"pose": [0.0, 0.0, 0.0], "body": BODY},
        "simulation": {"cycle": 0.05, "dead_time": 0.1, "duration": 60.0},
        "mission": [
            {"kind": "dock"},
            {"kind": "wait", "seconds": 1.0},
            {"kind": "straight", "distance": -1.22, "contact": True},
        ],
    }
    return scenario_from_dict({**data, **changes})
