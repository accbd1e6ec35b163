"""A ground station that hears a whole string without its link: messages and depths in the order of rig time.

The firmware of every node runs on the sensors of a world (``sim.string.direct_string``); what it has to say comes to
the ground station's own process, which stores, places and judges it as it does on a rig. Frames, losses and processes
are left out, so that a rig of ten tubes costs a second.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from operator import attrgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import numpy as np

from groundstation.config import checked_config
from groundstation.recording.ground_replay import TapeClock
from groundstation.service.process.ground_process import GroundProcess
from sim.gauntlet.faulty_disk import FaultyDisk
from sim.rig.ground_settings import ground_settings
from sim.string.direct_string import DirectString
from sim.string.result import StringRun
from sim.world.world import World
from telemetry.application.depth_source import DepthSource
from telemetry.frozen import replace
from telemetry.messages import Event, NodeState, SurveyMeasurement
from telemetry.presentation.msgpack_codec import encode_message

RIG: Final = "study"
EPOCH: Final = 1
STATE_EVERY: Final = 4  # cycles
IN_ONE: Final[Mapping[str, Any]] = {"weighting": "adjusted"}  # settings by which the hole is adjusted in one
Heard = NodeState | SurveyMeasurement | Event


@contextmanager
def heard_ground(world: World, settings: Mapping[str, Any] | None = None) -> Iterator[GroundProcess]:
    """Yield the ground station of a world's rig at the end of its schedule.

    Parameters
    ----------
    world : of a scenario whose link is off
    settings : of the ground station, beside and before those of the scenario

    Raises
    ------
    ScenarioError
        When the scenario has its link on.
    """
    run = DirectString(world, state_every=STATE_EVERY).drill()
    with TemporaryDirectory(prefix="borechain-") as folder:
        config = checked_config(rig=RIG, folder=Path(folder), **{**ground_settings(world), **(settings or {})})
        # a disk in memory: a thousand rigs are to wait for no other
        ground = GroundProcess(config, lambda _below: 0, FaultyDisk(np.random.default_rng(0)))
        try:
            tell_ground(ground, world, run)
            yield ground
        finally:
            ground.store.close()


def tell_ground(ground: GroundProcess, world: World, run: StringRun) -> None:
    """Tell a ground station the depths and messages of a run."""
    clock, source = TapeClock(world.begin, EPOCH), DepthSource()
    ground.clock = clock
    heard = messages_by_cycle(run)
    for cycle, end in enumerate(world.ends.tolist()):
        clock.rig_now = end
        ground.on_depth(encode_message(source.measure(end, max(world.measured_depth(end), 0.0))), end)
        for message in heard.get(cycle, ()):
            ground.on_message(replace(message, epoch=EPOCH), end)
        ground.before_frames()
    ground.watch.look(clock.rig_now)  # once: after every survey it would have the hole adjusted as often


def messages_by_cycle(run: StringRun) -> dict[int, list[Heard]]:
    """What the nodes said, by the cycle in which they did: states, so that their order is known, before surveys."""
    found: dict[int, list[Heard]] = defaultdict(list)
    for cycle, state in run.states:
        found[cycle].append(state)
    for cycle, event in run.events:
        found[cycle].append(event)
    for survey in sorted((*run.surveys, *run.revisions), key=attrgetter("said")):
        found[survey.said].append(survey.measurement)
    return found
