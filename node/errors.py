"""Errors of the node package.

::

    NodeError
    ├── ConfigurationError(InputError, ValueError)    a setting outside its range: correct the file or the flag named
    ├── SavedStateError(ValueError)              no slot of a saved state is good: the node starts afresh
    └── SensorError(OSError)                  a sensor is absent or answers nonsense: tried again every cycle
"""

from __future__ import annotations

from telemetry.errors import BorechainError, InputError


class NodeError(BorechainError):
    """Root of every error of this package."""


class NodeConfigurationError(NodeError, InputError, ValueError):
    """A setting is outside its range."""


class SavedStateError(NodeError, ValueError):
    """The bytes are not a saved state of this layout."""


class SensorError(NodeError, OSError):
    """A sensor is absent or answers nonsense."""
