"""Faults of keys and certificates, on a string whose joints and messages are sealed."""

from __future__ import annotations

import numpy as np

from sim.gauntlet.fault import TUBES, Draw, Faulty, Step, draw_interval, drawn_tube, lasting_fault

OF_THE_SURFACE = ("base", "router", "operator", "driller")  # whose certificates end in months
FLIPPED = 0.2  # of the frames


def certificate_ends(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which a certificate ends within days, and is renewed."""
    name = str(random.choice(OF_THE_SURFACE))
    left = float(random.uniform(-5.0, 29.0))
    return lasting_fault(
        5.0,
        40.0,
        lambda rig: rig.keys.let_end(name, left),
        lambda rig: rig.keys.renew(name),
    )(random, begin, end)


def person_revoked(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which a person is let in and shut out again: the files of the rig change under its processes."""
    at, out = draw_interval(random, begin, end, 1.0, 20.0)
    return [Step(at, lambda rig: rig.keys.let_in("guest")), Step(out, lambda rig: rig.keys.shut_out("guest"))]


def wrong_generation(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which a tube has keys of a generation that no other process has."""
    tube = drawn_tube(random)
    return lasting_fault(
        3.0,
        20.0,
        lambda rig: rig.keys.misgive(tube),
        lambda rig: rig.keys.give_back(tube),
    )(random, begin, end)


def tags_flipped() -> Draw:
    """Draw of a fault in which the tags of some frames have one bit changed."""

    def set_rate(rate: float, rig: Faulty) -> None:
        rig.channel.flipped = rate

    return lasting_fault(5.0, 40.0, lambda rig: set_rate(FLIPPED, rig), lambda rig: set_rate(0.0, rig))


def heal_keys(rig: Faulty) -> None:
    """What a crew does at last: every process has its keys, and no certificate ends."""
    for tube in TUBES:
        rig.keys.give_back(tube)
    for name in OF_THE_SURFACE:
        rig.keys.renew(name)
