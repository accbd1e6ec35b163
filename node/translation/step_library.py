"""The integer step as a library of this machine: made once a source by its C compiler, and loaded without another."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import tempfile
import zlib
from pathlib import Path
from typing import Final, NamedTuple

from node.kernels.arithmetic.jit import folder_digest, folder_in_use
from node.kernels.record.integer_node import FIXED_NODE, FIXED_PARAMETERS, FIXED_SETTINGS
from node.kernels.record.node_record import NODE_LAYOUT
from node.kernels.record.sensor_record import MAX_IMUS
from node.translation.c_file import CODE, HEADER, write_c_files
from node.translation.toolchains import ToolchainError, run_tool

SHIM: Final = Path(__file__).parent / "bare" / "step_library.c"
COMPILERS: Final = ("cc", "gcc", "clang")
LIBRARY_OPTIONS: Final = ("-std=c99", "-O2", "-fwrapv", "-fPIC", "-shared")
LAYOUT: Final = (NODE_LAYOUT, MAX_IMUS, FIXED_NODE.itemsize, FIXED_SETTINGS.itemsize, FIXED_PARAMETERS.itemsize)


class StepLibrary(NamedTuple):
    """What a node calls; both take the addresses of its records in integers, in the order of the header."""

    step: ctypes._NamedFuncPointer
    aiding: ctypes._NamedFuncPointer


def step_library() -> Path:
    """The library for this machine, kept beside the compiled kernels; made here where there is none.

    Raises
    ------
    ToolchainError
        When there is none and no C compiler, or it does not take the code.
    """
    place = folder_in_use() / f"step-{translation_digest()}-{platform.machine()}.so"
    if place.exists():
        return place
    compiler = find_compiler()
    written = write_c_files()
    with tempfile.TemporaryDirectory(prefix="borechain-step-") as temporary:
        folder = Path(temporary)
        for name, text in ((HEADER, written.header), (CODE, written.code), (SHIM.name, SHIM.read_text("utf-8"))):
            (folder / name).write_text(text, encoding="utf-8")
        run_tool([compiler, *LIBRARY_OPTIONS, SHIM.name, CODE, "-o", "step.so"], folder)
        place.parent.mkdir(parents=True, exist_ok=True)
        made = place.with_name(f"{place.name}.{os.getpid()}")
        shutil.copyfile(folder / "step.so", made)
        made.replace(place)  # whole, or not there: another node may start just now
    return place


def translation_digest() -> str:
    """Digest of what the library is made of: the kernels, and what writes them in C."""
    own = Path(__file__).parent
    digests = folder_digest(own.parent / "kernels"), folder_digest(own), f"{zlib.crc32(SHIM.read_bytes()):08x}"
    return "".join(digest[:8] for digest in digests)


def find_compiler() -> str:
    """A C compiler of this machine.

    Raises
    ------
    ToolchainError
        When there is none.
    """
    for name in COMPILERS:
        if found := shutil.which(name):
            return found
    raise ToolchainError("the step as a library: expected a C compiler on the path, found none; install Debian's gcc")


def load_step(path: Path) -> StepLibrary:
    """Load a library, whose records must be those of this program.

    Raises
    ------
    ToolchainError
        When it is no library of a step, or one of other records.
    """
    try:
        library = ctypes.CDLL(str(path))
        layout = tuple((ctypes.c_int64 * len(LAYOUT)).in_dll(library, "library_layout"))
        made = StepLibrary(library.library_step, library.library_aiding)
    except (OSError, ValueError, AttributeError) as error:
        raise ToolchainError(f"{path}: expected a library of the step, got another file ({error})") from None
    if layout != LAYOUT:
        raise ToolchainError(f"{path}: expected records of layout, IMUs and bytes {LAYOUT}, got {layout}")
    for function, count in zip(made, (5, 3), strict=True):
        function.restype, function.argtypes = ctypes.c_int64, (ctypes.c_void_p,) * count
    return made
