"""Kernels compiled before a rig begins, on every core: a newcomer sees how far they are.

Without it the fork server compiles them, one after the other and without a word. A file in their folder says that all
of a rig's are there, by the digest of the sources that they are made of.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Final

import groundstation.survey
from node.kernels.arithmetic.jit import folder_digest, folder_in_use, source_digest

PARTS_OF: Final[Mapping[str, Sequence[str]]] = {
    "float64": ("step", "surveys", "adjustment"),
    "fixed": ("step", "surveys", "adjustment", "integers"),
    "chip": ("step", "surveys", "adjustment", "integers"),
}  # by kernel, see ``kernel_parts``
ABOUT: Final[Mapping[str, int]] = {
    "step": 305,
    "surveys": 270,
    "adjustment": 60,
    "integers": 500,
}  # functions that a part compiles

ShowCompiling = Callable[[int], AbstractContextManager[Callable[[int], None]]]  # of how many; then how many are done


def are_compiled(kernel: str) -> bool:
    """Whether all that a rig of this kernel needs was compiled, or delivered."""
    return not lacking_parts(kernel)


def mark_of(part: str) -> Path:
    """The file that says that a part is compiled."""
    sources = source_digest() + folder_digest(Path(groundstation.survey.__path__[0]))
    return folder_in_use() / f"{part}-{hashlib.sha256(sources.encode()).hexdigest()[:16]}"


def lacking_parts(kernel: str) -> list[str]:
    """The parts of a rig's kernels that are not there."""
    return [part for part in PARTS_OF[kernel] if not mark_of(part).exists()]


def count_about(parts: Sequence[str]) -> int:
    """How many functions these parts compile, about."""
    return sum(ABOUT[part] for part in parts)


def compile_ahead(kernel: str, show: ShowCompiling) -> None:
    """Compile what is lacking of a rig's kernels, its parts beside each other; without a word where nothing is.

    A part that fails is left to the rig, which then says why.
    """
    lacking = lacking_parts(kernel)
    if lacking:
        with show(count_about(lacking)) as tell:
            compile_parts(lacking, tell)


def compile_parts(parts: Sequence[str], tell: Callable[[int], None]) -> None:
    """Compile parts in a process of their own, telling how many functions are done."""
    command = [sys.executable, "-m", "borechain.drilling.kernel_parts", *parts]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as running:
        try:
            for done, _ in enumerate(running.stdout or (), 1):
                tell(done)
        except BaseException:
            running.terminate()  # it ends what it has forked
            raise
