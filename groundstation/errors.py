"""Errors of the ground station.

::

    GroundError
    ├── SurveyError(InputError, ValueError)    invalid survey numbers: which file and line, value, station
    ├── ToolError(InputError, ValueError)      an instrument model that cannot be used: which file, term and formula
    ├── SelectorError(ValueError)              a query without an answer: the message lists the valid names
    ├── ConfigurationError(InputError, ValueError)    a setting that what was asked for needs: correct the option named
    ├── LeaseError(OSError)                    another ground station works on the rig: end it, or name another rig
    ├── PageError(OSError)                     the page cannot be served: choose another address
    └── StoreError(OSError)                    the database cannot be opened or written: nothing was acknowledged
"""

from __future__ import annotations

from telemetry.errors import BorechainError, InputError


class GroundError(BorechainError):
    """Root of every error of this package."""


class SurveyError(GroundError, InputError, ValueError):
    """The numbers given are not a valid survey."""


class ToolError(GroundError, InputError, ValueError):
    """The instrument model cannot be used."""


class SelectorError(GroundError, ValueError):
    """The query cannot be answered; the message says what can."""


class ConfigurationError(GroundError, InputError, ValueError):
    """A setting is missing or outside its range."""


class LeaseError(GroundError, OSError):
    """The rig has its ground station already."""


class PageError(GroundError, OSError):
    """The page cannot be served."""


class StoreError(GroundError, OSError):
    """The database cannot be opened or written."""
