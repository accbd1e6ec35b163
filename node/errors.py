"""Errors of the node package.

::

    NodeError
    ├── ConfigurationError(ValueError)    a setting outside its range: correct the file or the flag named
    ├── SavedStateError(ValueError)       both slots of a saved state are unreadable: the node starts from nothing
    └── SensorError(OSError)              a sensor is absent or answers nonsense: it is tried again every cycle
"""

from __future__ import annotations


class NodeError(Exception):
    """Root of every error of this package."""


class ConfigurationError(NodeError, ValueError):
    """A setting is outside its range."""


class SavedStateError(NodeError, ValueError):
    """The bytes are no saved state of this layout."""


class SensorError(NodeError, OSError):
    """A sensor is absent or answers nonsense."""
