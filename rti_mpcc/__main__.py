"""`python -m rti_mpcc` is the command `rti-mpcc`."""

from __future__ import annotations

import sys

from rti_mpcc.cli import main

if __name__ == "__main__":
    sys.exit(main())
