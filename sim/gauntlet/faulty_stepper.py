"""Steps the processes of a rig under faults: one may stand still, and the power may go while a disk is written."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping

from groundstation.errors import StoreError
from sim.gauntlet.faulty_disk import PowerCutError
from sim.gauntlet.faulty_world import FaultyWorld
from sim.rig.in_process import Build, InProcessStepper, step_process
from sim.rig.rig_progress import RigProgress
from sim.rig.stepper import Answer, FrameEvent
from telemetry.errors import BorechainError
from telemetry.messages import BASE
from telemetry.runtime.stepped import Due, DueEvent

WAITING = 256  # frames that the inbox of a process holds while it stands still
FRAMES = (Due.UPPER_FRAME, Due.LOWER_FRAME)


class FaultyStepper(InProcessStepper):
    """A stepper of processes that fail.

    Parameters
    ----------
    builders : how to start the process of each address
    world : whose depth may be hidden
    on_cut : called with the address of a process whose power went while it wrote
    on_end : called with the address of one that has ended because it has to start anew
    """

    def __init__(
        self,
        builders: Mapping[int, Build],
        world: FaultyWorld,
        on_cut: Callable[[int], None],
        on_end: Callable[[int], None],
    ) -> None:
        super().__init__(builders)
        self._world, self._on_cut, self._on_end = world, on_cut, on_end
        self._frozen: dict[int, deque[FrameEvent]] = {}
        self._thawing: dict[int, deque[FrameEvent]] = {}
        self._missed: dict[int, int] = {}

    def freeze(self, address: int) -> None:
        """Freeze a process: it gets no events."""
        self._frozen.setdefault(address, deque(maxlen=WAITING))
        self._missed[address] = 0

    def thaw(self, address: int) -> None:
        """Thaw a process: it gets what waits with its next event."""
        if address in self._frozen:
            self._thawing[address] = self._frozen.pop(address)

    def is_frozen(self, address: int) -> bool:
        """Whether a process stands still, or has not moved since."""
        return address in self._frozen or address in self._thawing

    def follow(self, progress: RigProgress) -> None:
        """Make what runs equal to what the schedule wants; the power may go at a start too."""
        for address in progress.kill:
            self.drop(address)
        for address in list(progress.wanted):
            if address not in self.processes:
                try:
                    self.processes[address] = self._build(address)
                except PowerCutError:
                    self._on_cut(address)
                except BorechainError:
                    continue  # it ended with an error; the next start is tried later

    def wait_for(self, address: int, *, alive: bool, timeout: float) -> bool:
        """Return True at once: the world waits for no process."""
        del address, alive, timeout
        return True

    def drop(self, address: int) -> None:
        """Cut the power of a process; what waits for it is lost."""
        super().drop(address)
        self._frozen.pop(address, None)
        self._thawing.pop(address, None)

    def round(self, steps: Mapping[int, list[FrameEvent]]) -> dict[int, Answer]:
        """Step each process that is there and does not stand still; one that has just thawed may write before that."""
        answers = {}
        for address in sorted(steps):
            try:
                events = steps[address]
                if address in self._frozen or address in self._thawing or address == BASE:
                    events = self._events_of(address, events)
                if events and address in self.processes:
                    answers[address] = step_process(self.processes[address], events)
            except PowerCutError:
                self._on_cut(address)
            except StoreError:
                self._on_end(address)
        return answers

    def _events_of(self, address: int, events: list[FrameEvent]) -> list[FrameEvent]:
        if address == BASE and self._world.depth_hidden:
            events = [one for one in events if one[0].kind is not Due.DEPTH]
        if address in self._frozen:
            self._missed[address] += sum(event.kind is Due.CYCLE for event, _ in events)
            self._frozen[address].extend(one for one in events if one[0].kind in FRAMES)
            return []
        if events and address in self._thawing:
            now = events[0][0].at
            waiting = [(DueEvent(event.kind, now, event.data), frame) for event, frame in self._thawing.pop(address)]
            if (missed := self._missed.pop(address)) and address in self.processes:
                self.processes[address].on_overrun(missed, now)
            return waiting + events
        return events
