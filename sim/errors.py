"""Errors of the simulator.

::

    SimError
    ├── ScenarioError(ValueError)    a scenario file, path file or fault that cannot be: correct the place named
    ├── RigError(RuntimeError)       the rig could not run here: the message names the remedy
    └── StudyError(ValueError)       a table of studies or instruments that cannot be: correct the line named
"""

from __future__ import annotations


class SimError(Exception):
    """Root of every error of this package."""


class ScenarioError(SimError, ValueError):
    """The scenario cannot be; nothing was started."""


class RigError(SimError, RuntimeError):
    """The rig could not run; what was stored is kept."""


class StudyError(SimError, ValueError):
    """The table of studies or of instruments cannot be; no command is offered."""
