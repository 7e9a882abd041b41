"""The sections on a whole campaign: in short, its figures, against difficulty, its settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import degrees
from typing import Any, NamedTuple

from rti_mpcc.report.axes import png
from rti_mpcc.report.campaign.columns import Campaign
from rti_mpcc.report.campaign.difficulty import Bin, Scale, bins, varying
from rti_mpcc.report.campaign.difficulty_picture import success_figure, time_figure
from rti_mpcc.report.campaign.figures import time_over_yardstick
from rti_mpcc.report.campaign.losses import losses_table
from rti_mpcc.report.campaign.spread_picture import spread_figure
from rti_mpcc.report.content import Block, Picture, Section, Table, found, say
from rti_mpcc.report.numbers import counted, number

_READING = (
    "A case is docked when the vehicle stands inside the goal tolerance for 0.5 s and still does at the end, "
    "and the controller says so by then; where it does not within 5 s, the case is unconfirmed. "
    "The interval of a rate is the 95 % interval by Clopper and Pearson: it holds the true rate at least 95 "
    "times in 100. A collision is a body that left the corridor or met an obstacle at any time, docked or "
    "not. The yardstick of times is 2 √((c + 1) D / a): the way D, the length of the route and the goal "
    "behind its end, cut into equal parts by its c cusps, straight, from rest to rest at the comfort "
    "acceleration a and without a limit on speed. It makes long and short ways comparable and is the same "
    "for all methods; it is no bound. Times and final errors are of the cases that docked."
)
_BINNED = (
    "Bins hold about as many cases each, or one value where there are few; only what differs between cases "
    "is shown. All else varies too within a bin, so a slope says where to look, not why."
)


class Against(NamedTuple):
    """The section on one kind of difficulty, and the same for JSON."""

    section: Section
    told: dict[str, Any]


def in_short(figures: Mapping[str, Any]) -> list[str]:
    """The outcome in a few sentences, for page and terminal."""
    low, high = figures["success_interval"]
    lost = {name: count for name, count in figures["outcomes"].items() if count and name != "docked"}
    others = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in lost.items())
    turns, unknown = figures["direction_changes_beyond_cusps"], figures["collisions_unknown"]
    told = [
        f"{figures['outcomes']['docked']} of {figures['cases']} cases docked: "
        f"{percent(figures['success_rate'])} (95 % interval {percent(low)} to {percent(high)})"
        + (f"; {others}." if others else "."),
        counted(figures["collisions"], "collision")
        + (f" (of {counted(unknown, 'case')} it is not known)" if unknown else "")
        + f"; least clearance {number(figures['min_clearance_m'], 3)} m, 5 % of the cases have less than "
        f"{number(figures['clearance_p5_m'], 3)} m.",
        f"Time to dock {number(figures['time_to_dock_p50'], 2)} s in the median, "
        f"{number(figures['time_to_dock_p95'], 2)} s at p95.",
        f"Refused QPs: {_in_cases(figures['solver_failures'], figures['solver_failure_cases'])}, of which "
        f"{figures['failures_driven']} were driven all the same. Fallback: "
        f"{_in_cases(figures['fallback_cycles'], figures['fallback_cases'])}. Changes of direction beyond "
        f"the cusps: {turns['total']}, in {counted(turns['cases'], 'case')}.",
    ]
    return [*_not_whole(figures), *told]


def _in_cases(cycles: int, cases: int) -> str:
    return f"{counted(cycles, 'cycle')} in {counted(cases, 'case')}"


def _not_whole(figures: Mapping[str, Any]) -> list[str]:
    told = []
    if not figures["finished"]:
        told.append(
            f"The campaign is not finished: {figures['cases']} of {figures['cases_asked']} cases are driven. "
            "All that follows is of these."
        )
    if figures["torn_line"]:
        told.append("The last line of rows.jsonl is not whole and left out.")
    if figures["repeated_lines"]:
        told.append(
            f"Left out because their case was there already: {counted(figures['repeated_lines'], 'line')}."
        )
    return told


def short_section(campaign: Campaign, figures: Mapping[str, Any]) -> Section:
    """What stands first."""
    settings = campaign.settings
    asked = (
        f"Campaign {campaign.name}: level {settings['level']}, seed {settings['seed']}, method "
        f"`{settings['method']}`, preset `{settings['preset']}`."
    )
    return Section(
        name="short", title="In short", blocks=[say(asked), *map(found, in_short(figures)), say(_READING)]
    )


def outcome_section(campaign: Campaign, figures: Mapping[str, Any]) -> Section:
    """All figures of the campaign."""
    picture = Picture(
        name="spread",
        png=png(spread_figure(campaign)),
        caption="How times, times over their yardstick, and least clearances spread over the cases. Times "
        "are of the cases that docked.",
        told="Three histograms: time to dock, time to dock over its yardstick, least clearance.",
    )
    return Section(
        name="outcomes",
        title="Outcomes",
        blocks=[
            _outcomes(figures),
            *([losses_table(figures["losses"])] if figures["losses"] else []),
            overall_table(figures),
            picture,
            _statuses(figures),
        ],
    )


def _outcomes(figures: Mapping[str, Any]) -> Table:
    return Table(
        caption="What became of the cases.",
        heads=("outcome", "cases", "share [%]"),
        rows=[
            [name.replace("_", " "), str(count), number(100.0 * count / figures["cases"], 2)]
            for name, count in figures["outcomes"].items()
        ],
    )


def overall_table(figures: Mapping[str, Any]) -> Table:
    """The figures of the campaign, one a row."""
    low, high = figures["success_interval"]
    return Table(
        caption="The campaign as a whole.",
        heads=("figure", "value"),
        rows=[
            ["cases", str(figures["cases"])],
            [
                "docked, 95 % interval",
                f"{percent(figures['success_rate'])} ({percent(low)} to {percent(high)})",
            ],
            ["collisions", str(figures["collisions"])],
            ["least clearance / p5 / median [m]", _three(figures, _CLEARANCE, 3)],
            ["time to tolerance p50 / p95 / largest [s]", _three(figures, "time_to_tolerance", 2)],
            ["time to dock p50 / p95 / largest [s]", _three(figures, "time_to_dock", 2)],
            ["time over its yardstick p50 / p95 / largest", _three(figures, "time_over_yardstick", 2)],
            *_error_rows(figures["final_error"]),
            ["solver failures, cycles / cases", _two(figures, "solver_failures", "solver_failure_cases")],
            ["refused results that were driven", str(figures["failures_driven"])],
            ["fallback cycles / cases", _two(figures, "fallback_cycles", "fallback_cases")],
            [
                "changes of direction beyond the cusps / cases",
                _two(figures["direction_changes_beyond_cusps"], "total", "cases"),
            ],
            *_energy_rows(figures["energy_to_dock"]),
        ],
    )


_CLEARANCE = ("min_clearance_m", "clearance_p5_m", "clearance_p50_m")


def _three(figures: Mapping[str, Any], names: str | Sequence[str], digits: int) -> str:
    keys = [f"{names}_{end}" for end in ("p50", "p95", "max")] if isinstance(names, str) else names
    return " / ".join(number(figures[key], digits) for key in keys)


def _two(figures: Mapping[str, Any], one: str, other: str) -> str:
    return f"{figures[one]} / {figures[other]}"


def _error_rows(errors: Mapping[str, Mapping[str, float | None]]) -> list[list[str]]:
    units = {"longitudinal_m": ("longitudinal", "mm", 1e3), "lateral_m": ("lateral", "mm", 1e3)}
    units["heading_rad"] = ("heading", "deg", degrees(1.0))
    rows = []
    for name, (words, unit, factor) in units.items():
        values = (errors[name][key] for key in ("p50", "p95", "max"))
        told = " / ".join(number(None if value is None else factor * value, 2) for value in values)
        rows.append([f"final error, {words} p50 / p95 / largest [{unit}]", told])
    return rows


def _energy_rows(energies: Mapping[str, Mapping[str, float | None]]) -> list[list[str]]:
    signs = {"acceleration": "∫a² [m²/s³]", "steering_rate": "∫δ̇² [rad²/s]"}
    signs["lateral_acceleration"] = "∫a_lat² [m²/s³]"
    return [
        [
            f"energy to dock {sign} p50 / p95",
            " / ".join(number(energies[name][key], 2) for key in ("p50", "p95")),
        ]
        for name, sign in signs.items()
    ]


def _statuses(figures: Mapping[str, Any]) -> Table:
    counts = figures["cycles_by_status"]
    total = max(sum(counts.values()), 1)
    return Table(
        caption="How many control cycles had which status.",
        heads=("status", "cycles", "share [%]"),
        rows=[[name, str(count), number(100.0 * count / total, 2)] for name, count in counts.items()],
    )


def difficulty_section(
    campaign: Campaign, scales: Sequence[Scale], *, name: str, title: str
) -> Against | None:
    """Success and time over the scales that vary; None where none does."""
    over_yardstick = time_over_yardstick(campaign)
    shown = [(scale, bins(campaign, scale, over_yardstick)) for scale in varying(campaign, scales)]
    if not shown:
        return None
    pictures = (
        ("docked", "Share of the cases that docked", png(success_figure(campaign, shown))),
        ("time", "Time to dock", png(time_figure(shown))),
    )
    blocks: list[Block] = [say(_BINNED)]
    blocks += [
        Picture(
            name=f"{name}_{kind}",
            png=drawn,
            caption=f"{words} over {title.lower().removeprefix('against ')}.",
            told=f"{words}, one panel a scale; the table below has the same numbers.",
        )
        for kind, words, drawn in pictures
    ]
    blocks.append(_bins_table(shown))
    told = {scale.column: [one.told() for one in parts] for scale, parts in shown}
    return Against(Section(name=name, title=title, blocks=blocks), told)


def _bins_table(shown: Sequence[tuple[Scale, Sequence[Bin]]]) -> Table:
    rows = [
        [
            scale.label if place == 0 else "",
            _range(one, scale.digits),
            str(one.cases),
            str(one.docked),
            str(one.collisions),
            percent(one.rate),
            f"{percent(one.interval[0])} to {percent(one.interval[1])}",
            number(one.time["p25"], 1),
            number(one.time["p50"], 1),
            number(one.time["p75"], 1),
            number(one.over_yardstick, 2),
        ]
        for scale, parts in shown
        for place, one in enumerate(parts)
    ]
    heads = ("over", "from, to", "cases", "docked", "collisions", "rate", "95 % interval")
    return Table(
        caption="The same as numbers; in the last column the median time over its yardstick.",
        heads=(*heads, "to dock p25 [s]", "p50 [s]", "p75 [s]", "over yardstick"),
        rows=rows,
    )


def _range(one: Bin, digits: int) -> str:
    low, high = number(one.low, digits), number(one.high, digits)
    return low if low == high else f"{low} … {high}"


def settings_section(settings: Mapping[str, Any]) -> Section:
    """What the campaign was driven with."""
    rows = [
        [f"`{name}`", ", ".join(f"{key} {one}" for key, one in value.items() if one)]
        if isinstance(value, Mapping)
        else [f"`{name}`", str(value)]
        for name, value in settings.items()
    ]
    table = Table(caption="Settings.", heads=("setting", "value"), rows=rows, worded=(1,), sentences=(1,))
    return Section(name="settings", title="What was driven", blocks=[table])


def percent(share: float) -> str:
    """A share in percent; nothing but the whole is rounded to 100 %, nothing but none to 0."""
    told = number(100.0 * share, 2)
    if share < 1.0 and told == "100.00":
        return "99.99 %"
    return "0.01 %" if share > 0.0 and told == "0.00" else f"{told} %"
