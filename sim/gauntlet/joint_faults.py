"""Faults of the joints and of clocks."""

from __future__ import annotations

import numpy as np

from sim.gauntlet.fault import EVERYBODY, TUBES, Draw, Faulty, Step, draw_interval, lasting_fault
from telemetry.messages import BASE, ENCODER, Side

PORTS = (
    (BASE, Side.LOWER),
    (ENCODER, Side.UPPER),
    (ENCODER, Side.LOWER),
    (2, Side.UPPER),
    (2, Side.LOWER),
    (1, Side.UPPER),
)
TOP_JOINT = {(ENCODER, Side.LOWER), *((tube, Side.UPPER) for tube in TUBES)}


def disturb_frames(**rates: float) -> Draw:
    """Draw of a fault that disturbs frames at these rates for a while."""

    def set_rates(rig: Faulty) -> None:
        for name, rate in rates.items():
            setattr(rig.channel, name, rate)

    def reset(rig: Faulty) -> None:
        for name in rates:
            setattr(rig.channel, name, 0.0)

    return lasting_fault(5.0, 60.0, set_rates, reset)


def sever_joint(*, both_ways: bool) -> Draw:
    """Draw of a fault that lets nothing pass the top joint, both ways or downward."""
    ends = TOP_JOINT if both_ways else {(ENCODER, Side.LOWER)}
    return lasting_fault(
        2.0,
        25.0,
        lambda rig: rig.channel.severed.update(ends),
        lambda rig: rig.channel.severed.difference_update(ends),
    )


def asymmetric_loss(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which one port loses nearly all it sends while the other end is heard well."""
    port = PORTS[int(random.integers(len(PORTS)))]
    rate = float(random.uniform(0.6, 0.98))

    def recover(rig: Faulty) -> None:
        rig.channel.port_loss.pop(port, None)

    return lasting_fault(5.0, 40.0, lambda rig: rig.channel.port_loss.update({port: rate}), recover)(random, begin, end)


def slow_process(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which everything that a process sends comes late."""
    address, late = int(random.choice(EVERYBODY)), float(random.uniform(0.1, 1.5))
    ports = {port: late for port in PORTS if port[0] == address}

    def recover(rig: Faulty) -> None:
        for port in ports:
            rig.channel.port_delay.pop(port, None)

    return lasting_fault(5.0, 40.0, lambda rig: rig.channel.port_delay.update(ports), recover)(random, begin, end)


def clock_jumps(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the clock of a process jumps ahead, for good."""
    address = int(random.choice(EVERYBODY))
    by = float(random.uniform(0.2, 20.0))
    at = float(random.uniform(begin, end))
    return [Step(at, lambda rig: rig.world.jumps.update({address: rig.world.jumps.get(address, 0.0) + by}))]


def clock_drifts(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the clock of a process begins to run up to 0.1 % fast or slow."""
    address, rate = int(random.choice(EVERYBODY)), float(random.uniform(-1e-3, 1e-3))
    at, _ = draw_interval(random, begin, end, 1.0, 1.0)
    return [Step(at, lambda rig: rig.world.let_drift(address, rig.now, rate))]
