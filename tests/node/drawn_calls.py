"""Calls of the integer step from records that no world leads to: words of a recorded one are drawn anew before a call.

A branch that a rig takes once a year is taken here, and a word lies at a bound or beside it. What a wild record makes
of the next is of no use to anyone but this: the two translations of the step have to agree on it.
"""

import re
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
from recorded_calls import NODE, WHOLE, RecordingNode, leaves, recording, taken_bytes

from node.kernels.record.integer_node import FIXED_NODE
from node.translation.c_file import write_c_files

KEEP, PATCH, BACK = 6, 7, 8  # of replay.c
# places in a ring, numbers of shifts, what both translations follow for ever, and weights, which would count an IMU in
# whose readings no call brings
HELD = re.compile(
    r"weights$|pending$|cycles$|consumed|told$|said$|gain_q|overflows|samples|changes|_every|survey_samples|decays"
)
SMALL = 64  # what is less is a count or a choice
LARGEST = 1 << 50


def drawn_words() -> list[list[tuple[str, int, int]]]:
    """Path, place and bytes of every word that may be drawn anew, those of one field together."""
    found: dict[str, list[tuple[str, int, int]]] = {}
    for path, at, size in leaves(FIXED_NODE):
        if not HELD.search(path) and not path.startswith(".aligner.sweeps"):
            width = 4 if path.endswith("yaw") and size in (4, 16) else 8
            words = [(path, at + k, width) for k in range(0, size - width + 1, width)]
            found.setdefault(re.sub(r"\[[\d, ]*\]", "", path), []).extend(words)
    return [words for words in found.values() if words]


def bounds_of(code: str) -> list[int]:
    """Every number that the code names."""
    named = re.findall(r"^#define \w+ \(?-?(?:INT64_C\()?(-?\d+|0x[0-9A-Fa-f]+)\)?\)?$", code, re.MULTILINE)
    named += re.findall(r"INT64_C\((-?(?:0x[0-9A-Fa-f]+|\d+))\)", code)
    return sorted({int(number, 0) for number in named if abs(int(number, 0)) < LARGEST})


class DrawingNode(RecordingNode):
    """A recorded node that is called, beside the calls of its world, from records that differ from its own."""

    random: np.random.Generator
    trials: int
    words: list[list[tuple[str, int, int]]]
    bounds: list[int]

    def step(self, nodes, settings, parameters, readings, moment):
        plain = super().step
        for _ in range(self.trials):
            self._elsewhere(nodes, settings, lambda: plain(nodes, settings, parameters, readings, moment))
        return plain(nodes, settings, parameters, readings, moment)

    def aiding(self, nodes, settings, aiding):
        plain = super().aiding
        for _ in range(self.trials):
            self._elsewhere(nodes, settings, lambda: plain(nodes, settings, aiding))
        return plain(nodes, settings, aiding)

    def _elsewhere(self, nodes: np.ndarray, settings: np.ndarray, call: Callable[[], int]) -> None:
        """A call from another record; afterwards all is as before."""
        slot = self._written(self._learnt(nodes, settings))
        before, floats, written = self._integers.copy(), nodes.copy(), self.seen[NODE]
        self.calls.put(KEEP, slot, b"")
        raw = self._integers["node"].view(np.uint8).reshape(-1)
        for path, at, width in self._chosen():
            new = self._drawn(path, raw, at, width)
            raw[at : at + width] = np.frombuffer(struct.pack("<q", new)[:width], np.uint8)
            self.calls.put(PATCH, slot, struct.pack("<iiq", at, width, new))
        self.seen[NODE] = taken_bytes(self._integers[0]["node"], self.calls.layout.node)
        call()
        self._integers[:], nodes[:] = before, floats
        self.calls.put(BACK, slot, b"")
        self.seen[NODE] = written

    def _chosen(self) -> list[tuple[str, int, int]]:
        """Up to eight words, each of a field of its own."""
        return [self._word() for _ in range(self.random.integers(1, 9))]

    def _word(self, beside: str = "") -> tuple[str, int, int]:
        """One of any field, or of one in the same part of the record, where most of what is compared stands."""
        fields = self.words
        if beside and self.random.random() < 0.7:
            part = beside.split(".")[1]
            fields = [field for field in fields if field[0][0].startswith(f".{part}")]
        field = fields[self.random.integers(0, len(fields))]
        return field[self.random.integers(0, len(field))]

    def _drawn(self, path: str, raw: np.ndarray, at: int, width: int) -> int:
        """Another number for a word: beside its own, beside a bound, or that of another word."""
        random = self.random
        own = int.from_bytes(raw[at : at + width].tobytes(), "little", signed=True)
        if width == 8 and 0 <= own < SMALL:
            return int(random.choice([0, 1, 2, max(own - 1, 0), own + 1]))
        kind = random.integers(0, 5)
        if kind == 0:
            new = own + int(random.integers(-1, 2))
        elif kind == 1:
            new = int(random.choice(self.bounds)) + int(random.integers(-1, 2))
        elif kind == 2:
            _, other, wide = self._word(path)
            return int.from_bytes(raw[other : other + wide].tobytes(), "little", signed=True)
        elif kind == 3:
            new = -own
        else:
            new = own * 2 ** int(random.integers(1, 7)) if random.random() < 0.5 else own >> int(random.integers(1, 7))
        return int(np.clip(new, -LARGEST, LARGEST))


def record_drawn_calls(path: Path, seed: int, trials: int, *worlds: Callable[[], object]) -> int:
    """Write the calls of all nodes of these ``worlds`` and, before each of them, ``trials`` from other records."""
    from node.kernels.step import fixed_node

    DrawingNode.random, DrawingNode.trials = np.random.default_rng(seed), trials
    DrawingNode.words, DrawingNode.bounds = drawn_words(), bounds_of(write_c_files().code)
    with recording(path, WHOLE) as calls:
        DrawingNode.calls = calls
        fixed_node.FixedNode = DrawingNode
        for world in worlds:
            world()
    return calls.calls
