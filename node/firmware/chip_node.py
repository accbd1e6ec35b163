"""A node whose integers step on an emulated chip: records go there and come back, and nothing else knows."""

from __future__ import annotations

import os
import select
import shutil
import struct
import subprocess
import tempfile
import weakref
from pathlib import Path
from typing import Any, Final

import numpy as np

from node.errors import NodeError
from node.kernels.arithmetic.formats import Array
from node.kernels.record.integer_node import FIXED_NODE
from node.kernels.step.fixed_node import FixedNode
from node.kernels.step.shadow_words import learn_aiding, learn_inputs, learn_node, show_node
from node.translation.chip_program import chip_program, start_chip

NODE, SETTINGS, PARAMETERS, STEP, AIDING = range(5)  # of chip_server.c
ANSWER: Final = 8 + FIXED_NODE.itemsize  # bytes: what the step returned, and the record
PATIENCE: Final = 120.0  # s, in which a chip that runs has answered on any machine


class ChipError(NodeError):
    """The emulated chip has ended or does not answer."""


class EmulatedChip:
    """A Cortex-M4 in QEMU with one node; it ends with this object, and with this process."""

    def __init__(self) -> None:
        folder = Path(tempfile.mkdtemp(prefix="borechain-chip-"))
        for name in ("to_chip", "from_chip"):
            os.mkfifo(folder / name)
        # both ends, so that opening does not wait for a chip that never comes
        self._to, self._from = (os.open(folder / name, os.O_RDWR) for name in ("to_chip", "from_chip"))
        self._process = start_chip(chip_program(), folder)
        self._end = weakref.finalize(self, _end_chip, self._process, (self._to, self._from), folder)

    def put(self, kind: int, body: bytes) -> None:
        """Send a request."""
        left = memoryview(struct.pack("<ii", kind, len(body)) + body)
        while left:
            _, ready, _ = select.select([], [self._to], [], 1.0)
            self._check()
            if ready:
                left = left[os.write(self._to, left[:4096]) :]

    def answer(self) -> bytes:
        """What the chip answers.

        Raises
        ------
        ChipError
            When it has ended, or says nothing.
        """
        parts, got, waited = [], 0, 0.0
        while got < ANSWER:
            ready, _, _ = select.select([self._from], [], [], 1.0)
            if ready:
                parts.append(os.read(self._from, ANSWER - got))
                got += len(parts[-1])
                continue
            self._check()
            waited += 1.0
            if waited > PATIENCE:
                raise ChipError(f"the emulated chip: expected an answer within {PATIENCE:g} s, got {got} bytes")
        return b"".join(parts)

    def _check(self) -> None:
        code = self._process.poll()
        if code is not None:
            raise ChipError(f"the emulated chip: expected it to run, it has ended with status {code}")


def _end_chip(process: subprocess.Popen[bytes], ends: tuple[int, ...], folder: Path) -> None:
    process.kill()
    process.wait()
    for end in ends:
        os.close(end)
    shutil.rmtree(folder, ignore_errors=True)


class ChipNode(FixedNode):
    """A node in integers whose steps and aidings are taken by a chip of its own; methods as ``FixedNode``."""

    def __init__(self, integers: Array | None = None) -> None:
        super().__init__(integers)
        self._chip = EmulatedChip()
        self._there: dict[int, bytes] = {}

    def step(self, nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
        """One cycle on the chip."""
        own = self._integers[0]
        learn_node(nodes, settings, self._integers)
        learn_inputs(parameters, readings, moment, self._integers)
        self._put_new(PARAMETERS, own["parameters"].tobytes())
        said = self._run(STEP, own["moment"].tobytes() + own["readings"].tobytes())
        show_node(nodes, settings, self._integers, True)
        return said

    def aiding(self, nodes: Array, settings: Array, aiding: Array) -> int:
        """One aiding on the chip."""
        learn_node(nodes, settings, self._integers)
        learn_aiding(aiding, self._integers)
        said = self._run(AIDING, self._integers[0]["aiding"].tobytes())
        show_node(nodes, settings, self._integers, False)
        return said

    def _run(self, kind: int, body: bytes) -> int:
        own: Any = self._integers[0]
        self._put_new(NODE, own["node"].tobytes())
        self._put_new(SETTINGS, own["settings"].tobytes())
        self._chip.put(kind, body)
        answered = self._chip.answer()
        self._there[NODE] = answered[8:]
        self._integers["node"] = np.frombuffer(answered, FIXED_NODE, offset=8)
        return int(struct.unpack_from("<q", answered)[0])

    def _put_new(self, kind: int, body: bytes) -> None:
        """Send what the chip has otherwise: a record changes outside its step where there was an order or a start."""
        if self._there.get(kind) != body:
            self._there[kind] = body
            self._chip.put(kind, body)
