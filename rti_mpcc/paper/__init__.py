"""The paper's own objectives, what its published code adds, and the methods that it is compared with (paper
IV).

They plug themselves into a controller by `ControllerConfig.objective`, and their segments by
`DockingObjective.segments`; nothing that drives a vehicle imports this package.
"""

from __future__ import annotations

from rti_mpcc.paper.objective import ComparedObjective, PaperObjective, SpeedProfile
from rti_mpcc.paper.presets import METHODS, PRINTED, PUBLISHED, with_method

__all__ = [
    "METHODS",
    "PRINTED",
    "PUBLISHED",
    "ComparedObjective",
    "PaperObjective",
    "SpeedProfile",
    "with_method",
]
