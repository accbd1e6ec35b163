"""A rig's kernels compiled while the rest of an environment is still being installed: ``deploy/set_up_shown.py``.

The first line of its output says how many functions there are, about; every other one how many are compiled.
It needs numba and numpy, and no other package.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator

from borechain.drilling.compile_ahead import compile_ahead


@contextlib.contextmanager
def numbers_told(count: int) -> Iterator[Callable[[int], None]]:
    """Write ``count``, and then every number that is told."""
    write_number(count)
    yield write_number


def write_number(number: int) -> None:
    """A line of it, seen at once by one who follows."""
    sys.stdout.write(f"{number}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    compile_ahead("float64", numbers_told)
