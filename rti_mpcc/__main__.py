"""The command `rti-mpcc`, also `python -m rti_mpcc`. One line says if the extra `sim` is missing."""

from __future__ import annotations

import sys

from rti_mpcc.errors import MissingExtraError

_BAD_INPUT = 2  # as in rti_mpcc.cli.arguments, which cannot be imported without the extra


def run_command() -> int:
    """Run the command with the arguments of the process and return the exit status."""
    try:
        from rti_mpcc import cli
    except MissingExtraError as error:
        sys.stderr.write(f"rti-mpcc: error: {error}\n")
        return _BAD_INPUT
    return cli.main()


if __name__ == "__main__":
    sys.exit(run_command())
