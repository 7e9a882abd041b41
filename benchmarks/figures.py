"""Pure functions on measured values: distributions, targets and whether they were met."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from benchmarks.tables import number, table


@dataclass(frozen=True, slots=True, kw_only=True)
class Distribution:
    """Percentiles and the largest of `count` values, in their unit."""

    count: int
    p50: float
    p95: float
    p99: float
    max: float


def distribution(values: ArrayLike) -> Distribution:
    """Of at least one finite value. Raises ValueError otherwise."""
    data = np.asarray(values, dtype=np.float64).ravel()
    if not data.size or not np.isfinite(data).all():
        raise ValueError(f"a distribution needs finite values, got {data.size}, some perhaps not finite")
    p50, p95, p99 = np.percentile(data, [50.0, 95.0, 99.0]).tolist()
    return Distribution(count=int(data.size), p50=p50, p95=p95, p99=p99, max=float(data.max()))


def distribution_row(name: str, found: Distribution, digits: int = 2) -> list[str]:
    """Name, p50, p95, p99, max, count."""
    values = (found.p50, found.p95, found.p99, found.max)
    return [name, *(number(value, digits) for value in values), str(found.count)]


def ratio_row(name: str, found: Distribution, yardstick: float) -> list[str]:
    """As `distribution_row`, with p50, p95 and p99 as multiples of the yardstick behind the times."""
    values = (found.p50, found.p95, found.p99)
    row = distribution_row(name, found)
    return [*row, *(number(value / yardstick, 2) for value in values)]


@dataclass(frozen=True, slots=True)
class Target:
    """What was promised, and what was measured.

    Attributes:
        name: of the figure, with its unit.
        value: measured; bound: at most this.
        digits: for tables.
        note: what else to know, or "".
    """

    name: str
    value: float
    bound: float
    digits: int = 2
    note: str = ""

    @property
    def met(self) -> bool:
        """A value that is no number is not met."""
        return bool(self.value <= self.bound)

    def told(self) -> dict[str, Any]:
        """For JSON; a value that is not finite is None."""
        value = self.value if np.isfinite(self.value) else None
        return {**asdict(self), "value": value, "met": self.met}


def target_table(targets: list[Target]) -> str:
    rows = []
    for one in targets:
        value = number(one.value, one.digits) if np.isfinite(one.value) else "–"
        verdict = "met" if one.met else "**not met**"
        rows.append([one.name, value, f"≤ {number(one.bound, one.digits)}", verdict, one.note])
    return table(["target", "measured", "bound", "verdict", "remark"], rows)


def relative_change(value: float | None, reference: float | None) -> float:
    """|value / reference − 1|; two values never reached agree, one alone is infinitely far off."""
    if value is None or reference is None:
        return 0.0 if value is None and reference is None else float("inf")
    return abs(value - reference) / abs(reference) if reference else abs(value)
