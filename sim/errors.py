"""Errors of the simulator.

::

    SimError
    ├── ScenarioError(InputError, ValueError)    an invalid scenario, path or fault: correct the place named
    ├── RigError(RuntimeError)                   the rig could not run here: the message names the remedy
    └── TableError(ValueError)                   an invalid table of studies or instruments: correct the line named
"""

from __future__ import annotations

from telemetry.errors import BorechainError, InputError


class SimError(BorechainError):
    """Root of every error of this package."""


class ScenarioError(SimError, InputError, ValueError):
    """The scenario cannot be; nothing was started."""


class RigError(SimError, RuntimeError):
    """The rig could not run; what was stored is kept."""


class TableError(SimError, ValueError):
    """A table of studies or instruments cannot be; nothing of it is offered."""
