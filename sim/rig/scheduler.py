"""The medium process: world, joints and clock of a rig, as a discrete-event simulation over real processes.

Events are ordered by rig time. All that fall within one hop's latency of the first are independent of each other (a
frame sent now cannot arrive sooner), so they are handed out together and the rig's time moves on when everyone has
answered. The load of the machine and the pace change nothing but the wall time.
"""

from __future__ import annotations

import bisect
import contextlib
import heapq
import itertools
import math
import queue
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from node.kernels.arithmetic.formats import PERIOD
from sim.errors import RigError
from sim.rig.link_channel import LinkChannel
from sim.rig.port_ends import is_cable, join_ends, radio_hearers
from sim.rig.radio_channel import RadioChannel
from sim.rig.rig_progress import ATTACH_LIMIT, RigProgress, give_up
from sim.rig.stepper import Acted, Answer, FrameEvent, Stepper
from sim.world.motion import SchedulePhase
from sim.world.world import World
from telemetry.application.depth_source import DepthSource
from telemetry.messages import BASE, ENCODER, Side, address_name
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.runtime.stepped import Due, DueEvent
from telemetry.unwritten import Content

FROZEN_AFTER = 30.0  # wall s of it, after which a process that was there is ended
TELL_EVERY = 0.5  # wall s
CUE_LIMIT = 120.0  # wall s
CUE_AGAIN = 2.0  # rig s, until an operator who was too early tries again
REBOOT_TIME = 5.0  # rig s that a process may be missing before the rig's time waits for it
AFTER_END = 120.0  # rig s after the schedule in which what is under way arrives and is receipted
CYCLE, TIMER = Due.CYCLE, Due.TIMER
Entry = tuple[float, int, int, int, "Due | None", Content, "float | None"]


