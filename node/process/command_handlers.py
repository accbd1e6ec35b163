"""What a tube does when it is ordered to: one method for each command of the table that a tube obeys."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from node.firmware.tube import Tube
from node.process.board_watch import BoardWatch
from telemetry.application.arguments import check_arguments
from telemetry.application.commands import COMMANDS, LONGEST_FINDING, ObeyedBy
from telemetry.errors import CommandError
from telemetry.messages import Command, Reply, Value
from telemetry.quantities import MAX_TEXT
from telemetry.runtime.timing import CycleTiming

SPECS = {spec.name: spec for spec in COMMANDS if spec.by is ObeyedBy.TUBE}


@dataclass(frozen=True, slots=True)
class CommandOutcome:
    """Whether an order is obeyed, why not or what happens now, and what the table of commands promises."""

    done: bool
    detail: str = ""
    values: dict[str, Value] = field(default_factory=dict)


class CommandHandlers:
    """Obeys orders; a command without its method here is an error at the start.

    Parameters
    ----------
    tube : firmware of the node
    timing : where the node's own clock keeps its measurements; None in a stepped process
    resend : sends the surveys of a range of numbers again; returns how many, and from which number all are kept
    board : what is found of the board
    """

    def __init__(
        self,
        tube: Tube,
        timing: CycleTiming | None,
        resend: Callable[[int, int], tuple[int, int]],
        board: BoardWatch,
    ) -> None:
        self._tube = tube
        self._board = board
        self._resend = resend
        self._timing = timing
        self._handlers: dict[str, Callable[[Mapping[str, Any], int], CommandOutcome]] = {
            name: getattr(self, name) for name in SPECS
        }

    def obey(self, command: Command) -> Reply:
        """Outcome of a command; a wrong name, argument or range is refused before anything is done."""
        try:
            if command.name not in SPECS:
                raise CommandError(f"expected {', '.join(SPECS)}, got {command.name!r:.40}")
            arguments = check_arguments(SPECS[command.name], command.arguments)
        except CommandError as error:
            outcome = CommandOutcome(False, str(error))
        else:
            outcome = self._handlers[command.name](arguments, command.sequence)
        return Reply(
            self._tube.settings.tube, command.sequence, outcome.done, outcome.detail[:MAX_TEXT], outcome.values
        )

    def take_survey(self, _arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        """Measure the station again."""
        self._tube.take_survey()
        return CommandOutcome(True, "at the next settled cycle")

    def static_record(self, arguments: Mapping[str, Any], sequence: int) -> CommandOutcome:
        """Average raw readings at rest."""
        seconds = arguments["seconds"]
        if refused := self._tube.start_record(seconds, sequence):
            return CommandOutcome(False, refused)
        return CommandOutcome(True, "recording", {"seconds": seconds})

    def resend(self, arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        """Send surveys and static records of a range of numbers again."""
        if arguments["last"] < arguments["first"]:
            return CommandOutcome(False, f"last: expected at least {arguments['first']}, got {arguments['last']}")
        sent, complete_from = self._resend(arguments["first"], arguments["last"])
        return CommandOutcome(True, values={"sent": sent, "complete_from": complete_from})

    def parameters(self, _arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        """Name the parameter block in use."""
        block = self._tube.parameters
        return CommandOutcome(True, values={"version": block.version, "sha256": block.sha256().hex()})

    def align(self, arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        """Find the mount of the IMUs in the coming turns, or drop it."""
        method, turns = arguments["method"], arguments["turns"]
        if refused := self._tube.align(method, turns):
            return CommandOutcome(False, refused)
        if method == "none":
            return CommandOutcome(True, "dropped", {"method": method})
        return CommandOutcome(True, "turn the string slowly", {"method": method, "turns": turns})

    def alignment(self, _arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        """Name the alignment in use."""
        return CommandOutcome(True, values=self._tube.alignment)

    def timing(self, _arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        """Say how late the cycles start and how long their stages take."""
        if self._timing is None:
            return CommandOutcome(False, "expected a node with a clock of its own")
        values: dict[str, Value] = {"cycles": self._timing.cycles, "overruns": self._timing.overruns}
        for stage, durations in self._timing.stages.items():
            if durations.count:
                values |= {f"{stage.value}_p99": durations.quantile(0.99), f"{stage.value}_max": durations.largest}
        return CommandOutcome(True, values=values)

    def check_board(self, _arguments: Mapping[str, Any], _sequence: int) -> CommandOutcome:
        """Say of each part of the board whether it is as it should be."""
        found = self._board.findings(datetime.datetime.now(datetime.UTC))
        wrong = ", ".join(line.part for line in found if not line.good)
        values: dict[str, Value] = {"good": not wrong, "wrong": wrong}
        values |= {line.part: line.text[:LONGEST_FINDING] for line in found}
        return CommandOutcome(True, f"wrong: {wrong}" if wrong else f"all {len(found)} parts are good", values)
