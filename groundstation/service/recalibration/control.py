"""What surrounds the calibration in the field: the operator's orders, and what is kept of it in database and folder."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable, Mapping
from pathlib import Path

from groundstation.calibration.block import from_json, write
from groundstation.calibration.errors import CalibrationError
from groundstation.errors import SelectorError
from groundstation.service.recalibration.procedure import FieldProcedure
from groundstation.service.recalibration.progress import Progress
from groundstation.service.store import Store
from telemetry.messages import MAX_TUBE

Parameters = Mapping[str, str]
COMMAND = "recalibrate"
ACTIONS: dict[str, tuple[str, ...]] = {
    "begin": (),
    "attitude": ("pitch_deg", "roll_deg", "seconds"),
    "solve": (),
    "confirm": ("proposal",),
    "cancel": (),
}
OPTIONAL = {"begin": ("tubes",)}
RANGES = {"pitch_deg": (-180.0, 180.0), "roll_deg": (-180.0, 180.0), "seconds": (5.0, 3600.0)}


class Recalibration:
    """Steps a procedure by orders and keeps it. Whoever calls holds the lock of the model.

    Parameters
    ----------
    procedure : to step
    store : where progress and blocks are kept
    folder : of the calibrations
    give_up : ends the upload to a tube
    """

    def __init__(self, procedure: FieldProcedure, store: Store, folder: Path, give_up: Callable[[int], None]) -> None:
        self.procedure = procedure
        self._store = store
        self._folder = folder
        self._give_up = give_up
        kept = store.progress()
        procedure.restore(Progress.from_json(kept) if kept else Progress(), store.blocks())
        self._kept = kept

    def order(self, parameters: Parameters, rig_now: float, string: list[int]) -> None:
        """Do what an operator orders at ``rig_now`` (s); ``string`` holds the tubes that are known.

        Raises
        ------
        SelectorError
            When the order is none, or not one for the present stage.
        CalibrationError
            When the file of a calibration cannot be written; nothing is uploaded then.
        """
        action = check_order(parameters)
        procedure = self.procedure
        match action:
            case "begin":
                procedure.begin(_tubes(parameters["tubes"]) if "tubes" in parameters else list(string))
            case "attitude":
                pitch, roll, seconds = (_number(parameters, name) for name in ACTIONS[action])
                if not math.isfinite(rig_now):
                    raise SelectorError("attitude: expected rig time to be known; is the string joined?")
                procedure.attitude(math.radians(pitch), math.radians(roll), seconds, rig_now)
            case "solve":
                procedure.solve(datetime.datetime.now(datetime.UTC).date().isoformat(), rig_now)
            case "confirm":
                self._confirm(parameters["proposal"])
            case "cancel":
                procedure.cancel()
                for tube in procedure.progress.tubes:
                    self._give_up(tube)
        self.keep_progress()

    def keep_progress(self) -> bool:
        """Put the progress on the disk if it changed; returns whether it did."""
        text = self.procedure.progress.to_json()
        if text == self._kept:
            return False
        self._store.keep_progress(text)
        self._kept = text
        return True

    def _confirm(self, proposal: str) -> None:
        """Files and blocks are kept before the first segment can leave."""
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise CalibrationError(f"{self._folder}: expected a folder to write to, got {error.strerror}") from error
        for block, calibration in self.procedure.proposed(proposal):
            write(self._folder / f"field-{block.tube}-v{block.version}.json", from_json(calibration))
            self._store.keep_block(block)
        self.procedure.confirm()


def check_order(parameters: Parameters) -> str:
    """Action of an order.

    Raises
    ------
    SelectorError
        When it is none or a parameter is missing or unknown; it says what is.
    """
    action = parameters.get("action", "")
    if action not in ACTIONS:
        raise SelectorError(f"expected cmd/{COMMAND}?action={'|'.join(ACTIONS)}, got {action!r:.40}")
    given = [key for key in parameters if key != "action"]
    allowed = (*ACTIONS[action], *OPTIONAL.get(action, ()))
    if any(key not in given for key in ACTIONS[action]) or any(key not in allowed for key in given):
        expected = "".join(f";{key}=.." for key in allowed)
        raise SelectorError(f"expected cmd/{COMMAND}?action={action}{expected}, got {', '.join(given) or 'none'}")
    return action


def _number(parameters: Parameters, name: str) -> float:
    low, high = RANGES[name]
    try:
        value = float(parameters[name])
    except ValueError:
        value = math.nan
    if not low <= value <= high:
        raise SelectorError(f"parameter {name}: expected {low:g}..{high:g}, got {parameters[name]!r:.40}")
    return value


def _tubes(text: str) -> list[int]:
    parts = text.split(",")
    if not all(part.isdigit() and 1 <= int(part) <= MAX_TUBE for part in parts):
        raise SelectorError(f"parameter tubes: expected numbers of 1..{MAX_TUBE} as 1,2,3, got {text!r:.40}")
    return [int(part) for part in parts]
