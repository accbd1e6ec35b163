"""Calibrations of an MWD tool that were made before: read from their file, named by file and hash."""

from __future__ import annotations

from pathlib import Path

from groundstation.calibration.mwd_block import TriadCalibration, read_triad

ACCELEROMETERS, MAGNETOMETERS = "mwd accelerometers", "mwd magnetometers"


def read_triad_file(path: Path | None, sensor: str) -> TriadCalibration | None:
    """Calibration of a file, if one is given."""
    return None if path is None else read_triad(path, sensor)


def calibration_label(path: Path | None, block: TriadCalibration | None) -> str:
    """File and hash of a calibration that was applied."""
    return "nominal, not calibrated" if path is None or block is None else f"{path.name}, block {block.sha256()}"
