"""How kernels are compiled: once per version of their sources, then loaded from the cache.

Numba knows a kept function by the place and the date of its file, and not by the functions it calls: a copy of the same
sources would be compiled anew, and an edited callee would go on running in its old form. Ours are known by the digest
of all kernel sources, wherever these lie: a checkout, its copy and the wheel made of it share what is compiled. A wheel
may bring compiled kernels along (``delivered.py``), which are unpacked at the first start.

Where that folder cannot be written, a temporary one is used and said so once; processes started from here inherit it.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import os
import stat
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, TypeVar, cast

import llvmlite.binding
import numba
import numpy as np
from numba import config, njit

from node.kernels.arithmetic.compiler import COUNTED, NO_WRAPPER, ONLY_BORROWED, UserProvidedCacheLocator, kept_where
from node.kernels.arithmetic.delivered import UNREADABLE, compile_for_baseline, find_delivered, unpack_kernels

Function = TypeVar("Function", bound=Callable[..., Any])
DELIVERED: Final = "-delivered"  # at the end of the name of a folder
OPTIONS: Final[dict[str, Any]] = {"cache": True, "error_model": "numpy", **NO_WRAPPER, **ONLY_BORROWED}


@functools.cache
def folder_digest(folder: Path) -> str:
    """Digest of every source below ``folder``."""
    digest = hashlib.sha256()
    for source in sorted(folder.rglob("*.py")):
        digest.update(str(source.relative_to(folder)).encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()


def source_digest() -> str:
    """Digest of every kernel source of this package and of the compiler's version."""
    sources = numba.__version__ + folder_digest(Path(__file__).parents[1])
    return hashlib.sha256(sources.encode()).hexdigest()[:16]


def cache_name() -> str:
    """Name of the folder of the compiled kernels; that of delivered ones is another."""
    return f"kernels-{source_digest()}{DELIVERED if find_delivered(source_digest()) else ''}"


def cache_folder() -> Path:
    """Folder of the compiled kernels: ``$XDG_CACHE_HOME/borechain/kernels-<digest>``."""
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser())
    return home / "borechain" / cache_name()


def fallback_folder() -> Path:
    """Temporary folder of this user alone; what another one has put there is code and is never loaded."""
    folder = Path(tempfile.gettempdir()) / f"borechain-{os.getuid()}-{cache_name()}"
    with contextlib.suppress(FileExistsError):
        folder.mkdir(mode=0o700)
    found = folder.lstat()
    if found.st_uid == os.getuid() and stat.S_ISDIR(found.st_mode) and stat.S_IMODE(found.st_mode) == 0o700:
        return folder
    return Path(
        tempfile.mkdtemp(prefix="borechain-kernels-", suffix=DELIVERED if find_delivered(source_digest()) else "")
    )


def writable_folder() -> Path:
    """The usual folder, or a temporary one, which is said, for this process and those that it starts."""
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
    return folder


def use_cache() -> None:
    """Have numba keep the compiled kernels in their folder, where those lie that were delivered."""
    folder, archive = writable_folder(), find_delivered(source_digest())
    if archive is not None:
        compile_for_baseline()
        try:
            if not any(folder.iterdir()):
                unpack_kernels(archive, folder)
        except UNREADABLE as error:
            sys.stderr.write(f"borechain: expected compiled kernels in {archive} ({error}); they are compiled here\n")
    vars(config)["CACHE_DIR"] = str(folder)


if not os.environ.get("NUMBA_CACHE_DIR"):
    use_cache()


def folder_in_use() -> Path:
    """Folder that compiled kernels are kept in by this process: the usual one, or what took its place."""
    return Path(vars(config)["CACHE_DIR"])


def processor_in_use() -> str:
    """The processor that kernels are compiled for, and whether they were delivered, for a result."""
    name = vars(config)["CPU_NAME"] or llvmlite.binding.get_host_cpu_name()
    return f"{name}, delivered" if folder_in_use().name.endswith(DELIVERED) else f"{name}, compiled here"


class SourceLocator(UserProvidedCacheLocator):
    """Place of a kept function in the cache: by its module; kept as long as no source changes that it may be made of.

    Those are the kernels of this package and the sources beside its own.
    """

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        super().__init__(function, file)  # type: ignore[no-untyped-call]
        self._place = folder_in_use() / function.__module__
        self._stamp = source_digest() + folder_digest(Path(file).parent)

    def get_cache_path(self) -> str:
        """Folder of the functions of one module."""
        return str(self._place)

    def get_source_stamp(self) -> str:
        """What a kept function was made of."""
        return self._stamp


def compile_function(function: Function, **options: Any) -> Function:
    """Have ``function`` compiled with our options and these when it is first called."""
    with kept_where(SourceLocator):
        return cast("Function", njit(**OPTIONS | options)(function))


def kernel(function: Function) -> Function:
    """Compile ``function`` on its first call or load it from the cache; it neither makes nor returns an array."""
    return compile_function(function)


def entry_kernel(function: Function) -> Function:
    """Compile ``function`` as a kernel that others may call by its address, and need not hold a copy of."""
    return compile_function(function, no_cfunc_wrapper=False)


def allocating_kernel(function: Function) -> Function:
    """Compile ``function`` as a kernel that makes arrays for its own use, and so counts the references to all."""
    return compile_function(function, **COUNTED)


def shared_body(function: Function) -> Function:
    """Write ``function`` into every kernel that calls it, which may give it kernels.

    It buys no speed of its own: one body stands for every filter that a step is made with. Numba cannot keep a function
    that takes another (decision 23), so without it each step would have a body of its own.
    """
    return compile_function(function, inline="always")


def kernel_constant(value: int) -> int:
    """An integer that kernels give to each other: for every other plain ``int`` numba compiles the callee anew."""
    return cast("int", np.int64(value))
