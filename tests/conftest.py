"""Shared settings of the tests."""

from __future__ import annotations

import gc
import os
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis.internal.conjecture import providers

from telemetry.runtime.one_thread import one_thread_each

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

os.environ.setdefault("BORECHAIN_TEST_RUN", str(os.getpid()))  # its workers share what forks commands for them
one_thread_each()
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("BORECHAIN_CORES", "1")  # every worker is a core; a pool in each would start twice as many

MEMORY, ROOM = Path("/dev/shm"), 1 << 30  # bytes; a whole run leaves some 50 MB
if os.access(MEMORY, os.W_OK) and shutil.disk_usage(MEMORY).free > ROOM:
    # a third of the time went by waiting for a disk to sync what will not be read after a power cut
    os.environ.setdefault("PYTEST_DEBUG_TEMPROOT", str(MEMORY))

# the collector looks through all that lives whenever enough was made anew: modules and tests live to the end, so it
# is off while they are loaded and leaves them out from then on
gc.disable()

TESTS = Path(__file__).parent
WAITING = ("process", "install")  # markers of tests that wait for processes more than they compute
WAITS_S = {  # roughly how long a file waits, of those that wait for more than the usual time or are not marked
    "processes/test_rig.py": 225,
    "processes/test_two_releases.py": 110,
    "processes/test_trust.py": 90,
    "processes/test_own_clock.py": 80,
    "processes/test_field_calibration.py": 70,
    "test_installation.py": 65,
    "page/test_story.py": 45,
    "test_calibration_commands.py": 45,
    "groundstation/test_process.py": 30,
    "page/test_looks.py": 30,
    "page/test_drawn_coordinates.py": 10,
    "processes/test_bench_hour.py": 30,
    "processes/test_keys.py": 25,
    "processes/test_log.py": 25,
    "test_bench_node.py": 25,
    "telemetry/test_media.py": 20,
    "telemetry/test_runtime.py": 20,
    "groundstation/test_page.py": 20,
    "telemetry/test_access.py": 15,
    "test_command_line.py": 15,
    "test_survey_command.py": 12,
}
WAITS_MARKED_S = 15
MARKER_OF = {"processes": "process", "test_installation.py": "install"}  # first part of the path below tests/


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Iterator[None]:
    """Mark the tests before `-m` selects, and deal what it has left among the workers."""
    mark(items)
    yield
    items[:] = dealt(items, int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1")))


def pytest_collection_finish() -> None:
    """Leave what was loaded out of every collection of garbage."""
    gc.freeze()
    gc.enable()


def dealt(items: Sequence[pytest.Item], workers: int, cores: int = os.cpu_count() or 1) -> list[pytest.Item]:
    """Tests in such an order that a worker a core computes while the others wait for processes, from the first test on.

    xdist cuts the list into equal parts, a worker each, and a worker that is done takes from the end of another's. So
    what waits stands at the beginning of all parts but the last ones. Where every worker began with some of it, half
    of the machine was idle for four minutes of six; where it stood last, one worker waited for rig after rig.
    """
    modules: dict[Path, list[pytest.Item]] = {}
    for item in items:
        modules.setdefault(item.path, []).append(item)
    waits = {path: waits_s(own) for path, own in modules.items()}
    others = [item for path, own in modules.items() if not waits[path] for item in own]
    shares: list[list[pytest.Item]] = [[] for _ in range(workers)]
    lengths = [0] * max(workers - cores, 1)  # s, of those who wait
    for path in sorted(modules, key=lambda path: -waits[path]):
        if waits[path]:
            waiter = lengths.index(min(lengths))
            lengths[waiter] += waits[path]
            shares[waiter] += modules[path]
    order: list[pytest.Item] = []
    for worker, share in enumerate(shares):
        room = max((len(items) - len(order)) // (workers - worker) - len(share), 0)
        order += share + others[:room]
        others = others[room:]
    return order


def waits_s(own: Sequence[pytest.Item]) -> int:
    """How long a file waits for processes, s; 0 where it computes."""
    if (known := WAITS_S.get(own[0].path.relative_to(TESTS).as_posix())) is not None:
        return known
    is_marked = any(item.get_closest_marker(name) for item in own for name in WAITING)
    return WAITS_MARKED_S if is_marked else 0


def mark(items: Sequence[pytest.Item]) -> None:
    """Mark the tests of a folder or file whose tests cost alike."""
    for item in items:
        if item.path.is_relative_to(TESTS):
            first = item.path.relative_to(TESTS).parts[0]
            if first in MARKER_OF:
                item.add_marker(MARKER_OF[first])
