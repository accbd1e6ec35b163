"""Whether the packages that are found are ours: ``node`` and ``sim`` are names that others have taken, too."""

from __future__ import annotations

from collections.abc import Iterable
from importlib.util import find_spec
from pathlib import Path

PACKAGES = ("borechain", "groundstation", "node", "sim", "telemetry")
MARK = '__distribution__ = "borechain"'


def foreign_package(names: Iterable[str] = PACKAGES) -> str | None:
    """Error line on the first of ``names`` that is a foreign package; None when all that are installed are ours.

    Nothing foreign is imported for it: the source of each package is read. A folder without an ``__init__.py`` is no
    package that could stand in the way of one.
    """
    for name in names:
        spec = find_spec(name)
        if spec is not None and spec.origin is not None and not _is_ours(Path(spec.origin)):
            return (
                f"package {name}: expected that of borechain, got another one: {spec.origin}; "
                "give borechain an environment of its own, or start it from another folder"
            )
    return None


def _is_ours(source: Path) -> bool:
    try:
        return MARK in source.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return False
