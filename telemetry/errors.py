"""The root of every error of this program, and the errors of the telemetry package.

::

    BorechainError
    ├── InputError                    what the user gave is wrong: correct it, nothing was started; exit status 2
    └── TelemetryError, NodeError, GroundError, SimError    the root of each package

    TelemetryError
    ├── MediumError(OSError)          the bus could not be opened or was lost: retry or reconfigure
    │   └── UnknownMediumError(ValueError)  no medium of that name: correct the configuration
    ├── DecodeError(ValueError)       bytes that are not a message; the link counts and drops them
    ├── EncodeError(ValueError)       a message outside its declared range: nothing was sent
    ├── CommandError(ValueError)      an order outside the table of commands: nothing was sent
    ├── KeyFileError(ValueError)      the key of the rig is missing, open to others or none: correct the file
    ├── RadioError(InputError, ValueError)    a frequency, a soil or a pipe outside a model: the message says its range
    ├── LoggerError(InputError, ValueError)   a sensor's record that cannot be read: name its column or unit
    └── CalibrationError(InputError, ValueError)    a record, a design or a file that gives no calibration
"""

from __future__ import annotations


class BorechainError(Exception):
    """Root of every error of ours, so that the edge can report one in a line without knowing its package."""


class InputError(BorechainError):
    """An argument or a file of the user is wrong; the message says where, what was expected and what came."""


class TelemetryError(BorechainError):
    """Root of every error of this package."""


class MediumError(TelemetryError, OSError):
    """The bus could not be opened or was lost; nothing was sent."""


class UnknownMediumError(MediumError, ValueError):
    """No medium of that name; the message lists those that there are."""


class DecodeError(TelemetryError, ValueError):
    """The bytes are not a message of this schema."""


class EncodeError(TelemetryError, ValueError):
    """The message is outside its declared ranges; nothing was sent."""


class CommandError(TelemetryError, ValueError):
    """The order is not one of the table, or an argument is missing, unknown or out of range; nothing was sent."""


class KeyFileError(TelemetryError, ValueError):
    """The file holds no key that may be used."""


class RadioError(TelemetryError, InputError, ValueError):
    """A value lies outside the model of a radio link; the message says its valid range."""


class LoggerError(TelemetryError, InputError, ValueError):
    """A sensor's record cannot be read as it was asked; the message says where, what was expected and what came."""


class CalibrationError(TelemetryError, InputError, ValueError):
    """The record, the design or the file gives no calibration; the message says where and why; nothing was written."""
