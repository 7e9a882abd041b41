from __future__ import annotations

import pytest

from rti_mpcc import ControllerConfig, InputError
from rti_mpcc.config import Method
from rti_mpcc.simulation.methods import METHODS, with_method


def test_a_method_is_a_setting() -> None:
    config = ControllerConfig.paper()
    assert with_method(config, "dynamic") == config
    assert with_method(config, "separated") == config.model_copy(update={"method": Method.SEPARATED})
    assert with_method(config, "switched").method is Method.SWITCHED


@pytest.mark.parametrize("weight", [1, 50, 100])
def test_constant_weights_are_the_same_everywhere(weight: int) -> None:
    config = with_method(ControllerConfig(), f"constant_{weight}")
    assert config.weights.contouring == config.weights.contouring_at_end == weight
    assert (config.arrival, config.method) == (False, Method.DYNAMIC)
    assert config.weights.lag == ControllerConfig().weights.lag


def test_an_unknown_method_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=rf"'best': must be one of {', '.join(METHODS)}"):
        with_method(ControllerConfig(), "best")
