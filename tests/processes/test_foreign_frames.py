"""Frames that no process of a stepped rig sent do not move its result, so that attacks on one prove something."""

from __future__ import annotations

import json
import random
import threading
from collections import deque
from pathlib import Path

import pytest
from forked_commands import run as run_forked
from rigs import PATIENCE, running_rig

from telemetry import keys
from telemetry.keys import port_key
from telemetry.media.zenoh_bus import open_client
from telemetry.messages import BASE, ENCODER, Side

pytestmark = pytest.mark.process
RIG = keys.DEFAULT_RIG
FOREIGN = 3000


class Hostile:
    """A neighbour on the bus: puts junk, and frames that it has overheard, on every key of the ports."""

    def __init__(self, endpoint: str) -> None:
        self._endpoint = endpoint
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._attack)
        self.put = 0

    def __enter__(self) -> Hostile:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()

    def _attack(self) -> None:
        lot, overheard = random.Random(7), deque([b"nothing yet"], maxlen=200)
        names = [
            port_key(RIG, address, side, way)
            for address in (1, 2, 3, ENCODER, BASE)
            for side in Side
            for way in ("rx", "tx")
        ]
        with open_client(self._endpoint, PATIENCE) as bus:
            bus.subscribe(f"borechain/{RIG}/port/**", lambda _key, frame: overheard.append(frame))
            publishers = [bus.publisher(name) for name in names]
            for name in ("1", "2", "encoder"):
                publishers.append(bus.publisher(keys.STEP.format(rig=RIG, process=name)))
                publishers.append(bus.publisher(keys.DONE.format(rig=RIG, process=name)))
            publishers.append(bus.publisher(keys.CUE.format(rig=RIG)))
            while not self._end.wait(0.001):
                frame = bytearray(lot.choice(overheard)) if lot.random() < 0.6 else bytearray(lot.randbytes(40))
                if frame and lot.random() < 0.3:
                    frame[lot.randrange(len(frame))] ^= 1 << lot.randrange(8)
                lot.choice(publishers).put(bytes(frame))
                self.put += 1


def test_a_stepped_rig_beside_a_hostile_neighbour_gives_the_digest_of_the_undisturbed(tmp_path: Path) -> None:
    done = run_forked(
        "rig", "rig-3", "--inline", "--json", "--seed", "5", "--out", tmp_path / "inline", timeout=PATIENCE
    )
    undisturbed = json.loads(done.stdout.splitlines()[-1])
    with running_rig(tmp_path, "--seed", "5", "--speed", "60") as rig, Hostile(rig.endpoint) as hostile:
        result = rig.result()
    assert hostile.put >= FOREIGN
    assert result["digest"] == undisturbed["digest"]
    assert (result["restarts"], result["measurements"]) == (0, 6)
