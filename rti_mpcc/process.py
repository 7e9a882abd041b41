"""The process that cycles run in: nothing is left in it that would make one of them late."""

from __future__ import annotations

import gc


def prepare_process() -> None:
    """Collect garbage now, and leave all objects of now out of later collections (`gc.freeze`).

    Call it once, after the controller is made and before its first cycle. Otherwise Python looks through all
    that the libraries hold during one of the first cycles, which takes about a tenth of a second.

    Garbage collection stays on for all that is made later. What is frozen is released as usual when the last
    reference to it goes. A further call begins anew, so that a process with many controllers, one after the
    other, may call it for each of them: frozen objects that refer to one another are collected then.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()
