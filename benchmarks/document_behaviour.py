"""Write the diagram and the tables of docs/behaviour.md from the code.

    python -m benchmarks.document_behaviour

A test compares the page with what this would write.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.tables import ROOT, command_line, replace_block
from rti_mpcc.course.transitions import Event
from rti_mpcc.state import Phase
from rti_mpcc.types import Reason

PAGE = ROOT / "docs" / "behaviour.md"


def diagram() -> str:
    """The transitions as a Mermaid diagram; those from everywhere are left to the table."""
    events: dict[tuple[Phase, Phase], list[str]] = {}
    for row in Event:
        for source in row.sources if len(row.sources) < len(Phase) else ():
            if source is not row.to:
                events.setdefault((source, row.to), []).append(row.name)
    edges = [
        f"    {source.name} --> {to.name}: {'<br>'.join(names)}" for (source, to), names in events.items()
    ]
    return "\n".join(["```mermaid", "stateDiagram-v2", f"    [*] --> {Phase.STARTING.name}", *edges, "```"])


def transitions() -> str:
    """The transitions as a table, in the order in which they are looked for."""
    rows = [["in", "event", "", "to", "found by"], ["---"] * 5]
    rows += [[_sources(row), row.name, row.value, row.to.name, _found_by(row)] for row in Event]
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def statuses() -> str:
    """Reasons with their messages and statuses."""
    rows = [["reason", "message", "status"], ["---"] * 3]
    for reason in Reason:
        told = "FOLLOWING or ARRIVING" if reason.status is None else reason.status.name
        rows.append([reason.name, reason.message.replace("{}", "…") or "–", told])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


BLOCKS = {
    "diagram": diagram,
    "transitions": transitions,
    "statuses": statuses,
}


def write(page: Path = PAGE) -> None:
    """Replace the blocks of the page."""
    for name, text in BLOCKS.items():
        replace_block(page, name, text())


def _sources(row: Event) -> str:
    return "any" if len(row.sources) == len(Phase) else ", ".join(source.name for source in row.sources)


def _found_by(row: Event) -> str:
    return "reported" if row.when is None else f"`{row.when.__name__}`"


if __name__ == "__main__":
    command_line(__doc__, "python -m benchmarks.document_behaviour").parse_args()
    write()
