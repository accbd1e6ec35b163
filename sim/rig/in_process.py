"""The string as objects in this process: the same scheduler, firmware, links and ground station, without a bus.

A process is built when the schedule wants it and dropped when its power is cut; built again, it finds in its folder
what the one before saved. The digests are those of the rig with real processes, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from sim.errors import RigError
from sim.rig.rig_progress import RigProgress
from sim.rig.stepper import Acted, Answer, FrameEvent
from telemetry.messages import address_name
from telemetry.runtime.process_interface import Process
from telemetry.runtime.stepped import Sent, run_step
from telemetry.unwritten import Content

Build = Callable[[], Process]
Carry = Callable[[Content], Content]


class InProcessStepper:
    """Steps objects; see ``sim.rig.stepper.Stepper``.

    Parameters
    ----------
    builders : how to start the process of each address, as its computer would after its power came
    act_on_cue : plays the operator
    carry : what a medium makes of every frame; by default its bytes
    """

    def __init__(
        self,
        builders: Mapping[int, Build],
        act_on_cue: Callable[[str], Acted] = lambda _cue: Acted.DONE,
        carry: Carry = bytes,
    ) -> None:
        self._carry = carry
        self.builders = dict(builders)
        self._act_on_cue = act_on_cue
        self.processes: dict[int, Process] = {}

    def follow(self, progress: RigProgress) -> None:
        """Make what runs equal to what the schedule wants."""
        for address in progress.kill:
            self.drop(address)
        for address in progress.wanted:
            if address not in self.processes:
                self.processes[address] = self._build(address)

    def alive(self) -> list[int]:
        """Addresses that run, in ascending order."""
        return sorted(self.processes)

    def wait_for(self, address: int, *, alive: bool, timeout: float) -> bool:
        """Whether a process has come or gone; nothing here takes time."""
        del timeout
        return (address in self.processes) == alive

    def wait_for_cue(self, name: str, timeout: float) -> Acted:
        """Have the operator act at once."""
        del timeout
        return self._act_on_cue(name)

    def drain_hung(self) -> list[int]:
        """None: an object answers or raises."""
        return []

    def drop(self, address: int) -> None:
        """Cut the power of a process: nothing of it is left but its folder."""
        self.processes.pop(address, None)

    def round(self, steps: Mapping[int, list[FrameEvent]]) -> dict[int, Answer]:
        """Step each process in turn; within a round none depends on another."""
        return {
            address: step_process(self.processes[address], steps[address], self._carry)
            for address in sorted(steps)
            if address in self.processes
        }

    def _build(self, address: int) -> Process:
        if address not in self.builders:
            raise RigError(f"process {address_name(address)}: this rig has no such process")
        return self.builders[address]()


def carry_unwritten(frame: Content) -> Content:
    """Return a frame as the link hands it over: without need of its bytes none are made."""
    return frame


def step_process(process: Process, events: list[FrameEvent], carry: Carry = bytes) -> Answer:
    """One step of one process: its events in order, and after each the frames that it sends."""
    frames: list[tuple[Sent, Content]] = []
    wake_at = run_step(process, events, lambda sent, frame: frames.append((sent, carry(frame.content))))
    return Answer(frames, wake_at)
