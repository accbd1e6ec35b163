"""What a process frees stays with it: the kernel is asked for a page once, and not at every answer."""

import platform
import subprocess
import sys

import pytest

ROUNDS, MEBIBYTES = 20, 4
PAGES = MEBIBYTES * (1 << 20) // 4096  # of one array, on machines whose pages are the smallest
# arrays as an answer makes them: several at once, all freed at its end
FAULTS = f"""
import resource
{{keep}}
def answer():
    arrays = [bytearray({MEBIBYTES} << 20) for _ in range(6)]
answer()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range({ROUNDS}):
    answer()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""
KEEP = "from telemetry.runtime.kept_memory import keep_freed_memory; keep_freed_memory()"


def page_faults(keep: str) -> int:
    done = subprocess.run([sys.executable, "-c", FAULTS.format(keep=keep)], check=True, capture_output=True, text=True)
    return int(done.stdout)


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="the setting is one of the GNU C library")
def test_memory_that_an_answer_freed_is_there_for_the_next() -> None:
    assert page_faults(KEEP) < PAGES
    assert page_faults("") > ROUNDS * PAGES  # as it is without
