"""Kernel defects that are compiled once: each stands beside what is right, and a number in memory says which counts.

Numba takes a global for a constant, and a kernel that is kept must not hold an address of one process. So the number
lies at an address that every process maps for itself, from its environment, when the room of the kernels is imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from defect_lists import Defect

VARIABLE = "BORECHAIN_PLANTED"  # of the environment: number of the defect that counts, 0 for none
ROOM = "node/kernels/arithmetic/planted_switch.py"
FIRST_LINE = "from __future__ import annotations\n"
IMPORT = "\nfrom node.kernels.arithmetic.planted_switch import is_planted\n"
SOURCE = f'''"""Which of the planted defects counts."""

import ctypes
import mmap
import os

from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

ADDRESS, SIZE, EXACTLY = 0x5A0000000000, 4096, 0x100000  # MAP_FIXED_NOREPLACE
libc = ctypes.CDLL(None, use_errno=True)
libc.mmap.restype = ctypes.c_void_p
libc.mmap.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long]
FLAGS = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS | EXACTLY
if libc.mmap(ADDRESS, SIZE, mmap.PROT_READ | mmap.PROT_WRITE, FLAGS, -1, 0) != ADDRESS:
    raise MemoryError("planted switch: its address is taken")
ctypes.c_int64.from_address(ADDRESS).value = int(os.environ.get("{VARIABLE}", "0"))


@intrinsic
def read_switch(typing_context):
    def generate(context, builder, signature, arguments):
        number = ir.IntType(64)
        return builder.load(builder.inttoptr(ir.Constant(number, ADDRESS), number.as_pointer()))

    return types.int64(), generate


@njit(inline="always")
def is_planted(number):
    return read_switch() == number
'''


def plant_switched(root: Path, defects: Sequence[Defect]) -> None:
    """Plant all switched defects side by side in a copy; their numbers are their places in the list, from 1 on."""
    (root / ROOM).write_text(SOURCE, encoding="utf-8")
    for number, defect in enumerate(defects, 1):
        file = root / defect.file
        guarded = f"(({defect.new}) if is_planted({number}) else ({defect.old}))"
        text = defect.plant(file.read_text(encoding="utf-8"), guarded)
        if IMPORT not in text:
            text = text.replace(FIRST_LINE, FIRST_LINE + IMPORT, 1)
        file.write_text(text, encoding="utf-8")
