"""The paper's own objectives, what its published code adds, and the methods of its comparison (paper IV).

They plug themselves into a controller by `ControllerConfig.objective`, and their segments by
`DockingObjective.segments`; nothing that drives a vehicle imports this package.
"""

from __future__ import annotations

from typing import Any, get_args

from rti_mpcc.config import ControllerConfig, DockingObjective, Weights
from rti_mpcc.errors import InputError
from rti_mpcc.paper.objective import ComparedObjective, PaperObjective, SpeedProfile

__all__ = [
    "METHODS",
    "PRINTED",
    "PUBLISHED",
    "ComparedObjective",
    "PaperObjective",
    "SpeedProfile",
    "with_method",
]

NO_JERK = 1e3  # more than any vehicle has in a cycle: no bound [m/s³]
PRINTED: dict[str, Any] = {
    "weights": Weights(virtual_speed=0.0, comfort=(0.0, 0.0, 0.0)),
    "objective": PaperObjective(),
    "cruise_horizon": 7.0,
    "disturbance": {"enabled": False},
    "vehicle_filter": {"enabled": False},
    "comfort_jerk": NO_JERK,
}
"""Of `ControllerConfig.paper_printed`."""
PUBLISHED = PRINTED | {
    "objective": PaperObjective(
        lateral_acceleration=100.0,
        heading_at_end=10.0,
        terminal_lag=1e3,
        terminal_heading=1e3,
        bound_distance=1e3,
        bound_speed=20.0,
        stage_length=1.0,
        speed_profile=SpeedProfile(),
        reference_turns=False,
    )
}
"""Of `ControllerConfig.paper`."""
CONSTANT_WEIGHTS = {f"constant_{weight}": float(weight) for weight in (1, 50, 100)}
"""Contouring weights that stay the same to the path's end, with no planned arrival."""
METHODS = (*get_args(ComparedObjective.model_fields["method"].annotation), *CONSTANT_WEIGHTS)


def with_method(config: ControllerConfig, name: str) -> ControllerConfig:
    """The settings with a method, by the name that the command line has for it. Raises InputError."""
    if name not in METHODS:
        raise InputError(f"method = {name!r}: must be one of {', '.join(METHODS)}")
    objective = config.objective
    if name in CONSTANT_WEIGHTS:
        weight, paper = CONSTANT_WEIGHTS[name], isinstance(objective, PaperObjective)
        weights = config.weights.changed(contouring=weight, contouring_at_end=weight)
        objective = objective.changed(heading_at_end=0.0) if paper else PaperObjective()
        return config.changed(weights=weights, objective=objective)
    if isinstance(objective, PaperObjective):
        return config.changed(objective=objective.changed(method=name))
    made = DockingObjective() if name == "dynamic" else ComparedObjective().changed(method=name)
    return config if objective == made else config.changed(objective=made)
