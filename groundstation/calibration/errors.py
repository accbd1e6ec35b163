"""The error of the calibration room; the node, which reads a calibration file too, shares it."""

from __future__ import annotations

from telemetry.errors import CalibrationError

__all__ = ["CalibrationError"]
