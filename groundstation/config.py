"""Configuration of a ground station, validated where it enters."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

from telemetry import keys

Positive = Annotated[float, Field(gt=0.0)]


class GroundConfig(BaseModel):
    """Settings of one ground station; SI and radians, degrees where the name says so."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    rig: str = Field(keys.DEFAULT_RIG, pattern=r"^[A-Za-z0-9_-]{1,64}$")
    folder: Path
    database_url: str | None = Field(None, description="SQLAlchemy URL; SQLite in the folder if absent")
    key_file: Path | None = Field(None, description="key of the rig; without one no parameter block is uploaded")
    tube_length: Positive = Field(2.0, description="m, of every tube of the tally")
    gravity: Positive = Field(9.81, description="m/s^2, of the site")
    accelerometer_bias_std_deg: float = Field(0.002, ge=0.0, description="left after calibration, as a tilt")
    station_tolerance: Positive = Field(0.05, description="m, within which two surveys are at the same station")
    stale_after: Positive = Field(4.5, description="s of rig time without a state of a node")

    @property
    def calibrations(self) -> Path:
        """Folder of the calibrations that can be uploaded."""
        return self.folder / "calibrations"

    @property
    def url(self) -> str:
        """Database to use."""
        return self.database_url or f"sqlite:///{self.folder / 'ground.sqlite'}"
