"""The methods that are compared, by the names that the command line has for them."""

from __future__ import annotations

from rti_mpcc.config import ControllerConfig, Method
from rti_mpcc.errors import InputError

CONSTANT = {f"constant_{weight}": float(weight) for weight in (1, 50, 100)}
"""Contouring weights that stay the same to the path's end, with no planned arrival."""
METHODS = (*(method.value for method in Method), *CONSTANT)


def with_method(config: ControllerConfig, name: str) -> ControllerConfig:
    """The settings with a method. Raises InputError for an unknown one."""
    if name not in METHODS:
        raise InputError(f"method = {name!r}: must be one of {', '.join(METHODS)}")
    if name not in CONSTANT:
        return config.model_copy(update={"method": Method(name)})
    same = {"contouring": CONSTANT[name], "contouring_at_end": CONSTANT[name], "heading_at_end": 0.0}
    weights = config.weights.model_copy(update=same)
    return config.model_copy(update={"weights": weights, "arrival": False})
