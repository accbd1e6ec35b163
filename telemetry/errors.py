"""Errors of the telemetry package.

::

    TelemetryError
    ├── MediumError(OSError)          the bus could not be opened or was lost: retry or reconfigure
    ├── DecodeError(ValueError)       bytes that are no message of ours; the link counts and drops them
    ├── EncodeError(ValueError)       a message outside its declared range: nothing was sent
    └── KeyFileError(ValueError)      the key of the rig is missing, open to others or none: correct the file
"""

from __future__ import annotations


class TelemetryError(Exception):
    """Root of every error of this package."""


class MediumError(TelemetryError, OSError):
    """The bus could not be opened or was lost; nothing was sent."""


class DecodeError(TelemetryError, ValueError):
    """The bytes are not a message of this schema."""


class EncodeError(TelemetryError, ValueError):
    """The message is outside its declared ranges; nothing was sent."""


class KeyFileError(TelemetryError, ValueError):
    """The file holds no key that may be used."""
