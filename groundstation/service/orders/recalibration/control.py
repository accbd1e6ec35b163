"""What surrounds the calibration in the field: the operator's orders, and what is kept of it in database and folder."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from groundstation.calibration.block import from_json, write_calibration
from groundstation.errors import SelectorError
from groundstation.service.disk.ground_store import Store
from groundstation.service.orders.recalibration.procedure import FieldProcedure
from groundstation.service.orders.recalibration.recalibration_progress import RecalibrationProgress
from groundstation.survey.fusion.force_biases import SurveyedBiases
from telemetry.errors import CalibrationError


class Recalibration:
    """Steps a procedure as ordered and keeps it.

    Parameters
    ----------
    procedure : to step
    store : where progress and blocks are kept
    folder : of the calibrations
    cancel_upload : ends the upload to a tube
    biases : works out what the surveys of the hole tell of accelerometers
    """

    def __init__(
        self,
        procedure: FieldProcedure,
        store: Store,
        folder: Path,
        cancel_upload: Callable[[int], None],
        biases: Callable[[], SurveyedBiases],
    ) -> None:
        self.procedure = procedure
        self._store = store
        self._folder = folder
        self._cancel_upload = cancel_upload
        self._biases = biases
        kept = store.progress()
        procedure.restore(RecalibrationProgress.from_json(kept) if kept else RecalibrationProgress(), store.blocks())
        self._kept = kept

    def step(self, action: str, arguments: Mapping[str, Any], rig_now: float, string: list[int]) -> None:
        """Take the step ``action`` of the table of commands at ``rig_now`` (s); ``string`` holds the known tubes.

        Raises
        ------
        SelectorError
            When the present stage does not allow it.
        CalibrationError
            When the file of a calibration cannot be written; nothing is uploaded then.
        """
        procedure = self.procedure
        match action:
            case "begin":
                procedure.begin(list(arguments.get("tubes", string)))
            case "attitude":
                if not math.isfinite(rig_now):
                    raise SelectorError("attitude: expected rig time to be known; is the string joined?")
                procedure.attitude(arguments["pitch"], arguments["roll"], arguments["seconds"], rig_now)
            case "solve":
                procedure.solve(datetime.datetime.now(datetime.UTC).date().isoformat(), rig_now)
            case "surveys":
                procedure.propose_biases(self._biases(), datetime.datetime.now(datetime.UTC).date().isoformat())
            case "confirm":
                self._confirm(arguments["proposal"])
            case "cancel":
                procedure.cancel()
                for tube in procedure.progress.tubes:
                    self._cancel_upload(tube)
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
            write_calibration(self._folder / f"field-{block.tube}-v{block.version}.json", from_json(calibration))
            self._store.keep_block(block)
        self.procedure.confirm()
