"""How much of what may be at once has been: the measure of the gauntlet's seeds.

A look at a rig finds facts about it: what has no power, which mode and flags each tube has, what stands wrong, what
waits. Two facts that are found in one look are a pair; the pairs that some look of some seed has found are covered.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from borechain.gauntlet.gauntlet_rig import GauntletRig
from node.process.tube_process import TubeProcess
from sim.gauntlet.fault import EVERYBODY, TUBES
from telemetry.messages import BASE, NodeFlag, NodeMode

MANY = 4  # messages that wait for their receipts
Pair = tuple[str, str]


class CoveredStates:
    """Pairs of facts that were true of a rig at once."""

    def __init__(self, rig: GauntletRig) -> None:
        self._rig = rig
        self._looks: set[frozenset[str]] = set()

    def look(self) -> None:
        """Look at the rig now."""
        self._looks.add(frozenset(facts_of(self._rig)))

    @property
    def pairs(self) -> set[Pair]:
        """Every pair of facts, each in the order of its names."""
        return {pair for facts in self._looks for pair in combinations(sorted(facts), 2)}


def facts_of(rig: GauntletRig) -> Iterator[str]:
    """Facts about a rig, as words."""
    yield f"phase {next((phase.kind for phase in rig.world.phases if rig.now < phase.end), 'end')}"
    for address in EVERYBODY:
        yield from _facts_of_process(rig, address)
    yield from _facts_of_ground(rig)


def _facts_of_process(rig: GauntletRig, address: int) -> Iterator[str]:
    process, disk = rig.stepper.processes.get(address), rig.disk(address)
    if process is None:
        yield f"{address} off"
        return
    if rig.stepper.is_frozen(address):
        yield f"{address} frozen"
    if disk.refusal:
        yield f"{address} disk {disk.refusal}"
    endpoint = process.endpoint
    if not endpoint.clock.synchronised:
        yield f"{address} without rig time"
    if waiting := endpoint.mail.outbox_size:
        yield f"{address} {'many' if waiting > MANY else 'few'} wait"
    yield from (f"{address} deaf {side.name}" for side, one in endpoint.place.neighbours.items() if one is None)
    if isinstance(process, TubeProcess):
        yield f"{address} {NodeMode(int(process.tube.state['mode'])).name}"


def _facts_of_ground(rig: GauntletRig) -> Iterator[str]:
    if rig.ground is None or BASE in rig.off:
        return
    model, string = rig.ground.model, rig.ground.model.string
    for alarm in model.rig_alarms:
        yield f"alarm {alarm.kind.code}"
    for doubt in rig.inline.ask("verdict")["doubts"]:
        yield f"doubt {doubt}"
    for tube in TUBES:
        state = string.states.newest.get(tube)
        yield from (f"{tube} said {flag.name}" for flag in (NodeFlag(0) if state is None else state.flags))
        if string.numbers.gap(tube) is not None:
            yield f"{tube} lacks numbers"
    yield from {f"{one.message.tube} unplaced" for one in model.placement.waiting}
    yield from (f"{tube} owed" for stop in string.stops if stop.judged for tube in stop.missing)
    yield f"health {rig.inline.ask('status')['health']}"