class Scheduler:
    """Conducts one scenario.

    Parameters
    ----------
    world : truth, sensors and schedule
    stepper : hands the steps to the processes
    tell : called with the progress whenever what is wanted changes, and once a cycle
    speed : rig seconds per wall second, infinite for as fast as possible
    cued : an operator is played and waited for, so that the orders fall on the same rig time in every run
    seal_depth : what the source of the depth makes of a reading's payload
    absent : called with the name of a process that is waited for and for how long it has been (wall s); it may raise
    """

    def __init__(
        self,
        world: World,
        stepper: Stepper,
        tell: Callable[[RigProgress], None],
        speed: float = math.inf,
        *,
        cued: bool = False,
        seal_depth: Callable[[bytes], bytes] = bytes,
        absent: Callable[[str, float], None] | None = None,
    ) -> None:
        self.world = world
        self.stepper = stepper
        self._tell = tell
        self._cued = cued
        self._absent = absent or give_up
        self._speed = speed
        medium = world.scenario.medium
        self.channel = LinkChannel(
            world.seed, medium.latency, medium.jitter, medium.loss, medium.duplicate, medium.corrupt
        )
        self._radio = None
        if world.radio is not None:
            self._radio = RadioChannel(
                world.radio, world.seed, medium.latency, medium.jitter, medium.duplicate, medium.corrupt
            )
        self.progress = RigProgress("starting", world.begin, world.begin, world.end, [ENCODER, BASE])
        self._depth = DepthSource()
        self._seal_depth = seal_depth
        self._queue: list[Entry] = []
        self._count = 0
        self._cycle = 0
        self._wake: dict[int, float] = {}
        self._ends: dict[tuple[int, Side], tuple[int, Due]] = {}
        self._join(())
        self._attached: set[int] = set()  # that were there at any time
        self._missing_since: dict[int, float] = {}
        self._changes: deque[Change] = deque()
        self._stopping = False
        self.now = world.begin  # s, rig time of the newest event
        self._interrupt: queue.SimpleQueue[None] = queue.SimpleQueue()  # its put is safe inside a signal handler
        self._wall_begin = 0.0

    def stop(self) -> None:
        """End after the present round; may be called from a signal handler."""
        self._stopping = True
        self._interrupt.put(None)

    def linger(self) -> None:
        """Keep the bus and the processes alive after the schedule, until ``stop``."""
        while not self._stopping:
            self._interrupt.get()

    def run(self) -> bool:
        """Drill; returns whether the schedule was finished.

        Raises
        ------
        RigError
            When a wanted process does not come, or processes find no rest after the schedule.
        """
        self.begin()
        self.advance()
        finished = not self._stopping
        self.progress.finished = finished
        self._tell(self.progress)
        return finished

    def begin(self, at: float | None = None) -> None:
        """Have the first processes started and everything that will change put in order of time.

        A rig that has drilled before goes on ``at`` a rig time (s), what the schedule did until then being done.
        """
        since = self.world.begin if at is None else at
        self._changes = deque(change for change in self._all_changes() if change.at >= since)
        self._cycle = math.ceil((since - self.world.begin) / PERIOD - 1e-9)
        self._push(self.world.cycle_end(self._cycle), -1, None, b"")
        self._attach(ENCODER)
        self._attach(BASE)
        if self.world.rack is None:
            at_start = self.world.scenario.file.rig.tubes_at_start
            self._join(tuple(range(at_start, 0, -1)), open_top=self._open_top)
            for tube in reversed(self._string):
                self._want(tube)
        self._wall_begin = time.monotonic()

    def advance(self, to: float = math.inf, until: Callable[[], bool] = lambda: False) -> None:
        """Let the rig's time pass to ``to`` (s), to the end of the schedule, or until something holds.

        Raises as ``run`` does.
        """
        while self._queue and self._queue[0][0] <= to and not self._stopping and not until():
            if self._queue[0][0] > self.world.end + AFTER_END:
                self._refuse_restless()
            if self._changes and self._changes[0].at <= self._queue[0][0]:
                self._changes.popleft().apply()
                continue
            limit = self._queue[0][0] + self.channel.latency
            if self._changes:
                limit = min(limit, self._changes[0].at)
            if self._speed < math.inf:
                self._pace(self._queue[0][0])
            self._round(limit)

    def _refuse_restless(self) -> None:
        """No cycle comes any more: who wakes itself or hears others now would do so for ever."""
        names = ", ".join(dict.fromkeys(address_name(entry[1]) for entry in sorted(self._queue)))
        raise RigError(f"{names}: expected rest within {AFTER_END:.0f} s after the schedule, steps are still asked for")

    def _all_changes(self) -> list[Change]:
        """Everything the schedule and the faults do to the rig, in order of time."""
        changes = []
        for phase in self.world.phases:
            changes.append(Change(phase.start, partial(self._enter, phase)))
            if phase.kind == "add":
                changes.append(Change(phase.joint_closed, partial(self._close_joint, phase.tube)))
        if (rack := self.world.rack) is not None:
            changes.append(Change(rack.begin, self._enter_rack))
            changes.append(Change(rack.end, self._leave_rack))
            if self._cued:
                changes += [Change(cue.at, partial(self._cue, cue.name)) for cue in rack.cues()]
        for fault in self.world.faults:
            at = self.world.begin + fault.after
            changes.append(Change(at, partial(self._cut_power, fault.address)))
            changes.append(Change(at + fault.down, partial(self._want, fault.address)))
        # at one time the rack is left before the first tube is added
        return sorted(changes, key=lambda change: (change.at, change.apply != self._leave_rack))

    def _enter(self, phase: SchedulePhase) -> None:
        self.progress.phase = f"{phase.kind} tube {phase.tube}"
        if phase.kind == "add":
            self._join(self._string, open_top=True)
            self._want(phase.tube)
        self._tell(self.progress)

    def _enter_rack(self) -> None:
        self.progress.phase = "rack"
        self._join(tuple(range(self.world.scenario.tubes, 0, -1)), open_top=self._open_top)
        for tube in reversed(self._string):
            self._want(tube)

    def _leave_rack(self) -> None:
        """Part the tubes; each is switched off until it is added to the string."""
        for tube in self._string:
            if tube in self.progress.wanted:
                self._cut_power(tube)
        self._join((), open_top=self._open_top)

    def _cue(self, name: str) -> None:
        """Let the operator act while the rig's time stands still."""
        self.progress.cue = name
        for _ in range(int(CUE_LIMIT / TELL_EVERY)):
            self._tell(self.progress)
            acted = Acted.DONE if self._stopping else self.stepper.wait_for_cue(name, TELL_EVERY)
            if acted is Acted.LATER:
                again = Change(self._queue[0][0] + CUE_AGAIN, partial(self._cue, name))
                bisect.insort(self._changes, again, key=lambda change: change.at)
            if acted is not Acted.NO_ANSWER:
                break
        else:
            raise RigError(f"operator: did nothing for {CUE_LIMIT:.0f} s when asked to {name}")
        self.progress.cue = ""

    def _close_joint(self, tube: int) -> None:
        self._join((tube, *self._string))

    def _want(self, address: int) -> None:
        if address not in self.progress.wanted:
            self.progress.wanted.append(address)
        self._tell(self.progress)
        self._attach(address)

    def _attach(self, address: int) -> None:
        """Tell again and again that the process is wanted (who starts it may listen later) until it is there.

        One that was there and does not come back by itself is perhaps frozen: the launcher is told to end it.
        """
        for turn in itertools.count():
            self._absent(address_name(address), turn * TELL_EVERY)
            if turn == int(FROZEN_AFTER / TELL_EVERY) and address in self._attached:
                self._end_hung([address])
            self._tell(self.progress)
            if self._stopping or self.stepper.wait_for(address, alive=True, timeout=TELL_EVERY):
                self._attached.add(address)
                return

    def _cut_power(self, address: int) -> None:
        """Have the launcher cut the power of a process; the rig's time goes on when it is gone."""
        self.progress.wanted.remove(address)
        self.progress.kill = [address]
        for _ in range(int(ATTACH_LIMIT / TELL_EVERY)):
            self._tell(self.progress)
            if self._stopping or self.stepper.wait_for(address, alive=False, timeout=TELL_EVERY):
                break
        else:
            name = address_name(address)
            raise RigError(f"fault kill-node:{name}: the process was not killed within {ATTACH_LIMIT:.0f} s")
        self.progress.kill = []
        self._wake.pop(address, None)

    def _end_hung(self, hung: list[int]) -> None:
        """Have the launcher end what did not answer: it has missed events, and would go on as if it had not."""
        if hung:
            self.progress.kill = hung
            self._tell(self.progress)
            self.progress.kill = []

    def _push(self, at: float, address: int, kind: Due | None, frame: Content, margin: float | None = None) -> None:
        self._count += 1
        # an event's kind is its rank; at one time a cycle of all comes last
        heapq.heappush(self._queue, (at, address, 9 if kind is None else kind, self._count, kind, frame, margin))

    def _pace(self, rig_time: float) -> None:
        ahead = (rig_time - self.world.begin) / self._speed - (time.monotonic() - self._wall_begin)
        if ahead > 0.0:
            with contextlib.suppress(queue.Empty):
                self._interrupt.get(timeout=ahead)

    def _round(self, limit: float) -> None:
        steps: dict[int, list[FrameEvent]] = {}
        true_time: dict[tuple[int, float], float] = {}
        events, wake = self._queue, self._wake
        while events and events[0][0] < limit:
            at, address, _, _, kind, frame, margin = heapq.heappop(events)
            self.now = at
            if kind is None:
                self._add_cycle(at, steps, true_time)
            elif kind is CYCLE:
                if address in self.stepper.alive():
                    self._add_sample(at, address, int.from_bytes(bytes(frame)), steps, true_time)
            elif kind is not TIMER or wake.get(address) == at:
                self._add(steps, true_time, address, kind, at, margin, frame)
        answers = self.stepper.round(steps)
        self._end_hung(self.stepper.drain_hung())
        for address, answer in sorted(answers.items()) if len(answers) > 1 else answers.items():
            self._on_answer(address, answer, true_time)

    def _add(
        self,
        steps: dict[int, list[FrameEvent]],
        true_time: dict[tuple[int, float], float],
        address: int,
        kind: Due,
        at: float,
        data: object,
        frame: Content,
    ) -> None:
        local = self.world.local_clock(address, at)
        true_time[address, local] = at
        event = DueEvent(kind, local, data), frame
        if address in steps:
            steps[address].append(event)
        else:
            steps[address] = [event]

    def _add_cycle(
        self, at: float, steps: dict[int, list[FrameEvent]], true_time: dict[tuple[int, float], float]
    ) -> None:
        if at >= self.world.motion.begin:  # in the rack there is no bit
            rig_time = self.world.local_clock(ENCODER, at)
            depth = encode_message(self._depth.measure(rig_time, max(self.world.measured_depth(at), 0.0)))
            self._add(steps, true_time, BASE, Due.DEPTH, at, self._seal_depth(depth), b"")
        self._add(steps, true_time, BASE, Due.TIMER, at, None, b"")
        for address in self.stepper.alive():
            if address == BASE or address not in self.progress.wanted:
                continue
            phase = 0.0 if address == ENCODER else self.world.phase(address)
            if phase > 0.0:
                self._push(at + phase, address, Due.CYCLE, self._cycle.to_bytes(8))
            else:
                self._add_sample(at, address, self._cycle, steps, true_time)
        self._cycle += 1
        self.progress.rig_time = at
        self._tell(self.progress)
        self._wait_for_missing(at)
        following = self.world.cycle_end(self._cycle)
        if following <= self.world.end:
            self._push(following, -1, None, b"")
        else:
            self._queue.clear()

    def _add_sample(
        self,
        at: float,
        address: int,
        cycle: int,
        steps: dict[int, list[FrameEvent]],
        true_time: dict[tuple[int, float], float],
    ) -> None:
        """The sample of one process's cycle, which ends at ``at``."""
        start = self.world.cycle_end(cycle - 1) + (at - self.world.cycle_end(cycle))
        sample = self.world.encoder_sample(at) if address == ENCODER else self.world.imu_sample(address, cycle)
        data = [self.world.local_clock(address, start), *sample]
        self._add(steps, true_time, address, Due.CYCLE, at, data, b"")

    def _wait_for_missing(self, at: float) -> None:
        """A process that died unasked is missed for the time of a reboot; then the rig waits for it to come back."""
        alive = set(self.stepper.alive())
        for address in self.progress.wanted:
            if address in alive:
                self._missing_since.pop(address, None)
            elif at - self._missing_since.setdefault(address, at) >= REBOOT_TIME:
                self._attach(address)

    def _on_answer(self, address: int, answer: Answer, true_time: dict[tuple[int, float], float]) -> None:
        for sent, frame in answer.frames:
            at = true_time[address, sent.at]
            if self._radio is not None and not is_cable(address, sent.side):
                self._radiate(self._radio, address, sent.side, at, frame)
                continue
            end = self._ends.get((address, sent.side))  # None at the bit, at the surface and at an open joint
            for delay, arriving in self.channel.deliveries(address, sent.side, frame):
                if end is not None:
                    self._push(at + delay, *end, arriving)
        wake = self.world.true_time(address, answer.wake_at) if math.isfinite(answer.wake_at) else math.inf
        if self._wake.get(address) != wake:
            if math.isfinite(wake):
                self._push(wake, address, TIMER, b"")
            self._wake[address] = wake

    def _radiate(self, radio: RadioChannel, sender: int, side: Side, at: float, frame: Content) -> None:
        """Have every end hear a frame that its radio reaches, in a closed string up to the drive head."""
        heard = radio_hearers(self._string, sender, side, radio.reach, open_top=self._open_top)
        for other, kind, joints in heard:
            for delay, arriving, margin in radio.deliveries(sender, side, other, joints, at, bytes(frame)):
                self._push(at + delay, other, kind, arriving, margin)

    def _join(self, string: tuple[int, ...], *, open_top: bool = False) -> None:
        """Have these tubes hang, top first, and every port look into another; not through an open joint at the head."""
        self._string, self._open_top = string, open_top
        self._ends = join_ends(string, open_top=open_top)


@dataclass(frozen=True, slots=True)
class Change:
    """Something the schedule does to the rig at a rig time."""

    at: float
    apply: Callable[[], None]
