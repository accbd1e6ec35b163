"""The error of the calibration room.

::

    GroundError
    └── CalibrationError(ValueError)   a record, a design or a block that is no calibration: nothing was written
"""

from __future__ import annotations

from groundstation.errors import GroundError


class CalibrationError(GroundError, ValueError):
    """The record, the design or the block is no calibration; the message says where and why."""
