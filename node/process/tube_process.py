"""A tube as a process: firmware, telemetry station and saved state, driven by events."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from node.errors import SavedStateError
from node.firmware.saved_state import resume
from node.firmware.settings import TubeSettings
from node.firmware.tube import ImuReading, Surroundings, Tube
from node.kernels.layout import Array, default_config, new_state
from node.process.counter import BootCounter
from node.process.journal import Journal
from telemetry.application.driven import Driven
from telemetry.application.station import Station
from telemetry.errors import EncodeError
from telemetry.messages import Aiding, Command, Event, NodeState, Reply, Severity, Side, SurveyMeasurement

SAVE_EVERY = 19  # cycles, 10 s
SYNCHRONISED_STD = 0.02  # s
MAX_CLOCK_STD = 3600.0


class TubeProcess(Driven):
    """Everything one tube's processor runs, without a clock or a bus of its own.

    Parameters
    ----------
    settings : what the crew entered
    folder : where the state is saved
    config : one record of dtype ``CONFIG``; the default is that of an MPU6500-class node
    """

    def __init__(self, settings: TubeSettings, folder: Path, config: Array | None = None) -> None:
        self.settings = settings
        self.config = default_config() if config is None else config
        self._journal = Journal(folder)
        # apart from the saved state: a neighbour must not take a life that lost it for an earlier one
        self.boots = BootCounter(folder).boots
        saved, fault = self._load()
        self.state, telemetry = saved if saved else (new_state(self.config), None)
        if saved:
            resume(self.state)
        self.station = Station(
            settings.tube,
            frozenset(Side),
            boot_count=self.boots,
            restored=telemetry,
        )
        self.tube = Tube(settings, self.config, self.state, self.station.new_sequence, restored=saved is not None)
        self._cycles = 0
        self._fault = fault
        self._announced = False
        self._save()

    def on_frame(self, side: Side, frame: bytes, now: float) -> None:
        """A frame arrived at one end (``now``: s, own clock)."""
        for received in self.station.receive(side, frame, now):
            message = received.message
            if isinstance(message, Aiding) and received.side is Side.UPPER:
                self._on_aiding(message, now)
            elif isinstance(message, Command):
                self.station.reply(self._obey(message), now)
                self._save()

    def on_cycle(self, data: Any, now: float) -> None:
        """The IMU delivered a cycle: ``data`` is start (s), three rates (rad/s), three forces (m/s^2)."""
        start, wx, wy, wz, fx, fy, fz = data
        around = self._surroundings(now)
        if around.synchronised:
            self._announce(around.rig_now, now)
        urgent = False
        for said in self.tube.on_cycle(ImuReading(start, now, (wx, wy, wz), (fx, fy, fz)), around):
            urgent |= self._say(said, now)
        self._cycles += 1
        self.station.advance(now)
        if urgent or self._cycles % SAVE_EVERY == 0:
            self._save()

    def _on_aiding(self, aiding: Aiding, now: float) -> None:
        clock = self.station.clock
        if not clock.synchronised:
            return
        onward = self.tube.on_aiding(aiding, clock.local_from_rig(aiding.valid_at))
        if onward is not None:
            self.station.send_aiding(onward, now)

    def _surroundings(self, now: float) -> Surroundings:
        clock = self.station.clock
        var = min(clock.variance(now), MAX_CLOCK_STD**2)
        return Surroundings(
            joined=self.station.neighbours[Side.UPPER] is not None,
            hops=self.station.hops,
            rig_now=clock.rig_from_local(now),
            clock_var=var,
            synchronised=clock.synchronised and var < SYNCHRONISED_STD**2,
        )

    def _say(self, said: Aiding | SurveyMeasurement | Event | NodeState, now: float) -> bool:
        """Hand a message to the telemetry; returns whether it must be saved before it may be lost."""
        try:
            if isinstance(said, NodeState):
                self.station.send_state(said, now)
            elif isinstance(said, Aiding):
                self.station.send_aiding(said, now)
            else:
                self.station.submit(said, now)
                return True
        except EncodeError:
            # numbers beyond any range are the filter's trouble, which it reports itself; the cycle goes on
            self.station.counters["unsayable"] += 1
        return False

    def _announce(self, rig_now: float, now: float) -> None:
        """Tell once, as soon as rig time is known, that the node started and what it found on its disk."""
        if self._announced:
            return
        self._announced = True
        self.station.submit(self.tube.boot_event(rig_now), now)
        if self._fault:
            sequence = self.station.new_sequence()
            detail = {"detail": self._fault[:200]}
            event = Event(self.settings.tube, sequence, rig_now, Severity.ERROR, "saved_state_lost", dict(detail))
            self.station.submit(event, now)

    def _obey(self, command: Command) -> Reply:
        match command.name:
            case "take_survey":
                self.tube.take_survey()
                return Reply(self.settings.tube, command.sequence, True, "at the next settled cycle")
            case _:
                known = "take_survey"
                return Reply(self.settings.tube, command.sequence, False, f"expected {known}, got {command.name}")

    def _load(self) -> tuple[tuple[Array, bytes] | None, str]:
        try:
            return self._journal.load(), ""
        except SavedStateError as error:
            return None, str(error)

    def _save(self) -> None:
        self._journal.save(self.state, self.station.export_state())
