"""Files that land whole or not at all."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from borechain.cli.faults import EnvironmentFault, InputFault

PLOT_FORMATS = (".svg", ".png", ".pdf")


def check_suffix(option: str, path: Path | None, *suffixes: str) -> None:
    """Refuse the name of a file in a format that is not written, before anything is computed.

    Raises
    ------
    InputFault
        Naming the option and the suffixes.
    """
    if path is not None and path.suffix.lower() not in suffixes:
        raise InputFault(f"{option} {path}: expected a name that ends in {', '.join(suffixes)}")


def make_folder(path: Path) -> None:
    """Make a folder to write into, before anything is computed.

    Raises
    ------
    EnvironmentFault
        When nothing can be written there.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise EnvironmentFault(f"{path}: {error.strerror}; choose a writable place") from error
    if not os.access(path, os.W_OK):
        raise EnvironmentFault(f"{path}: cannot be written; choose a writable place")


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file, its folder included.

    Raises
    ------
    EnvironmentFault
        When the place cannot be written; nothing is left behind.
    """
    fresh = path.with_name(f"{path.name}.new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh.write_bytes(content.encode() if isinstance(content, str) else content)
        fresh.replace(path)
    except OSError as error:
        with contextlib.suppress(OSError):
            fresh.unlink()
        raise EnvironmentFault(f"{path}: {error.strerror}; choose a writable place") from error
