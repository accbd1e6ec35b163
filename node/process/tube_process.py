"""A tube as a process: firmware, telemetry endpoint and saved state, driven by events."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from node.errors import NodeConfigurationError
from node.firmware.inputs import RigContext
from node.firmware.saved_state import resume_node
from node.firmware.sensor_config import sensor_config
from node.firmware.silent_tubes import aiding_across_silent
from node.firmware.tube import Tube
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import Array
from node.kernels.filter.resets import doubt_bias, forget_bias, lose_tilt
from node.kernels.record.filter_record import Scheme, default_config
from node.kernels.record.node_record import new_node
from node.kernels.record.sensor_record import new_mount
from node.process.bias_search import BiasSearch
from node.process.block_store import BlockStore
from node.process.block_updater import BlockUpdater, load_parameters
from node.process.board_watch import BoardPlaces, BoardWatch
from node.process.command_handlers import CommandHandlers
from node.process.counter import BootCounter
from node.process.drivers.source import ImuSource, SafeImu
from node.process.reading import reading_from, reading_of
from node.process.saver import Saver
from node.process.survey_log import SurveyLog
from node.process.temperature_range import TemperatureRange
from node.process.temperature_watch import TemperatureWatch
from telemetry.application.endpoint import REPORT_EVERY, Endpoint
from telemetry.application.seal_watch import SealWatch
from telemetry.errors import EncodeError
from telemetry.frozen import replace
from telemetry.messages import (
    EPOCH_UNKNOWN,
    Aiding,
    BlockSegment,
    Command,
    Event,
    Kept,
    NodeFlag,
    NodeState,
    Scalar,
    Severity,
    Side,
    StaticRecord,
    SurveyMeasurement,
)
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.runtime.disk import MACHINE, Disk
from telemetry.runtime.joint_watch import JointFault
from telemetry.runtime.process_interface import Process
from telemetry.runtime.timing import CycleStage, CycleTiming
from telemetry.unwritten import Content

if TYPE_CHECKING:
    from telemetry.application.seals import Seals

SYNCHRONISED_STD = 0.05  # s, what the time-stamp state of the filter can take
MAX_CLOCK_STD = 3600.0
RESENT_TOGETHER = 64  # surveys sent again at one order
OVERRUN_EVERY = 60.0  # s between two events about overruns, so that a board too slow is not slowed further


class TubeProcess(Process):
    """Everything one tube's processor runs, without a clock or a bus of its own.

    Parameters
    ----------
    settings : what the crew entered
    folder : where the state is saved
    config : one record of dtype ``CONFIG``; the default is that of an MPU6500-class node, and of one with sensors of
        its own that of ``node.firmware.sensor_config``
    key : of the rig; without one, and without seals, the node takes no parameter block
    imus : the node's own sensors, as many as the settings have; without any a cycle brings its reading
    timing : durations of its cycles with an own clock; None where it is stepped
    disk : that holds the folder
    seals : what it says and believes under keys; None: everybody is believed
    places : what its board has beside the sensors; None: its folder

    Raises
    ------
    SensorError
        When the sensor is absent at the start.
    """

    def __init__(
        self,
        settings: TubeSettings,
        folder: Path,
        config: Array | None = None,
        key: bytes | None = None,
        imus: Sequence[ImuSource] = (),
        timing: CycleTiming | None = None,
        disk: Disk = MACHINE,
        seals: Seals | None = None,
        places: BoardPlaces | None = None,
    ) -> None:
        self.settings = settings
        self._timing = timing
        self._overrun_told = -math.inf
        if len(imus) not in (0, len(settings.imus)):
            raise NodeConfigurationError(f"imus: expected {len(settings.imus)} sources, got {len(imus)}")
        if seals is not None and settings.scheme is not Scheme.FORWARD:
            raise NodeConfigurationError(f"scheme: expected forward with keys, got {settings.scheme.name.lower()}")
        for imu in imus:
            imu.start()
        self._sources = imus
        self._imus = [SafeImu(imu, self._send_event, k if len(imus) > 1 else 0) for k, imu in enumerate(imus, 1)]
        store = BlockStore(folder, disk)
        parameters = load_parameters(store, settings.tube)
        if config is None:
            config = sensor_config(settings, parameters) if imus else default_config()
        self.config = config
        self._saver = Saver(folder, disk, settings.tube)
        saved = self._saver.load()
        # apart from the saved state: a node that lost its state must not look like an earlier boot
        counter = BootCounter(folder, disk=disk, is_own=not self._saver.is_of_another)
        self.boots, self._counter_fault = counter.boots, counter.fault
        self._log = SurveyLog(folder, disk)
        self._dropped = 0
        self._looked_at_drops = -math.inf
        self.nodes, telemetry = saved if saved else (new_node(self.config), None)
        self._cut = resume_node(self.nodes, self.config) if saved else False
        self._fallback = "; ".join(store.faults)
        if self._fallback:
            state = self.nodes[0]["filter"]
            forget_bias(state, self.config[0])
            lose_tilt(state)
            self.nodes["mount"] = new_mount()
        self.endpoint = Endpoint(
            settings.tube,
            frozenset(Side),
            boot_count=self.boots,
            restored=telemetry,
            reach=settings.reach,
            seals=seals,
        )
        self._seal_watch = SealWatch(self.endpoint, self._send_event)
        restored = saved is not None
        next_sequence = self.endpoint.mail.series.take
        self.tube = Tube(
            settings,
            self.config,
            self.nodes,
            next_sequence,
            restored=restored,
            parameters=parameters,
        )
        self._warmth = TemperatureWatch(self._send_event, settings.imus, lambda: self.tube.parameters)
        self._range = TemperatureRange(self._send_event, settings.imus)
        if self._range.watched:
            doubt_bias(self.state[0], 0, 0.0)  # compiled before the first cycle
        self._search = BiasSearch(self._send_event)
        self._board = BoardWatch(settings, self._imus, places or BoardPlaces(folder))
        self._commands = CommandHandlers(self.tube, timing, self._resend, self._board)
        self._now = 0.0
        self._announced = False
        self._skipped = 0  # silent tubes above, as they were last told of
        own_keys = [] if key is None else [key]
        block_keys = (lambda: own_keys) if seals is None else (lambda: seals.block_keys)
        self._blocks = BlockUpdater(self.tube, store, block_keys, self._send_event, self._save)
        # what a start goes on with is on the disk, with its rest: power that comes and goes costs nothing
        if saved is None or self._fallback or self._saver.due:
            self._save()

    @property
    def state(self) -> Array:
        """The filter of the node, one-element array of dtype ``STATE``."""
        return np.asarray(self.nodes["filter"])

    def on_frame(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> None:
        """A frame arrived at one end (``now``: s, own clock), by radio with a ``margin`` (dB)."""
        self._now = now
        for received in self.endpoint.receive(side, frame, now, margin):
            message = received.message
            if isinstance(message, Aiding) and received.side is Side.UPPER:
                self._on_aiding(message, now)
            elif isinstance(message, Command):
                self.endpoint.mail.reply(self._commands.obey(message))
                self._save()
            elif isinstance(message, BlockSegment):
                self.endpoint.mail.send_status(self._blocks.on_segment(message, now))
        self._save_if_due()

    def on_cycle(self, data: Any, now: float) -> None:
        """The IMU delivered a cycle: ``data`` is start (s), three rates (rad/s), three forces (m/s^2), raw.

        A sensor that knows its temperature (C) adds it. Of a cluster the numbers of each IMU are a list. Sensors of the
        node's own stand for the reading.
        """
        self._now = now
        reading = reading_of(data, now)
        if self._imus:
            start, samples = reading.start, [imu.read(reading.start, now) for imu in self._imus]
            first, *others = [reading_from(sample, start, now) for sample in samples]
            reading = replace(first, others=tuple(others))
        self._board.look(reading, still=bool(self.state[0]["still_cycles"] > 0))
        reading = self._warmth.look(reading)
        self._range.look(reading, self.state[0], self.nodes[0]["config"])
        self._lap(CycleStage.READ)
        context = self._context(now)
        if context.synchronised:
            self._announce(context.rig_now, now)
            self._tell_of_silent_tubes()
        said = self.tube.on_cycle(reading, context)
        self._search.look(self.state[0], self.config[0], now, lost=not math.isfinite(reading.rate[2]))
        self._lap(CycleStage.FILTER)
        for message in said:
            if isinstance(message, Event) and message.code == "clock_jumped":
                self.endpoint.clock.doubt(jump_of(message))
            self._send(message, now)
        if self._blocks.trying and (status := self._blocks.on_cycle(self.tube.raw)) is not None:
            self.endpoint.mail.send_status(status)
        if self._timing is None:  # an own clock advances time between the cycles
            self.endpoint.advance(now)
        self._lap(CycleStage.REPORT)
        if self._announced:
            self._saver.report(self._send_event)
            self._report_drops(now)
            self._seal_watch.look(now)
        self._saver.count_cycle(self.nodes)
        if self._save_if_due():
            self._lap(CycleStage.SAVE)

    def on_overrun(self, missed: int, now: float) -> None:
        """The cycle took so long that ``missed`` later ones are left out."""
        self.tube.node["overruns"] += 1
        if now - self._overrun_told >= OVERRUN_EVERY:
            self._overrun_told = now
            overruns = int(self.tube.node["overruns"])
            self._send_event(Severity.WARNING, "overrun", {"missed": missed, "overruns": overruns})
            self._save_if_due()

    def on_joint_fault(self, fault: JointFault, now: float) -> None:
        """Something went wrong at a joint: tell the crew."""
        self._now = now
        self._send_event(Severity.WARNING, "joint_fault", fault.arguments)
        self._save_if_due()

    def close(self) -> None:
        """Save the newest state and release the sensors."""
        self._save()
        for source in self._sources:
            source.close()

    def _lap(self, stage: CycleStage) -> None:
        if self._timing is not None:
            self._timing.lap(stage)

    def _on_aiding(self, aiding: Aiding, now: float) -> None:
        clock = self.endpoint.clock
        if not clock.synchronised:
            return
        if aiding.epoch != clock.epoch and EPOCH_UNKNOWN not in (aiding.epoch, clock.epoch):
            self.endpoint.counters["other_epoch"] += 1  # measured by a clock that this node does not know
            self.endpoint.ask_time(now)
            return
        if self._timing is not None:
            self._timing.add_duration(CycleStage.AIDING, clock.rig_from_local(now) - aiding.valid_at)
        silent = self.endpoint.skipped
        if silent > len(self.settings.above):
            return  # over joints that this node was not told of
        aiding = aiding_across_silent(aiding, self.settings.above[:silent], self.settings.stiffness)
        valid_local = clock.local_from_rig(aiding.valid_at)
        if math.isfinite(clock.stepped):
            valid_local -= clock.stepped  # the cycle learns of the step, and moves what waits for it
        onward = self.tube.on_aiding(aiding, valid_local, clock.variance(now))
        if onward is not None:
            self._send(onward, now)

    def _context(self, now: float) -> RigContext:
        clock = self.endpoint.clock
        var = min(clock.variance(now), MAX_CLOCK_STD**2)
        is_dated = clock.synchronised and var < SYNCHRONISED_STD**2
        return RigContext(
            joined=self.endpoint.place.neighbours[Side.UPPER] is not None,
            hops=self.endpoint.place.hops,
            rig_now=clock.rig_from_local(now),
            clock_var=var,
            synchronised=is_dated,
            epoch=clock.epoch,
            stepped=clock.take_step() if is_dated else 0.0,
            drift_std=clock.drift_std,
        )

    def _send(self, said: Aiding | SurveyMeasurement | StaticRecord | Event | NodeState, now: float) -> None:
        """Hand a message to the telemetry; what the ground station must not lose is saved before its frame leaves."""
        try:
            if isinstance(said, NodeState):
                self.endpoint.send_state(self._with_process_state(said), now)
            elif isinstance(said, Aiding):
                self.endpoint.send_aiding(said, now)
            else:
                self._keep(said if said.epoch else replace(said, epoch=self.endpoint.clock.epoch), now)
        except EncodeError:
            # the filter reports numbers out of range itself; the cycle goes on
            self.endpoint.counters["unsayable"] += 1

    def _with_process_state(self, state: NodeState) -> NodeState:
        """A state with what the process knows beside the firmware: epoch, numbers given out, trouble with the disk."""
        flags = state.flags | NodeFlag.NOT_SAVED if self._saver.is_refused else state.flags
        endpoint = self.endpoint
        return replace(
            state,
            flags=flags,
            hops=endpoint.place.told_hops,
            epoch=endpoint.clock.epoch,
            numbered=endpoint.mail.series.newest,
            upper_margin=endpoint.margin(Side.UPPER),
            lower_margin=endpoint.margin(Side.LOWER),
        )

    def _keep(self, said: Kept, now: float) -> None:
        """Keep a message for the ground station; surveys and records stay in the log when it has them."""
        if not isinstance(said, Event):
            self._log.append_payload(said.sequence, encode_message(said))
        self._saver.due = True
        if self._saver.spent:
            self.endpoint.mail.hold()
        self.endpoint.mail.submit(said, now)

    def _resend(self, first: int, last: int) -> tuple[int, int]:
        """Send the surveys and records of these numbers again; how many, and from which number all are kept."""
        mail, logged = self.endpoint.mail, self._log.payloads(first, last)
        # of another tube's memory, which was put into this one, nothing is this one's
        found = [one for one in logged if decode_message(one[1]).tube == self.settings.tube][:RESENT_TOGETHER]  # type: ignore[union-attr]
        waiting = mail.hasten(first, last, self._now)
        for sequence, payload in found:
            mail.submit_again(sequence, payload, self._now)
        self._saver.due = self._saver.due or bool(found)
        return len(waiting.union(sequence for sequence, _ in found)), self._log.complete_from

    def _report_drops(self, now: float) -> None:
        """Tell the ground station, at most once a minute, that a queue of this node was full."""
        if now < self._looked_at_drops + REPORT_EVERY:
            return
        self._looked_at_drops = now
        dropped, before = self.endpoint.dropped, self._dropped
        if dropped > before:
            self._dropped = dropped
            self._send_event(Severity.ERROR, "queue_full", {"dropped": dropped - before, "since_start": dropped})

    def _announce(self, rig_now: float, now: float) -> None:
        """Report the start once rig time is known, and what was found on the disk."""
        if self._announced:
            return
        self._announced = True
        self._send(self.tube.boot_event(rig_now), now)
        if self._saver.fault:
            self._send_event(Severity.ERROR, "saved_state_lost", {"detail": self._saver.fault[:200]})
        if (carried := self._saver.carried) is not None:
            told: dict[str, Scalar] = {"layout": carried.layout, "carried": carried.fields, "new": carried.fresh}
            self._send_event(Severity.INFO, "saved_state_carried", told)
        if self._counter_fault:
            self._send_event(Severity.ERROR, "boot_counter_lost", {"detail": self._counter_fault[:200]})
        if self.endpoint.counters["bad_saved_state"]:
            self._send_event(Severity.ERROR, "saved_state_lost", {"detail": "of the telemetry: not as it was written"})
        if self._cut:
            self._send_event(Severity.WARNING, "alignment_refused", {"reason": "the power was cut"})
        if self._fallback:
            in_use = self.tube.parameters
            detail: dict[str, Scalar] = {"detail": self._fallback[:200], "in_use": in_use.version}
            self._send_event(Severity.ERROR, "parameters_fallback", detail | {"hash": in_use.sha256().hex()})

    def _tell_of_silent_tubes(self) -> None:
        """Report when the neighbour above is heard over the heads of silent tubes, and when these are back."""
        silent = self.endpoint.skipped if self.endpoint.place.neighbours[Side.UPPER] is not None else self._skipped
        if silent == self._skipped:
            return
        nearest = self.settings.tube + 1
        if silent:
            told: dict[str, Scalar] = {"tube": nearest, "tubes": silent}
            self._send_event(Severity.WARNING, "tube_silent", told)
        else:
            self._send_event(Severity.INFO, "tube_heard_again", {"tube": nearest})
        self._skipped = silent

    def _send_event(self, severity: Severity, code: str, arguments: dict[str, Scalar]) -> None:
        """Keep an event of the process; it is saved before its frame leaves."""
        clock = self.endpoint.clock
        rig_now, number = clock.rig_from_local(self._now), self.endpoint.mail.series.take()
        self._keep(Event(self.settings.tube, number, rig_now, severity, code, arguments, clock.epoch), self._now)

    def _save(self) -> None:
        self._saver.save(self.nodes, self.endpoint.export_state())
        self.endpoint.mail.release(self._now)

    def _save_if_due(self) -> bool:
        if self._saver.due and not self._saver.spent:
            self._save()
            return True
        return False


def jump_of(event: Event) -> float:
    """By how much (s) the event says that the own clock jumped, at most what a clock may be doubted by."""
    by = event.arguments.get("by_s", MAX_CLOCK_STD)
    return min(abs(float(by)), MAX_CLOCK_STD) if isinstance(by, (int, float)) else MAX_CLOCK_STD
