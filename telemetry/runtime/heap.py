"""The heap of a process that lives for months: what was large and short goes back to the machine.

The allocator of glibc learns: once a block of half a megabyte was freed, blocks of that size come from the heap
itself, and what is small and stays comes to lie between them. A process that renders such texts, and keeps a little
more each time, then holds several times what it needs. With a fixed threshold they have pages of their own.
"""

from __future__ import annotations

import ctypes

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD = -1, -3  # of malloc.h
LARGE = 128 * 1024  # bytes; where glibc begins, before it learns


def keep_large_blocks_apart() -> bool:
    """Have blocks from ``LARGE`` on mapped each by itself for the life of this process; False where nobody can."""
    set_option = getattr(ctypes.CDLL(None), "mallopt", None)
    if set_option is None:
        return False
    return all(set_option(option, LARGE) == 1 for option in (M_MMAP_THRESHOLD, M_TRIM_THRESHOLD))
