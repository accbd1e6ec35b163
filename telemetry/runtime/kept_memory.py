"""Memory that is freed is kept for what comes next, and not given back to the kernel each time.

An answer about a long hole makes a dozen arrays of some megabytes and frees them again. The C library gives the top of
its heap back at once, and the next answer asks for it page by page: 2000 to 3700 pages, a fifth of its time.
Source: mallopt(3) of the GNU C library.
"""

from __future__ import annotations

import contextlib
import ctypes

TRIM_THRESHOLD, MMAP_THRESHOLD = -1, -3  # M_TRIM_THRESHOLD and M_MMAP_THRESHOLD of malloc.h
KEPT = 64 << 20  # bytes at the top of the heap
IN_HEAP = 32 << 20  # bytes of one array, up to which it comes from there; no more can be set


def keep_freed_memory() -> None:
    """Have this process keep what it frees; on a C library that knows no such setting nothing changes."""
    with contextlib.suppress(OSError, AttributeError):
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(MMAP_THRESHOLD, IN_HEAP)
        mallopt(TRIM_THRESHOLD, KEPT)
