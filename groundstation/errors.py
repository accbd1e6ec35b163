"""Errors of the ground station.

::

    GroundError
    ├── SurveyError(ValueError)       numbers that are no survey: which file and line, which value, which station
    ├── ToolError(ValueError)         an instrument model that cannot be used: which file, term and formula
    ├── SelectorError(ValueError)     a query nobody can answer: the message lists the valid names
    ├── ConfigurationError(ValueError) a setting that what was asked for needs: correct the option named
    └── StoreError(OSError)           the database cannot be opened or written: nothing was acknowledged
"""

from __future__ import annotations


class GroundError(Exception):
    """Root of every error of this package."""


class SurveyError(GroundError, ValueError):
    """The numbers given are no survey."""


class ToolError(GroundError, ValueError):
    """The instrument model cannot be used."""


class SelectorError(GroundError, ValueError):
    """The query cannot be answered; the message says what can."""


class ConfigurationError(GroundError, ValueError):
    """A setting is missing or outside its range."""


class StoreError(GroundError, OSError):
    """The database cannot be opened or written."""
