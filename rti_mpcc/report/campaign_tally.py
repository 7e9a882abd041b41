"""What a campaign has come to so far, as a short table for the terminal."""

from __future__ import annotations

from rich.table import Table

from rti_mpcc.simulation.campaign import CampaignSettings, CaseOutcome, Problems, Tally


def tally_table(settings: CampaignSettings, tally: Tally) -> Table:
    """Cases, how they ended, collisions."""
    of = "scenes, " if settings.problems is Problems.SCENES else ""
    title = f"{of}{settings.level.value}, seed {settings.seed}, {settings.method}, {settings.preset}"
    table = Table(title=title, title_justify="left")
    table.add_column("")
    for column in ("cases", "share"):
        table.add_column(column, justify="right")
    table.add_row("all", str(tally.cases), "")
    for outcome in CaseOutcome:
        if (count := tally.outcomes[outcome]) or outcome is CaseOutcome.DOCKED:
            name = outcome.value.replace("_", " ")
            table.add_row(name, str(count), f"{100.0 * count / max(tally.cases, 1):.1f} %")
    table.add_row("body outside, or in contact", str(tally.collisions), "")
    table.add_row("cycles that drove a refused solution", str(tally.failures_driven), "")
    return table
