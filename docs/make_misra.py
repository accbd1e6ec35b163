"""Write what cppcheck finds of MISRA C:2012 in a chip's C into docs/board.md: ``python docs/make_misra.py``.

It needs Debian's cppcheck, whose addon knows the rules by their numbers; their text is MISRA's. Counted are the sources
by hand and what `borechain firmware build`, `provision` and `codec` write for one IMU, each finding once a place.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Final

DOCS: Final = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent), str(DOCS), str(DOCS.parent / "tests" / "tools")]

from chip_sources import write_chip_sources  # noqa: E402
from make_board import write_between  # noqa: E402
from make_tables import table  # noqa: E402

FIRMWARE: Final = DOCS.parent / "firmware"
FOUND: Final = re.compile(r"^(.+):(\d+):misra-c2012-(\d+\.\d+)$", re.MULTILINE)
REQUIRED: Final = [
    "2.2",
    "7.2",
    "8.4",
    "9.3",
    "10.1",
    "10.3",
    "10.4",
    "10.6",
    "10.7",
    "10.8",
    "11.9",
    "14.2",
    "15.7",
    "17.7",
    "20.7",
    "21.14",
    "21.16",
]  # of those found
ABOUT: Final = {
    "2.2": "what has no effect",
    "2.3": "types that nothing uses: the checks of a record's layout are some",
    "2.4": "tags that nothing uses",
    "2.5": "macros that a file does not use",
    "7.2": "constants without a u",
    "8.4": "external linkage without a declaration before: main",
    "8.7": "external linkage that one file uses",
    "8.9": "objects that one function uses",
    "9.3": "arrays begun in part",
    "10.1": "operands of an unfitting kind: shifts of signed numbers, bits of a bool",
    "10.3": "values kept as a narrower or another kind",
    "10.4": "operands of two kinds",
    "10.6": "a wider value of a narrower calculation",
    "10.7": "a wider operand of a narrower calculation",
    "10.8": "casts of a calculation",
    "11.4": "addresses made of numbers: registers",
    "11.5": "pointers from void",
    "11.9": "0 for a null pointer",
    "12.1": "precedence without parentheses",
    "12.3": "the comma operator",
    "13.4": "assignments used as values",
    "14.2": "loops that are not only counted",
    "15.5": "more than one return",
    "15.7": "else if without an else",
    "17.7": "answers that are not used: memcpy and memset",
    "17.8": "arguments that are changed",
    "18.4": "sums of a pointer and a number",
    "19.2": "unions",
    "20.7": "arguments of macros without parentheses",
    "21.14": "memcmp of texts",
    "21.16": "memcmp of records, which have no byte between their numbers",
}


def findings_of(folder: Path) -> tuple[Counter[str], Counter[str]]:
    """Findings by rule, in the sources by hand and in those written into ``folder``."""
    includes = [f"-I{place}" for place in (FIRMWARE, FIRMWARE / "tube", folder)]
    sources = [*FIRMWARE.rglob("*.c"), *folder.glob("*.c")]
    places = set[tuple[str, str, str]]()
    for source in sources:
        command = ["cppcheck", "-q", "--std=c99", "--addon=misra", "--template={file}:{line}:{id}", *includes]
        done = subprocess.run([*command, str(source)], check=True, capture_output=True, text=True)
        places |= {(found[1], found[2], found[3]) for found in FOUND.finditer(done.stderr)}
    by_hand, written = Counter[str](), Counter[str]()
    for path, _, rule in places:
        (written if Path(path).parent == folder else by_hand)[rule] += 1
    return by_hand, written


def rows_of(by_hand: Counter[str], written: Counter[str]) -> Iterator[tuple[str, ...]]:
    """A row for each rule, the required ones first, and the sums."""
    for is_required in (True, False):
        rules = [rule for rule in by_hand | written if (rule in REQUIRED) == is_required]
        for rule in sorted(rules, key=lambda rule: tuple(map(int, rule.split(".")))):
            kind = "required" if is_required else "advisory"
            yield rule, kind, ABOUT.get(rule, ""), str(by_hand[rule]), str(written[rule])
        sums = (sum(count for rule, count in found.items() if rule in rules) for found in (by_hand, written))
        yield ("", f"all {'required' if is_required else 'advisory'}", "", *map(str, sums))


def main() -> None:
    """Count and write the page."""
    if shutil.which("cppcheck") is None:
        sys.exit("expected cppcheck on the path, found none; install Debian's cppcheck")
    with tempfile.TemporaryDirectory() as folder:
        write_chip_sources(Path(folder))
        found = findings_of(Path(folder))
    page = DOCS / "board.md"
    rows = table(("rule", "kind", "about", "by hand", "written"), rows_of(*found))
    page.write_text(write_between(page.read_text(encoding="utf-8"), "misra", rows), encoding="utf-8")


if __name__ == "__main__":
    main()
