"""Calls of the integer step as nodes make them, recorded for C: what went in, what came back, sums over the record.

The oracle is the step that numba compiles of the same kernels. A record is written anew where it was changed from
outside the step; holes between its fields are zero, for nothing reads them.
"""

import contextlib
import struct
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np

from node.firmware import kernel_choice
from node.kernels.record.integer_node import FIXED_NODE, FIXED_PARAMETERS, FIXED_SETTINGS
from node.kernels.record.sensor_record import MAX_IMUS
from node.kernels.step import fixed_node
from node.kernels.step.fixed_node import FixedNode
from node.kernels.step.fixed_step import fixed_aiding, fixed_step
from node.kernels.step.shadow_words import learn_aiding, learn_inputs, learn_node

NODE, SETTINGS, PARAMETERS, STEP, AIDING, LAST = range(6)
SLOTS = 4  # of replay.c


def leaves(kind: np.dtype, base: int = 0, path: str = "") -> Iterator[tuple[str, int, int]]:
    """Path, place and size of every field that holds numbers."""
    for name in kind.names or ():
        part, offset = kind.fields[name][:2]
        inner, shape = part.subdtype or (part, ())
        for k in np.ndindex(shape) if inner.names else [()]:
            at = base + offset + (int(np.ravel_multi_index(k, shape)) if k else 0) * inner.itemsize
            label = f"{path}.{name}{list(k) or ''}"
            if inner.names:
                yield from leaves(inner, at, label)
            else:
                yield label, at, part.itemsize


class Layout(NamedTuple):
    """Where the bytes of the records that are written lie in those of this program: -1, where nothing does.

    Attributes
    ----------
    node, settings : of each byte of the two records
    parameters : bytes of all sets of parameters
    imus : most of a node; calls of nodes with more are not written
    """

    node: np.ndarray
    settings: np.ndarray
    parameters: int
    imus: int


def layout_of(node: dict[str, tuple[int, int]], settings: dict[str, tuple[int, int]], sizes: Sequence[int]) -> Layout:
    """Layout of records whose fields lie where these say, path -> place and size: what is left out is the last IMUs.

    ``sizes`` are the bytes of the two records and of all parameters, and the number of IMUs.
    """
    return Layout(
        _places_in(FIXED_NODE, node, sizes[0]), _places_in(FIXED_SETTINGS, settings, sizes[1]), sizes[2], sizes[3]
    )


def _places_in(wide: np.dtype, kept: dict[str, tuple[int, int]], size: int) -> np.ndarray:
    own, found = {path: at for path, at, _ in leaves(wide)}, np.full(size, -1)
    for path, (at, count) in kept.items():
        found[at : at + count] = own[path] + np.arange(count)
    return found


def fields_of(kind: np.dtype) -> dict[str, tuple[int, int]]:
    """Place and size of every field by its path."""
    return {path: (at, size) for path, at, size in leaves(kind)}


WHOLE = layout_of(
    fields_of(FIXED_NODE),
    fields_of(FIXED_SETTINGS),
    (FIXED_NODE.itemsize, FIXED_SETTINGS.itemsize, FIXED_PARAMETERS.itemsize * (1 + MAX_IMUS), MAX_IMUS),
)


def taken_bytes(record: np.ndarray, places: np.ndarray) -> bytes:
    """Bytes of a record at ``places``, zero where it holds nothing."""
    return np.where(places < 0, 0, np.frombuffer(record.tobytes(), np.uint8)[places]).astype(np.uint8).tobytes()


def sums_of(raw: bytes) -> tuple[int, int]:
    """Sum of the words and sum of its partial sums, of 32 bits each."""
    words = np.frombuffer(raw, "<u4").astype(np.uint64)
    weights = np.arange(len(words), 0, -1, dtype=np.uint64)
    return int(words.sum()) & 0xFFFFFFFF, int((words * weights).sum(dtype=np.uint64)) & 0xFFFFFFFF


