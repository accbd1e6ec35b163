"""How the simulator's kernels are compiled: as the node's, and kept until a source changes that they are made of.

A kernel of a string holds those of the world that fill its readings, which lie in another folder than it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

from numba import njit

from node.kernels.arithmetic.compiler import kept_where
from node.kernels.arithmetic.jit import OPTIONS, SourceLocator, folder_digest, source_digest

Function = TypeVar("Function", bound=Callable[..., Any])
ROOMS: Final = tuple(Path(__file__).parent / room for room in ("string", "world"))  # that hold kernels


class SimLocator(SourceLocator):
    """Place of a kept function of the simulator: by its module, until the node's kernels or ours change."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)
        self._stamp = source_digest() + "".join(map(folder_digest, ROOMS))
        # a folder a version: what was compiled of another one names classes that may have moved
        self._place = self._place.with_name(
            f"{self._place.name}-{hashlib.sha256(self._stamp.encode()).hexdigest()[:16]}"
        )


def compile_function(function: Function, **options: Any) -> Function:
    """Have ``function`` compiled with the node's options and these when it is first called."""
    with kept_where(SimLocator):
        return cast("Function", njit(**OPTIONS | options)(function))


def kernel(function: Function) -> Function:
    """Compile ``function`` on its first call or load it from the cache."""
    return compile_function(function)


def shared_body(function: Function) -> Function:
    """Write ``function`` into every kernel that calls it, so that what it is given costs nothing.

    What stands under ``if argument is not None`` is left out where a kernel is given None.
    """
    return compile_function(function, inline="always")
