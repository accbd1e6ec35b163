"""The operator of a rig in a rack: does at each cue what a person would, by the ground station's commands alone."""

from __future__ import annotations

import json
from typing import Any, Protocol

from sim.errors import RigError
from sim.rig.stepper import Acted
from sim.world.rack import Rack
from telemetry import keys
from telemetry.media.zenoh_bus import ZenohBus

PATIENCE = 10.0  # wall s
COMMAND = "recalibrate"


class GroundClient(Protocol):
    """How an operator reaches the ground station; an answer of None means that it did not answer yet."""

    def ask(self, path: str) -> dict[str, Any] | None:
        """What the ground station shows on ``path``."""

    def command(self, name: str, parameters: dict[str, str]) -> dict[str, Any] | None:
        """Outcome of a command.

        Raises
        ------
        RigError
            When the ground station refuses it.
        """


class BusGroundClient:
    """The ground station's keys on the bus."""

    def __init__(self, bus: ZenohBus, rig: str) -> None:
        self._bus = bus
        self._rig = rig

    def ask(self, path: str) -> dict[str, Any] | None:
        """See ``GroundClient``."""
        return self._get(keys.GROUND.format(rig=self._rig, path=path))

    def command(self, name: str, parameters: dict[str, str]) -> dict[str, Any] | None:
        """See ``GroundClient``."""
        selector = keys.COMMAND.format(rig=self._rig, name=name)
        return self._get(f"{selector}?{';'.join(f'{key}={value}' for key, value in parameters.items())}")

    def _get(self, selector: str) -> dict[str, Any] | None:
        replies = self._bus.get(selector, PATIENCE)
        if not replies:
            return None
        if replies[0].error is not None:
            raise RigError(f"{selector}: {replies[0].error}")
        return dict(json.loads(replies[0].payload))


class RackOperator:
    """Asks for a calibration, enters each attitude, looks at the result and confirms it.

    Parameters
    ----------
    rack : where the tubes lie
    tubes : number of them
    """

    def __init__(self, rack: Rack, tubes: int) -> None:
        section = rack.section
        entered = {"action": "attitude", "seconds": f"{section.record_s:g}"}
        self._commands = {"begin": {"action": "begin", "tubes": ",".join(str(tube) for tube in range(1, tubes + 1))}}
        for number, (pitch, roll) in enumerate(section.attitudes_deg, 1):
            self._commands[f"attitude {number}"] = entered | {"pitch_deg": f"{pitch:g}", "roll_deg": f"{roll:g}"}
        self._commands["solve"] = {"action": "solve"}

    def act_on_cue(self, doors: GroundClient, cue: str) -> Acted:
        """Do what ``cue`` names; too early as long as the ground station does not know the time of the rig.

        Raises
        ------
        RigError
            When the ground station refuses.
        """
        shown = doors.ask("recalibration")
        if shown is None:
            return Acted.NO_ANSWER
        if shown["rig_time_s"] is None:
            return Acted.LATER
        order = self._commands.get(cue) or {"action": "confirm", "proposal": str(shown["proposal"])}
        return Acted.NO_ANSWER if doors.command(COMMAND, order) is None else Acted.DONE
