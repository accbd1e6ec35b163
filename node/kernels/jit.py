"""How kernels are compiled: once per version of their sources, then loaded from the cache.

Numba stamps a cache entry with the file of the function alone, not with the files of the functions it calls, so an
edited callee would go on running in its old form. The cache folder therefore carries a digest of all kernel sources.

Where that folder cannot be written, a temporary one is used and said so once; processes started from here inherit it.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import numba
import numpy as np
from numba import config, njit

Function = TypeVar("Function", bound=Callable[..., Any])
# nobody calls kernels through C pointers: without that wrapper each compiles faster
OPTIONS: Final[dict[str, Any]] = {"cache": True, "error_model": "numpy", "no_cfunc_wrapper": True}


def source_digest() -> str:
    """Digest of every kernel source of this package and of the compiler's version."""
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Folder of the compiled kernels: ``$XDG_CACHE_HOME/borechain/kernels-<digest>``."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    return home / "borechain" / f"kernels-{source_digest()}"


def fallback_folder() -> Path:
    """Temporary folder of this user alone; what another one has put there is code and is never loaded."""
    folder = Path(tempfile.gettempdir()) / f"borechain-{os.getuid()}-kernels-{source_digest()}"
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    found = folder.lstat()
    if found.st_uid == os.getuid() and stat.S_ISDIR(found.st_mode) and stat.S_IMODE(found.st_mode) == 0o700:
        return folder
    return Path(tempfile.mkdtemp(prefix="borechain-kernels-"))


def use_cache() -> None:
    """Have numba keep the compiled kernels in their folder, or in a temporary one."""
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except (OSError, RuntimeError) as error:
        refused, folder = folder, fallback_folder()
        os.environ["NUMBA_CACHE_DIR"] = str(folder)
        reason = getattr(error, "strerror", None) or error
        sys.stderr.write(
            f"borechain: compiled kernels are kept in {folder}, for {refused} cannot be written ({reason}); "
            "set XDG_CACHE_HOME to a folder that can\n"
        )
    vars(config)["CACHE_DIR"] = str(folder)


if not os.environ.get("NUMBA_CACHE_DIR"):
    use_cache()


def leave_blas_out() -> None:
    """Have numba load without a BLAS: for a process of ours, whose kernels multiply by themselves.

    Numba imports ``scipy.linalg`` as it compiles or loads its first function, a quarter of a second of every start, and
    holds that none is there where the import fails. Not for an interpreter that runs somebody else's code too.
    """
    name = "scipy.linalg"
    if name in sys.modules:
        return
    sys.modules[name] = cast("Any", None)  # so an import of it fails
    try:
        import numba.np.arraymath  # noqa: F401  numba looks for the BLAS once, as it imports this
    finally:
        del sys.modules[name]


def kernel(function: Function) -> Function:
    """Compile ``function`` on its first call or load it from the cache."""
    return cast("Function", njit(**OPTIONS)(function))


def entry(function: Function) -> Function:
    """Compile ``function`` as a kernel that others may call by its address, and need not hold a copy of."""
    return cast("Function", njit(**{**OPTIONS, "no_cfunc_wrapper": False})(function))


def shared_body(function: Function) -> Function:
    """Write ``function`` into every kernel that calls it: kernels that it is given are known there and cost nothing."""
    return cast("Function", njit(**OPTIONS, inline="always")(function))


def constant(value: int) -> int:
    """An integer that kernels give to each other: for every other plain ``int`` numba compiles the callee anew."""
    return cast("int", np.int64(value))
