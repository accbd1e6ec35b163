"""The planted defects as data: what is written wrong where, of which kind, and which tests are to notice it."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LISTS = Path(__file__).parent / "defects"
KINDS = {
    1: "geometry that is drawn",
    2: "order against a cut",
    3: "variance from one side",
    4: "stale state",
    5: "security and updates",
    6: "exact bounds",
    7: "keeping the wrong one",
    8: "formula or sign",
}


class DefectError(ValueError):
    """A list that cannot be planted, with the name of the defect."""


@dataclass(frozen=True)
class Defect:
    """One defect: ``old`` stands exactly once in ``file`` and is replaced by ``new``.

    ``package`` is the list that it stands in; ``tests`` are files below ``tests/``, empty where they are chosen by what
    they import. One that is ``switched`` stands in a kernel: its texts are expressions of one type, between which a
    number decides while the kernel runs, so that all of them are compiled once.
    """

    name: str
    package: str
    kind: int
    file: str
    old: str
    new: str
    tests: tuple[str, ...] = ()
    switched: bool = False

    def planted_text(self, root: Path) -> str:
        """Text of its file below ``root`` with the defect in it."""
        return self.plant((root / self.file).read_text(encoding="utf-8"), self.new)

    def plant(self, text: str, new: str) -> str:
        """Text with ``new`` in the place of the old one."""
        if (found := text.count(self.old)) != 1:
            raise DefectError(f"{self.name}: expected its old text once in {self.file}, found it {found} times")
        return text.replace(self.old, new)


def read_defects(lists: Path = LISTS) -> list[Defect]:
    """Defects of all lists, checked but for what stands in the sources."""
    defects = [
        _defect_of(package.stem, row)
        for package in sorted(lists.glob("*.toml"))
        for row in tomllib.loads(package.read_text(encoding="utf-8"))["defect"]
    ]
    for name, count in Counter(defect.name for defect in defects).items():
        if count > 1:
            raise DefectError(f"{name}: expected a name of its own, found it {count} times")
    return defects


def _defect_of(package: str, row: dict[str, object]) -> Defect:
    defect = Defect(package=package, **{**row, "tests": tuple(row.get("tests", ()))})  # type: ignore[arg-type]
    if defect.kind not in KINDS:
        raise DefectError(f"{defect.name}: expected a kind of 1..{len(KINDS)}, got {defect.kind}")
    if defect.old == defect.new:
        raise DefectError(f"{defect.name}: expected a new text that differs from the old one")
    return defect


def sample_of(defects: Iterable[Defect], size: int) -> list[Defect]:
    """Every so manieth defect, so that each package and kind has its share; of a small package one all the same."""
    ordered = sorted(defects, key=lambda d: (d.package, d.kind, d.name))
    if size >= len(ordered):
        return ordered
    found = [ordered[k * len(ordered) // size] for k in range(size)]
    for defect in ordered:
        counts = Counter(one.package for one in found)
        if defect.package not in counts:
            largest = max(sorted(counts), key=counts.__getitem__)
            found.remove(next(one for one in found if one.package == largest))
            found.append(defect)
    return sorted(found, key=ordered.index)
