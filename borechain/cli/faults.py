"""The faults of the command line under a short name for the commands of this package."""

from __future__ import annotations

from telemetry.runtime.command_line import EnvironmentFault, InputFault, plain_faults, require_modules

__all__ = ["EnvironmentFault", "InputFault", "plain_faults", "require_modules"]
