"""The story of one tube, told in a process of its own: what it said and what its record is, as one digest.

Rests and turns, faults of sensors, orders, a block of parameters, a save, and a start from it. ``COMMAND`` tells it by
numba (``fixed``) or by the C library, in a process without numba (``library``).
"""

import hashlib
import itertools
import json
import math
import time
from pathlib import Path

import numpy as np
from rough_node import RoughNode

from node.firmware.inputs import ImuReading, RigContext
from node.firmware.saved_state import pack_state_slot, resume_node, unpack_state_slot
from node.firmware.tube import Tube
from node.firmware.tube_settings import ImuSettings, MakeUpAngle, TubeSettings
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from telemetry.frozen import replace
from telemetry.messages import Aiding
from telemetry.parameters import ParameterBlock, SensorParameters

COMMAND = """
import sys, time
began = time.perf_counter()
kernel, cycles = sys.argv[1], int(sys.argv[2])
if kernel == "library":
    from node.uncompiled.numba_stand_in import stand_in_for_numba
    stand_in_for_numba()
from library_story import tell_story
tell_story(kernel, cycles, began)
"""
BLOCK = ParameterBlock(
    3,
    1,
    SensorParameters(bias=(1e-3, -2e-3, 5e-4), bias_slopes=((1e-5, 0.0, 0.0), (0.0,) * 3, (0.0,) * 3)),
    SensorParameters(matrix=((1.001, 0.0, 1e-4), (0.0, 0.999, 0.0), (2e-4, 0.0, 1.0))),
)


def reading_of(rows: np.ndarray, moment: np.ndarray) -> ImuReading:
    """A cycle's reading, as the process hands it to the firmware."""
    made = []
    for row in rows.tolist():
        parts = tuple(row[11:20]) if row[10] else ()
        made.append(
            ImuReading(
                *moment[:2].tolist(), tuple(row[:3]), tuple(row[3:6]), row[6], int(row[7]), row[8], row[9], parts
            )
        )
    return replace(made[0], others=tuple(made[1:]))


def context_of(moment: np.ndarray) -> RigContext:
    """What the telemetry says in a cycle."""
    joined, hops, var, synchronised, stepped, drift = moment[2:8].tolist()
    return RigContext(bool(joined), int(hops), float(moment[1]) + 0.25, var, bool(synchronised), 7, stepped, drift)


def aiding_of(told: np.ndarray) -> Aiding:
    """The same as a message; its time is handed over beside it."""
    yaw, var, systematic, offset, rate, at, sequence, hops, torque, torsion, held, _ = told.tolist()
    return Aiding(yaw, var, systematic, offset, rate, at, int(sequence), int(hops), torque, torsion, bool(held), 7)


class Story:
    """One tube and what it has said."""

    def __init__(self, imus: int, kernel: str) -> None:
        cluster = tuple(ImuSettings(noise=1.0 + 0.2 * k) for k in range(imus))
        joint = MakeUpAngle(0.3, 1e-3)
        self.settings = TubeSettings(
            tube=3,
            drive_joint=joint,
            lower_joint=joint,
            stiffness=3e4,
            torsion="variance",
            joints="both",
            kernel=kernel,
            imus=cluster,
        )
        self.configs, self.numbers = default_config(), itertools.count(1)
        self.nodes = new_node(self.configs)
        self.tube = self.begin(restored=False)
        self.rough = RoughNode(imus, np.random.default_rng(imus))
        self.digest, self.said = hashlib.sha256(), 0

    def begin(self, *, restored: bool) -> Tube:
        return Tube(
            self.settings,
            self.configs,
            self.nodes,
            self.numbers.__next__,
            restored=restored,
            parameters=BLOCK if restored else None,
        )

    def order(self, k: int) -> object:
        """What is ordered before cycle ``k``."""
        tube = self.tube
        if k % 97 == 0:
            tube.take_survey()
        if k % 211 == 60:
            return tube.start_record(6.0, k)
        if k % 400 == 150:
            return tube.align("extremes", 2.0)
        if k % 900 == 700:
            return tube.align("none", 0.0)
        if k == 160:
            tube.prepare(BLOCK)
            tube.use(BLOCK)
        if k == 350:
            self.nodes = unpack_state_slot(pack_state_slot(self.nodes, b"blob", 5)).nodes
            resume_node(self.nodes, self.configs)
            self.tube = self.begin(restored=True)
        return None

    def turn(self, k: int) -> None:
        """One cycle, and an aiding after most."""
        self.tell(self.order(k))
        rows, moment = self.rough.step(k)
        for message in self.tube.on_cycle(reading_of(rows, moment), context_of(moment)):
            self.tell(message)
        if k % 3:
            told = self.rough.aiding(k)
            self.tell(self.tube.on_aiding(aiding_of(told), float(told[5]), 1e-6 if k % 2 else math.ulp(1.0)))
        self.digest.update(self.nodes.tobytes())

    def tell(self, message: object) -> None:
        """Take what was said into the digest."""
        self.said += message is not None
        self.digest.update(repr(message).encode())


def tell_story(kernel: str, cycles: int, began: float) -> None:
    """Tell it of a node of one IMU and of one of three, and print what came of it, in JSON."""
    stories = [Story(1, kernel), Story(3, kernel)]
    stories[0].turn(0)
    started = time.perf_counter() - began
    status = Path("/proc/self/status").read_text(encoding="utf-8")
    size = int(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM")))  # kB, since the start
    begun = time.process_time()
    for k in range(1, cycles):
        for story in stories:
            story.turn(k)
    a_turn = (time.process_time() - begun) / (2 * cycles)
    found = {"said": [story.said for story in stories], "digests": [story.digest.hexdigest()[:16] for story in stories]}
    found |= {"llvm": "llvmlite" in Path("/proc/self/maps").read_text(encoding="utf-8")}
    print(json.dumps(found | {"start_s": started, "memory_mb": size / 1024.0, "turn_ms": 1e3 * a_turn}))
