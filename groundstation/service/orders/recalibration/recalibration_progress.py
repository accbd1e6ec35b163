"""How far a calibration in the field has come: plain data that is kept in the database and shown to the operator."""

from __future__ import annotations

import enum
import json
from dataclasses import dataclass, field

from telemetry.messages import Vector3
from telemetry.parameters import ParameterBlock, unpack_block


class RecalibrationStage(enum.StrEnum):
    """Of the whole procedure."""

    IDLE = "idle"
    COLLECTING = "collecting"
    SOLVED = "solved"  # shown, waits for the operator
    UPLOADING = "uploading"
    DONE = "done"


class TubePhase(enum.StrEnum):
    """Of one tube."""

    COLLECTING = "collecting"
    PROPOSED = "proposed"
    CONFIRMED = "confirmed"  # to be uploaded
    UPLOADING = "uploading"
    VERIFYING = "verifying"
    DONE = "done"  # the tube itself reported the hash
    REFUSED = "refused"  # the detail says by whom and why


@dataclass(slots=True)
class Attitude:
    """A preset (rad) at which the tubes rested from rig time ``at`` to ``left`` (s; None while they are there)."""

    pitch: float
    roll: float
    seconds: float
    at: float
    left: float | None = None


@dataclass(slots=True)
class Found:
    """Figures of the solution of one tube; m/s^2 and rad."""

    residual_rms: float
    bias_std: Vector3
    matrix_std: float  # largest of the nine
    condition: float
    inclination_before: float  # rms over the attitudes
    inclination_after: float


@dataclass(slots=True)
class TubeProgress:
    """One tube's part."""

    tube: int
    phase: TubePhase = TubePhase.COLLECTING
    detail: str = ""
    version_before: int | None = None  # None until the tube told what it uses
    hash_before: str = ""
    orders: dict[int, int] = field(default_factory=dict)  # sequence of a command for a record: place of its attitude
    proposed: str = ""  # canonical bytes of the block, hex
    found: Found | None = None
    calibration: str = ""  # its file
    uploads: int = 0
    restarted: bool = False  # while the block was on its way
    hash_after_restart: str = ""
    hash: str = ""  # that the tube reported at the end

    @property
    def block(self) -> ParameterBlock | None:
        """The proposed block."""
        return unpack_block(bytes.fromhex(self.proposed)) if self.proposed else None


@dataclass(slots=True)
class RecalibrationProgress:
    """The whole procedure."""

    stage: RecalibrationStage = RecalibrationStage.IDLE
    attitudes: list[Attitude] = field(default_factory=list)
    tubes: dict[int, TubeProgress] = field(default_factory=dict)
    proposal: str = ""  # hash of all proposed blocks
    mixed: list[int] = field(default_factory=list)  # tubes whose block was replaced after a survey of the hole

    def to_json(self) -> str:
        """Text for the database."""
        return IDLE_TEXT if self == IDLE else json.dumps(self, default=fields_of, sort_keys=True)

    @classmethod
    def from_json(cls, text: str) -> RecalibrationProgress:
        """Progress of a text that ``to_json`` made."""
        whole = json.loads(text)
        tubes = {}
        for name, row in whole["tubes"].items():
            found = row["found"]
            if found is not None:
                x, y, z = found["bias_std"]
                found = Found(**found | {"bias_std": (x, y, z)})
            orders = {int(sequence): place for sequence, place in row["orders"].items()}
            tubes[int(name)] = TubeProgress(
                **row | {"phase": TubePhase(row["phase"]), "orders": orders, "found": found}
            )
        attitudes = [Attitude(**row) for row in whole["attitudes"]]
        return cls(RecalibrationStage(whole["stage"]), attitudes, tubes, whole["proposal"], whole.get("mixed", []))


def fields_of(part: Attitude | Found | TubeProgress | RecalibrationProgress) -> dict[str, object]:
    """Fields of a part by name; ``asdict`` would copy every number, at every timer."""
    return {name: getattr(part, name) for name in part.__slots__}


IDLE = RecalibrationProgress()
IDLE_TEXT = json.dumps(IDLE, default=fields_of, sort_keys=True)  # asked for at every timer, mostly
