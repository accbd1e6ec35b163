"""The operator of a rig in a rack: does at each cue what a person would, by the ground station's commands alone."""

from __future__ import annotations

import json
from typing import Any

from sim.errors import RigError
from sim.world.rack import Rack
from telemetry import keys
from telemetry.media.zenoh_bus import ZenohBus

PATIENCE = 10.0  # wall s


class Operator:
    """Asks for a calibration, tells each attitude, looks at the result and confirms it.

    Parameters
    ----------
    rack : where the tubes lie
    tubes : number of them
    rig : name in key expressions
    """

    def __init__(self, rack: Rack, tubes: int, rig: str) -> None:
        self._rig = rig
        section = rack.section
        told = {"action": "attitude", "seconds": f"{section.record_s:g}"}
        self._orders = {"begin": {"action": "begin", "tubes": ",".join(str(tube) for tube in range(1, tubes + 1))}}
        for number, (pitch, roll) in enumerate(section.attitudes_deg, 1):
            self._orders[f"attitude {number}"] = told | {"pitch_deg": f"{pitch:g}", "roll_deg": f"{roll:g}"}
        self._orders["solve"] = {"action": "solve"}

    def act_on_cue(self, bus: ZenohBus, cue: str) -> bool:
        """Do what ``cue`` names; False when nobody answered.

        Raises
        ------
        RigError
            When the ground station refuses.
        """
        if cue == "confirm":
            shown = self._ask(bus, keys.GROUND.format(rig=self._rig, path="recalibration"))
            if shown is None:
                return False
            order = {"action": "confirm", "proposal": str(shown["proposal"])}
        else:
            order = self._orders[cue]
        command = keys.COMMAND.format(rig=self._rig, name="recalibrate")
        return self._ask(bus, f"{command}?{';'.join(f'{key}={value}' for key, value in order.items())}") is not None

    @staticmethod
    def _ask(bus: ZenohBus, selector: str) -> dict[str, Any] | None:
        replies = bus.get(selector, PATIENCE)
        if not replies:
            return None
        if replies[0].error is not None:
            raise RigError(f"calibration: {replies[0].error}")
        return dict(json.loads(replies[0].payload))
