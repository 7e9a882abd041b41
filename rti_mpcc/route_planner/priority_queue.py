"""Memory of a best-first search: a binary heap of nodes, and a table of the cells that were reached."""

from __future__ import annotations

from typing import Final

from geometry.arrays import Array, Index
from geometry.compiled import inner

EMPTY: Final = 0
"""A free slot of a table: keys are larger."""


@inner
def push(priority: Array, member: Index, size: int, value: float, node: int) -> int:
    """Enter a node with its priority; returns the new size of the heap."""
    i = size
    while i > 0:
        above = (i - 1) // 2
        if priority[above] <= value:
            break
        priority[i], member[i] = priority[above], member[above]
        i = above
    priority[i], member[i] = value, node
    return size + 1


@inner
def pop(priority: Array, member: Index, size: int) -> int:
    """Take the node of least priority, which is member[0], out; returns the new size."""
    size -= 1
    value, node = priority[size], member[size]
    i = 0
    while 2 * i + 1 < size:
        below = 2 * i + 1
        if below + 1 < size and priority[below + 1] < priority[below]:
            below += 1
        if priority[below] >= value:
            break
        priority[i], member[i] = priority[below], member[below]
        i = below
    priority[i], member[i] = value, node
    return size


@inner
def slot_of(keys: Index, key: int) -> int:
    """Slot of a key in a table whose size is a power of 2, or the free slot where it belongs."""
    mask = len(keys) - 1
    at = ((key ^ (key >> 29)) * 0x9E3779B97F4A7C1) & mask
    while keys[at] != EMPTY and keys[at] != key:
        at = (at + 1) & mask
    return at
