"""Table I of the paper beside the settings of the preset `paper`."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

from benchmarks.reproduction.content import Section, Table, say
from benchmarks.reproduction.published import published
from rti_mpcc.config import ControllerConfig

_SAID = (
    "The preset `paper` has the values of Table I and the terms that the published code adds to the "
    "printed equations; `paper_printed` has the printed equations alone (what they do: docs/decisions). "
    "Values are read from the published code or the paper on the left, from "
    "`ControllerConfig.paper()` on the right. γ is printed in the paper as a weight of −100 on the virtual "
    "speed. A dash: not in Table I, and the published code has it besides. What has no row because it is no "
    "number: the body is kept in the corridor by half-planes here, the rear axle by the two weights of a "
    "bound in the published code."
)


def parameters_section() -> Section:
    """The table."""
    config = ControllerConfig.paper()
    rows, figures = [], {}
    for parameter in published()["parameters"]:
        value = attrgetter(parameter["setting"])(config)
        figures[parameter["setting"]] = value
        rows.append(
            [
                parameter["name"],
                parameter.get("paper", "–"),
                parameter.get("code", "as the paper"),
                _shown(value),
                f"`{parameter['setting']}`",
            ]
        )
    table = Table(
        caption="Parameters.",
        heads=["parameter", "paper, Table I", "published code", "here, preset `paper`", "setting"],
        rows=rows,
        worded=[4],
    )
    return Section(name="parameters", title="Parameters", blocks=[say(_SAID), table], figures=figures)


def _shown(value: Any) -> str:
    if isinstance(value, tuple):
        return ", ".join(map(_shown, value))
    if value >= 1e3:
        base, exponent = f"{value:e}".split("e")
        return f"{float(base):g}e{int(exponent)}"
    return f"{value:g}"
