"""Whether anything on the rig could have shown that the encoder, or the depth, was wrong.

That the encoder slipped shows only against a gyroscope that ran through it. Where three faults or more leave none, a
slip is a turn of the string to everything that measures, and no alarm can be asked for. A depth that is wrong shows
against one that was known before: not to a ground station that starts then with a database restored from a backup.
"""

from __future__ import annotations

from collections.abc import Iterator

from borechain.gauntlet.gauntlet_rig import GauntletRig
from node.process.tube_process import TubeProcess
from sim.gauntlet import readings
from sim.gauntlet.fault import TUBES
from telemetry.messages import BASE, ENCODER, NodeMode

AROUND = 10.0  # s before and after an instant that a tube must have watched to speak of it


class FaultObservability:
    """Notes after each step of a fault which tubes have a gyroscope, and whether the encoder went wrong."""

    def __init__(self, rig: GauntletRig) -> None:
        self._rig = rig
        self._log: list[tuple[float, frozenset[int]]] = [(rig.now, frozenset(TUBES))]  # s, tubes that see from then on
        self._encoder = self._shown()
        self._wrong_at: list[float] = []
        self._had_ground, self._handled = True, 0  # times that the database was
        self._rested: set[int] = set()  # tubes that stood still when they had power last
        self._nobody_could_know = False
        self.has_believed_a_wrong_depth = False
        rig.after_step.append(self.note)
        rig.before_cut.append(self._note_rests)

    def note(self) -> None:
        """Note the present state of the rig."""
        self._log.append((self._rig.now, frozenset(tube for tube in TUBES if self._sees(tube))))
        if self._shown() != self._encoder:
            self._encoder = self._shown()
            self._wrong_at.append(self._rig.now)
            is_dark = {ENCODER, *TUBES} <= self._rig.off.keys()
            self._nobody_could_know |= is_dark and not self._rested
        self._note_depth()

    def _note_rests(self) -> None:
        for tube in TUBES:
            process = self._rig.stepper.processes.get(tube)
            if isinstance(process, TubeProcess):
                is_quiet = bool(process.tube.state["still_cycles"] > 0)
                self._rested = self._rested | {tube} if is_quiet else self._rested - {tube}

    def _note_depth(self) -> None:
        has_ground, handled = self._rig.ground is not None, self._rig.disk(BASE).handled
        if has_ground and not self._had_ground:
            self.has_believed_a_wrong_depth |= handled > self._handled and self._rig.world.depth_error != 0.0
            self._handled = handled
        self._had_ground = has_ground

    @property
    def nobody_could_know(self) -> bool:
        """Whether the encoder went wrong while all were without power and had turned when they lost it.

        That is a string that was turned in the dark: what was saved of the yaws is worth nothing.
        """
        return self._nobody_could_know

    @property
    def has_seen(self) -> bool:
        """Whether a tube watched any of the instants at which the encoder went wrong; True where it never did."""
        return not self._wrong_at or any(self._watched(at) for at in self._wrong_at)

    def _watched(self, at: float) -> bool:
        return bool(frozenset(TUBES).intersection(*self._seeing(at - AROUND, at + AROUND)))

    def _seeing(self, begin: float, end: float) -> Iterator[frozenset[int]]:
        """Tubes that observed the encoder in each part of an interval (s)."""
        ends = [since for since, _ in self._log[1:]] + [self._rig.now]
        for (since, tubes), until in zip(self._log, ends, strict=True):
            if since < end and until > begin:
                yield tubes

    def _sees(self, tube: int) -> bool:
        """Whether a tube has a gyroscope, and is told what the encoder counts."""
        stepper = self._rig.stepper
        process = stepper.processes.get(tube)
        chain = (ENCODER, *(other for other in TUBES if other >= tube))  # tube 1 is the lowest
        if not isinstance(process, TubeProcess) or any(stepper.is_frozen(one) for one in chain):
            return False
        if any(one not in stepper.processes for one in chain):
            return False
        has_gyroscope = self._rig.world.spoilers.get(tube) in (None, *readings.OF_FORCE)
        return has_gyroscope and process.tube.state["mode"] != NodeMode.STATIC_BIAS

    def _shown(self) -> tuple[int, float | None]:
        return self._rig.world.slipped, self._rig.world.stuck_at
