"""Orders to a node in C on this machine, and the record of a node in Python as a chip has it."""

import ctypes
from pathlib import Path

import numpy as np
from chip_tools import run_program
from recorded_calls import leaves
from test_every_event import SLOW, Bench, known

from node.firmware.tube_settings import TubeSettings
from node.kernels.record.integer_node import FIXED_NODE
from node.kernels.step.shadow_words import learn_node
from node.translation.c_file import HEADER, write_c_files
from node.translation.orders_file import ORDERS_CODE, ORDERS_HEADER, write_order_files

FIXED = TubeSettings(1, kernel="fixed")
WORK_SPACE = {".filter.gain", ".filter.ph", ".filter.decay", ".filter.gain_q"}  # written before it is read
WORDS = [(path, at, size) for path, at, size in leaves(FIXED_NODE)]


class OrdersInC:
    """The C of the orders, called over a record that lies in this process."""

    def __init__(self, folder: Path) -> None:
        written = write_c_files()
        orders = write_order_files(written.digest)
        for name, text in ((HEADER, written.header), (ORDERS_HEADER, orders.header), (ORDERS_CODE, orders.code)):
            (folder / name).write_text(text)
        options = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-shared", "-fPIC")
        done = run_program("gcc", *options, ORDERS_CODE, "-o", "orders.so", folder=folder)
        assert done.returncode == 0, done.stderr
        self._library, self._digest = ctypes.CDLL(str(folder / "orders.so")), written.digest

    def call(self, name: str, record: np.ndarray, *given: int | np.ndarray) -> int:
        """What an order answers, or an event's code."""
        function = getattr(self._library, f"borechain_{name}_{self._digest}")
        function.restype = ctypes.c_int64
        places = [ctypes.c_void_p(one.ctypes.data) if isinstance(one, np.ndarray) else one for one in (record, *given)]
        return int(function(*(one if isinstance(one, ctypes.c_void_p) else ctypes.c_int64(one) for one in places)))


def memory_of(bench: Bench) -> np.ndarray:
    """The integers of a bench's node."""
    return bench.tube._loop.step.__self__._integers


def record_of(bench: Bench) -> np.ndarray:
    """The record as the next step will find it, in memory of its own: before an order a chip's, after it Python's."""
    integers = np.frombuffer(bytearray(memory_of(bench).tobytes()), memory_of(bench).dtype)
    learn_node(bench.tube.nodes, bench.tube.settings_record, integers)
    return np.frombuffer(bytearray(integers["node"].tobytes()), FIXED_NODE)


def differing(one: np.ndarray, other: np.ndarray) -> dict[str, tuple[int, int]]:
    """Words that are not the same, by their path."""
    a, b = one.tobytes(), other.tobytes()
    return {
        path: (int.from_bytes(a[at : at + size], "little", signed=True), int.from_bytes(b[at : at + size], "little"))
        for path, at, size in WORDS
        if a[at : at + size] != b[at : at + size]
    }


def aligned() -> Bench:
    """One that was aligned before."""
    bench = known(FIXED)
    assert bench.tube.align("circle", 1.0) == ""
    return bench.cycles(1).cycles(120, SLOW).cycles(60)
