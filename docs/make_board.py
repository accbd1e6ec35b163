"""Write the budget of docs/board.md from the size reports of fresh builds: ``python docs/make_board.py``.

It needs Debian's gcc-arm-none-eabi and gcc-riscv64-unknown-elf. Stack and instructions are those that `make
test-firmware` counts in QEMU on the recorded calls.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

DOCS: Final = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent), str(DOCS)]

from make_tables import table  # noqa: E402

from node.kernels.arithmetic.formats import PERIOD  # noqa: E402
from node.translation.c_file import CODE, HEADER  # noqa: E402
from node.translation.firmware_build import record_memory  # noqa: E402
from node.translation.imu_limit import write_for_imus  # noqa: E402
from node.translation.toolchains import TOOLCHAINS, compile_step  # noqa: E402

IMUS: Final = (1, 3, 8)
PAGE: Final = 1024  # bytes, of the image's page of flash


class CountedSteps(NamedTuple):
    """What one step takes with one IMU: stack (kB), instructions of a mean one and the longest; None: not counted."""

    stack_kb: float | None
    mean: int | None
    most: int | None


COUNTED: Final = {
    "cortex-m4": CountedSteps(1.2, 60_000, 120_000),
    "cortex-m0plus": CountedSteps(1.8, 200_000, None),
    "riscv32": CountedSteps(None, None, None),
}

CLOCKS_MHZ: Final = {"cortex-m4": (64, 168), "cortex-m0plus": (64,), "riscv32": ()}


def memory_rows() -> Iterator[tuple[str, ...]]:
    """A row for each target and number of IMUs."""
    for imus in IMUS:
        written = write_for_imus(imus)
        memory = record_memory(written.header)
        with tempfile.TemporaryDirectory() as folder:
            for name, text in ((HEADER, written.header), (CODE, written.code)):
                (Path(folder) / name).write_text(text, encoding="utf-8")
            for target in TOOLCHAINS:
                _, size = compile_step(target, Path(folder))
                image = -(-(44 + memory) // PAGE)
                row = f"{size.flash / 1000:.1f}", str(image), f"{(memory + size.data + size.zeroed) / 1000:.1f}"
                yield target, str(imus), *row, shown(COUNTED[target].stack_kb)


def time_rows() -> Iterator[tuple[str, ...]]:
    """A row for each target whose instructions were counted and each clock, one instruction a clock."""
    for target, counted in COUNTED.items():
        for clock_mhz in CLOCKS_MHZ[target]:
            mean, most = (None if count is None else count / clock_mhz / 1000.0 for count in counted[1:])
            longest = most or mean or 0.0
            part = f"{longest / PERIOD / 10.0:.2g} %"
            yield target, str(clock_mhz), shown(mean), shown(most), part


def shown(number: float | None) -> str:
    """A number of two digits; nothing where it was not counted."""
    return "" if number is None else f"{number:.2g}"


def write_between(text: str, name: str, rows: str) -> str:
    """The page with ``rows`` between the marks of ``name``."""
    return re.sub(
        rf"(<!-- {name} -->\n).*?(<!-- end {name} -->)", lambda m: f"{m[1]}\n{rows}\n{m[2]}", text, flags=re.S
    )


def main() -> None:
    """Build for every target and write the page."""
    page = DOCS / "board.md"
    memory = table(("target", "IMUs", "flash, kB", "image, KiB", "records, kB", "stack, kB"), memory_rows())
    times = table(("target", "clock, MHz", "mean step, ms", "longest, ms", "of a cycle"), time_rows())
    text = write_between(page.read_text(encoding="utf-8"), "memory", memory)
    page.write_text(write_between(text, "time", times), encoding="utf-8")


if __name__ == "__main__":
    main()
