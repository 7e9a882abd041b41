"""The process that cycles run in: its garbage collector must not make a cycle late."""

from __future__ import annotations

import gc


def prepare_process() -> None:
    """Collect garbage once, and exclude all present objects from later collections (`gc.freeze`).

    Call it after the controller is made and before its first cycle. Without it, a collection in one of the
    first drives looks through all objects of the libraries, which takes about a tenth of a second.

    Garbage collection stays on for all objects that are made later. A frozen object is released as usual when
    its last reference goes. A further call starts again: it collects the frozen objects that only refer to
    one another, too. A process may therefore call it for each of many controllers.
    """
    gc.unfreeze()
    gc.collect()
    gc.freeze()
