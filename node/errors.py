"""Errors of the node package.

::

    NodeError
    ├── ConfigurationError(InputError, ValueError)    a setting outside its range: correct the file or the flag named
    ├── SavedStateError(ValueError)              no slot of a saved state is good: the node starts afresh
    └── SensorError(OSError)                  a sensor is absent or answers nonsense: tried again every cycle
"""

from __future__ import annotations

from enum import StrEnum

from telemetry.errors import BorechainError, InputError


class NodeError(BorechainError):
    """Root of every error of this package."""


class NodeConfigurationError(NodeError, InputError, ValueError):
    """A setting is outside its range."""


class SensorCause(StrEnum):
    """What of a sensor's proof failed."""

    SILENT = "silent"  # absent, or no readings, or too few
    BUS = "bus"  # a transfer failed
    IDENTITY = "identity"  # another chip answers, or none
    REGISTER = "register"  # a setting is not the one that was made
    OVERFLOW = "overflow"  # readings were dropped because none was taken in time
    LOST_BYTES = "lost_bytes"  # the borders of the frames are lost
    COUNTER = "counter"  # a counter that does not count, or jumps
    RESOLUTION = "resolution"  # another number of counts a turn
    GRAVITY = "gravity"  # a force at rest that is far from gravity


class SavedStateError(NodeError, ValueError):
    """The bytes are not a saved state of this layout."""


class SensorError(NodeError, OSError):
    """A sensor is absent or answers nonsense.

    Attributes
    ----------
    cause : what failed of its proof, in a word that stands in its event; see ``SensorCause``
    """

    def __init__(self, text: str, cause: SensorCause = SensorCause.SILENT) -> None:
        super().__init__(text)
        self.cause = cause