class CallFile:
    """The file that calls are written to; the newest ``SLOTS`` nodes keep their memory there."""

    def __init__(self, file: BinaryIO, layout: Layout) -> None:
        self._file, self.layout = file, layout
        self._owners: list[RecordingNode | None] = [None] * SLOTS
        self._next = 0
        self.calls = 0

    def slot_of(self, node: "RecordingNode") -> int:
        """Slot of a node; where another one had it, that one is done with there."""
        if node in self._owners:
            return self._owners.index(node)
        slot, self._next = self._next, (self._next + 1) % SLOTS
        self.end(slot)
        self._owners[slot] = node
        node.seen.clear()
        return slot

    def put(self, kind: int, slot: int, body: bytes) -> None:
        """Write one record."""
        self._file.write(struct.pack("<iii", kind, slot, len(body)) + body)
        self.calls += kind in (STEP, AIDING)

    def put_new(self, node: "RecordingNode", kind: int, slot: int, body: bytes) -> None:
        """Write what a node has, where it is not what was written last."""
        if node.seen.get(kind) != body:
            node.seen[kind] = body
            self.put(kind, slot, body)

    def end(self, slot: int) -> None:
        """Write the whole record that a slot holds, to be compared."""
        owner = self._owners[slot]
        if owner is not None and NODE in owner.seen:
            self.put(LAST, slot, owner.seen[NODE])
        self._owners[slot] = None


class RecordingNode(FixedNode):
    """A node in integers that writes every call into ``calls``."""

    calls: CallFile

    def __init__(self, integers: np.ndarray | None = None) -> None:
        super().__init__(integers)
        self.seen: dict[int, bytes] = {}

    def step(self, nodes, settings, parameters, readings, moment):
        if settings[0]["imus"] > self.calls.layout.imus:
            return super().step(nodes, settings, parameters, readings, moment)
        own = self._learnt(nodes, settings)
        learn_inputs(parameters, readings, moment, own)
        slot = self._written(own)
        self.calls.put_new(self, PARAMETERS, slot, own[0]["parameters"].tobytes()[: self.calls.layout.parameters])
        imus = readings.shape[0]
        body = struct.pack("<q", imus) + own[0]["readings"][:imus].tobytes() + own[0]["moment"].tobytes()
        return self._told(STEP, slot, body, fixed_step(nodes, settings, parameters, readings, moment, self._integers))

    def aiding(self, nodes, settings, aiding):
        if settings[0]["imus"] > self.calls.layout.imus:
            return super().aiding(nodes, settings, aiding)
        own = self._learnt(nodes, settings)
        learn_aiding(aiding, own)
        slot = self._written(own)
        body = own[0]["aiding"].tobytes()
        return self._told(AIDING, slot, body, fixed_aiding(nodes, settings, aiding, self._integers))

    def _learnt(self, nodes, settings) -> np.ndarray:
        """What the integers will be as the step begins, on a copy: the step learns again, and counts overflows."""
        own = np.frombuffer(bytearray(self._integers.tobytes()), self._integers.dtype)
        learn_node(nodes, settings, own)
        return own

    def _written(self, own: np.ndarray) -> int:
        """Slot of this node, where its record and its settings are now those of ``own``."""
        slot = self.calls.slot_of(self)
        self.calls.put_new(self, NODE, slot, taken_bytes(own[0]["node"], self.calls.layout.node))
        self.calls.put_new(self, SETTINGS, slot, taken_bytes(own[0]["settings"], self.calls.layout.settings))
        return slot

    def _told(self, kind: int, slot: int, body: bytes, answer: int) -> int:
        after = taken_bytes(self._integers[0]["node"], self.calls.layout.node)
        self.seen[NODE] = after
        self.calls.put(kind, slot, body + struct.pack("<qII", answer, *sums_of(after)))
        return answer


@contextlib.contextmanager
def recording(path: Path, layout: Layout = WHOLE) -> Iterator[CallFile]:
    """Have every node of this process run in integers meanwhile, whatever it asks for, and write its calls."""
    plain, loops = fixed_node.FixedNode, dict(kernel_choice.LOOPS)
    with path.open("wb") as file:
        calls = CallFile(file, layout)
        RecordingNode.calls = calls
        fixed_node.FixedNode = RecordingNode  # type: ignore[misc]
        kernel_choice.LOOPS["float64"] = kernel_choice.LOOPS["fixed"]
        try:
            yield calls
        finally:
            fixed_node.FixedNode = plain  # type: ignore[misc]
            kernel_choice.LOOPS.update(loops)
            for slot in range(SLOTS):
                calls.end(slot)


def record_calls(path: Path, *worlds: Callable[[], object], layout: Layout = WHOLE) -> int:
    """Write the calls of all nodes of these ``worlds``; returns how many."""
    with recording(path, layout) as calls:
        for world in worlds:
            world()
    return calls.calls
