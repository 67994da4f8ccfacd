"""A heap of numbered entries in two arrays, least key first."""

from __future__ import annotations

from mrmg.compilation import kernel


@kernel
def push(key, entry, size, value, node):
    """Add an entry to a heap; return its size.

    Args:
        key, entry: the heap, which must have room.
        size: number of entries.
        value, node: of the new one.
    """
    at = size
    while at > 0 and key[(at - 1) // 2] > value:
        key[at], entry[at] = key[(at - 1) // 2], entry[(at - 1) // 2]
        at = (at - 1) // 2
    key[at], entry[at] = value, node
    return size + 1


@kernel
def pop(key, entry, size):
    """Take the first entry off a heap; return its size.

    Args:
        key, entry: the heap.
        size: number of entries, at least 1.
    """
    size -= 1
    value, node = key[size], entry[size]
    at = 0
    while 2 * at + 1 < size:
        child = 2 * at + 1
        if child + 1 < size and key[child + 1] < key[child]:
            child += 1
        if key[child] >= value:
            break
        key[at], entry[at] = key[child], entry[child]
        at = child
    key[at], entry[at] = value, node
    return size
