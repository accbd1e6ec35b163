"""Shared settings of the tests."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

# the first example of a property compiles the kernel, which no deadline of an example can foresee; the same commit
# gives the same examples everywhere, more of them in `make study`, and new ones are looked for by `make explore`
settings.register_profile("borechain", deadline=None, derandomize=True, max_examples=40)
settings.register_profile("study", deadline=None, derandomize=True, max_examples=500)
settings.register_profile("explore", deadline=None, print_blob=True)
PROFILE = os.environ.get("HYPOTHESIS_PROFILE", "borechain")
settings.load_profile(PROFILE)
if PROFILE != "explore":
    # numbers that stand in our modules are tried as examples, of those modules that happen to be imported: which worker
    # ran what before would change the examples
    providers._get_local_constants = providers.Constants

if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("BORECHAIN_CORES", "1")  # every worker is a core; a pool in each would start twice as many

MEMORY, ROOM = Path("/dev/shm"), 1 << 30  # bytes; a whole run leaves some 50 MB
if os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > ROOM:
    # a third of the time went by waiting for a disk to sync what nobody will read after a power cut
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))

WAITING = ("process", "install")  # markers of tests that wait for processes more than they compute
MARKER_OF = {"processes": "process", "test_installation.py": "install"}  # first part of the path below tests/


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Iterator[None]:
    """Mark the tests before `-m` selects, and deal what it has left among the workers."""
    mark(items)
    yield
    items[:] = dealt(items, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))


def dealt(items: Sequence[pytest.Item], workers: int) -> list[pytest.Item]:
    """Tests in such an order that every worker begins with his part of those that wait.

    xdist cuts the list into equal parts, a worker each, and whoever has done his takes from the end of another's. Where
    the rigs of real processes stand last, two workers have nothing left and the third waits for one rig after another.
    """
    modules: dict[Path, list[pytest.Item]] = {}
    for item in items:
        modules.setdefault(item.path, []).append(item)
    waiting = {
        path: any(item.get_closest_marker(name) for item in own for name in WAITING) for path, own in modules.items()
    }
    first = sorted((own for path, own in modules.items() if waiting[path]), key=len, reverse=True)
    others = [item for path, own in modules.items() if not waiting[path] for item in own]
    order: list[pytest.Item] = []
    shares: list[list[pytest.Item]] = [[] for _ in range(workers)]
    for own in first:
        min(shares, key=len).extend(own)
    for worker, share in enumerate(shares):
        room = max((len(items) - len(order)) // (workers - worker) - len(share), 0)
        order += share + others[:room]
        others = others[room:]
    return order


def mark(items: Sequence[pytest.Item]) -> None:
    """Mark the tests of a folder or file whose tests cost alike."""
    tests = Path(__file__).parent
    for item in items:
        if item.path.is_relative_to(tests):
            first = item.path.relative_to(tests).parts[0]
            if first in MARKER_OF:
                item.add_marker(MARKER_OF[first])
