"""What a process of the simulated rig runs beside its nodes and its ground station: the world, and the router."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import partial
from pathlib import Path
from typing import Any

import msgpack

from borechain.pki.access import MEDIUM, ROUTER, read_access
from sim.rig.transports import Transports
from telemetry import keys
from telemetry.media.credentials import Credentials, credentials_for
from telemetry.media.zenoh_bus import ZenohBus, open_client, open_router, use_few_threads
from telemetry.media.zenoh_port import CONNECT_TIMEOUT
from telemetry.runtime.hosting import Place, begin_process, on_termination, reporting_errors, write_warning

SAY_EVERY = 10.0  # wall s, of who is waited for


def run_medium(
    place: Place,
    scenario: Path,
    seed: int,
    speed: float,
    faults: tuple[str, ...],
    router: bool,
    cued: bool = False,
    transports: Transports | None = None,
    hole: str = "",
    near: str = "",
) -> None:
    """World, joints and clock; in a rig without an outside router its session is the router.

    ``cued`` says that a launcher has started all processes and plays the operator; without one, the rig waits for every
    process to join, since compiling takes an unknown time. ``transports`` says which joints are not on zenoh, ``hole``
    which one of the scenario's site is drilled. At the endpoint ``near`` its session is the router of the tubes: no
    process stands between it and them.
    """
    from sim.rig.bus_stepper import BusStepper
    from sim.rig.rig_progress import RigProgress
    from sim.rig.scheduler import Scheduler
    from sim.world.scenario import load_scenario
    from sim.world.world import World
    from telemetry.radio.soil_dielectric import PorosityWarning

    begin_process("medium")
    with reporting_errors("medium"):
        seal_depth = depth_sealer(place.keys)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PorosityWarning)  # the user was warned at the start of the rig
            found = load_scenario(scenario, faults)
            world = World(found.drilling(hole) if hole else found, seed)
        if router:
            session = opened_router(place.endpoint, place.keys)
        elif near:
            use_few_threads(routes=True)
            session = open_router(near, beyond=place.endpoint)
        else:
            use_few_threads()
            credentials = credentials_for(place.endpoint, place.keys, MEDIUM)
            session = open_client(place.endpoint, CONNECT_TIMEOUT, credentials)
        with session as bus:
            wanted = bus.publisher(keys.WANTED.format(rig=place.rig))
            medium_of = (transports or Transports()).medium_of
            stepper = BusStepper(bus, place.rig, medium_of=medium_of, steps=place.steps)

            def tell(progress: RigProgress) -> None:
                wanted.put(pack_progress(progress))

            absent = None if cued else say_absent
            scheduler = Scheduler(world, stepper, tell, speed, cued=cued, seal_depth=seal_depth, absent=absent)
            on_termination(scheduler.stop)
            with contextlib.closing(stepper):
                is_whole = scheduler.run()
                if stepper.foreign:
                    write_warning("medium", f"{stepper.foreign} frames that no process of the rig sent were dropped")
                if is_whole:
                    scheduler.linger()


def say_absent(name: str, waited: float) -> None:
    """Report now and then which processes have not joined the rig (wall s)."""
    if waited > 0.0 and waited % SAY_EVERY == 0.0:
        sys.stderr.write(f"borechain medium: {name} has not joined for {waited:.0f} s, it is waited for\n")
        sys.stderr.flush()


def depth_sealer(place: Path | None) -> Callable[[bytes], bytes]:
    """What the source of the depth makes of its readings, with its keys from a file or folder, if there are any."""
    if place is None:
        return bytes
    from telemetry.application.depth_seal import seal_depth
    from telemetry.media.credentials import DEPTH_SOURCE
    from telemetry.transport.key_ring import key_file, read_ring

    return partial(seal_depth, read_ring(key_file(place, DEPTH_SOURCE), DEPTH_SOURCE))


def guard_of(endpoint: str, place: Path | None) -> tuple[Credentials | None, dict[str, Any] | None]:
    """What a router shows over TLS and whom it lets do what; nothing of both without TLS."""
    credentials = credentials_for(endpoint, place, ROUTER)
    return credentials, None if credentials is None else read_access(credentials.authority.parent)


def opened_router(endpoint: str, keys_place: Path | None = None) -> AbstractContextManager[ZenohBus]:
    """Session at which the processes of a rig meet, over TLS guarded by its keys.

    Raises
    ------
    MediumError, KeyFileError
        When the endpoint cannot be listened on, or there are no keys for it.
    """
    return open_router(endpoint, *guard_of(endpoint, keys_place))


def pack_progress(progress: object) -> bytes:
    """Wire form of the medium's progress, read by the launcher's ``Tick``."""
    from sim.rig.rig_progress import RigProgress

    if not isinstance(progress, RigProgress):
        raise TypeError(f"expected Progress, got {type(progress).__name__}")
    p = progress
    return bytes(msgpack.packb([p.phase, p.rig_time, p.begin, p.end, p.wanted, p.kill, p.finished, p.cue]))
