"""Kernels that come with an installation: compiled where its wheel was made, for the least of all processors of a kind.

Numba keeps a function for the processor that it was compiled for, by name and features. Those of a wheel are compiled
for the baseline of a family (SSE2 of x86-64), and a process that finds them compiles for that one too, whatever it runs
on: one set of kernels, one set of results. Floats come out the same, for numba neither contracts nor reorders them.

They fit where kernel sources, numba, Python, system and family are those they were compiled of; the name of the archive
says all five. Elsewhere they are left alone and the kernels are compiled.
"""

from __future__ import annotations

import os
import platform
import shutil
import sys
import tarfile
import tempfile
from collections.abc import Mapping
from lzma import LZMAError
from pathlib import Path
from typing import Final, NamedTuple

from numba import config

PLACE: Final = Path(__file__).parents[2] / "delivered"
OWN_CHOICE: Final = ("NUMBA_OPT", "NUMBA_BOUNDSCHECK", "NUMBA_DEBUGINFO")  # of code of another kind


class Processor(NamedTuple):
    """A processor as LLVM knows it."""

    name: str
    features: str


BASELINES: Final[Mapping[str, Processor]] = {
    "x86_64": Processor("x86-64", "+sse,+sse2"),
    "aarch64": Processor("generic", "+neon"),
}  # by the machine that Python names


def archive_name(digest: str) -> str:
    """Name of the archive of kernels made of the sources of ``digest``, for this Python, system and family."""
    system, machine = platform.system().lower(), platform.machine()
    return f"kernels-{digest}-{system}-{machine}-{sys.implementation.cache_tag}.tar.xz"


def find_delivered(digest: str, place: Path = PLACE) -> Path | None:
    """Archive of the kernels that fit here; None where there is none, or where the user wants other code."""
    archive = place / archive_name(digest)
    baseline = BASELINES.get(platform.machine())
    if baseline is None or not archive.is_file() or any(os.environ.get(name) for name in OWN_CHOICE):
        return None
    asked = os.environ.get("NUMBA_CPU_NAME"), os.environ.get("NUMBA_CPU_FEATURES")
    return archive if asked in ((None, None), baseline) else None


def compile_for_baseline() -> None:
    """Have numba compile for the baseline of this family, in this process and in those that it starts."""
    baseline = BASELINES[platform.machine()]
    vars(config)["CPU_NAME"], vars(config)["CPU_FEATURES"] = baseline
    os.environ["NUMBA_CPU_NAME"], os.environ["NUMBA_CPU_FEATURES"] = baseline


def unpack_kernels(archive: Path, folder: Path) -> None:
    """Put what is in ``archive`` into the empty ``folder``, all or nothing; of two processes at it the first does.

    Raises
    ------
    OSError, EOFError, tarfile.TarError, lzma.LZMAError
        When the archive is damaged, or the folder's parent cannot be written.
    """
    made = Path(tempfile.mkdtemp(prefix=f"{folder.name}-", dir=folder.parent))
    try:
        with tarfile.open(archive, "r:xz") as packed:
            for member in packed:
                content = packed.extractfile(member)
                if content is not None:
                    (made / member.name).parent.mkdir(parents=True, exist_ok=True)
                    (made / member.name).write_bytes(content.read())
        made.rename(folder)  # which replaces an empty one and no other
    except OSError as error:
        if not any(folder.iterdir()):
            raise error from None
    finally:
        shutil.rmtree(made, ignore_errors=True)


def pack_kernels(folder: Path, digest: str, place: Path = PLACE) -> Path:
    """Write the archive of the compiled kernels in ``folder``; those of other sources in its place go."""
    place.mkdir(exist_ok=True)
    for old in place.glob("kernels-*.tar.xz"):
        old.unlink()
    archive = place / archive_name(digest)
    with tarfile.open(archive, "w:xz", preset=6) as packed:
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                packed.add(path, str(path.relative_to(folder)), filter=_without_owner)
    return archive


def _without_owner(member: tarfile.TarInfo) -> tarfile.TarInfo:
    """A member that says nothing of who packed it and when."""
    member.uid = member.gid = 0
    member.uname = member.gname = ""
    member.mtime = 0
    member.mode = 0o644
    return member


UNREADABLE: Final = (OSError, EOFError, tarfile.TarError, LZMAError)
