"""The gate of the goal filter is the quantile of a chi-square with three degrees of freedom, (E4)."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from estimation import GoalFilterConfig, GoalMeasurement, GoalPoseFilter, Judgement, Outcome

Array = NDArray[np.float64]
COVARIANCE = np.diag([0.05**2, 0.03**2, 0.02**2])


def judged(offset: Array, share: float) -> Judgement:
    """What becomes of a detection `offset` (3,) standard deviations from a known goal; `share`: the gate."""
    known = GoalPoseFilter(GoalFilterConfig(gate=share))
    for k in range(10):
        known.update(GoalMeasurement(stamp=0.1 * k, x=1.0, y=2.0, phi=0.3, covariance=COVARIANCE))
    x, y, phi = np.array([1.0, 2.0, 0.3]) + offset * np.sqrt(np.diag(COVARIANCE))
    return known.update(GoalMeasurement(stamp=1.0, x=x, y=y, phi=phi, covariance=COVARIANCE))


@pytest.mark.parametrize("share", [0.9, 0.99, 0.999])
@pytest.mark.parametrize("direction", [(1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (0.6, -0.5, 0.6)])
def test_a_detection_passes_the_gate_up_to_the_quantile(
    share: float, direction: tuple[float, float, float]
) -> None:
    unit, quantile = np.array(direction), float(chi2.ppf(share, 3))
    nis = judged(unit, share).nis
    assert nis is not None
    far = np.sqrt(quantile / nis)
    inside, outside = judged(0.99 * far * unit, share), judged(1.01 * far * unit, share)
    assert (inside.outcome, outside.outcome) == (Outcome.ACCEPTED, Outcome.REJECTED)
    assert inside.nis == pytest.approx(0.99**2 * quantile)
