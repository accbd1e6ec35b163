"""How kernels are compiled: once per version of their sources, then loaded from the cache.

Numba stamps a cache entry with the file of the function alone, not with the files of the functions it calls, so an
edited callee would go on running in its old form. The cache folder therefore carries a digest of all kernel sources.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba import config, njit

Function = TypeVar("Function", bound=Callable[..., Any])


def source_digest() -> str:
    """Digest of every kernel source of this package and of the compiler's version."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels: ``$XDG_CACHE_HOME/borechain/kernels-<digest>``."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "borechain" / f"kernels-{source_digest()}"


if not os.environ.get("NUMBA_CACHE_DIR"):
    vars(config)["CACHE_DIR"] = str(cache_folder())


def kernel(function: Function) -> Function:
    """Compile ``function`` on its first call or load it from the cache."""
    return cast("Function", njit(cache=True, error_model="numpy")(function))
