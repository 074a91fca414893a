"""Python's search for cycles of objects, held back where objects are made by the thousand that all stay."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """Without the search, which goes over all of them again and again: a tenth of the time that a stage takes.

    What was made meanwhile counts as old, or the next search would go over all of it at once.
    """
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.unfreeze()
        if searched:
            gc.enable()
