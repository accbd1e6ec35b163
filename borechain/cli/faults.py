"""The faults of the command line under a short name for the commands of this package."""

from __future__ import annotations

from telemetry.runtime.command_line import EnvironmentFault, InputFault, needs, plain_faults

__all__ = ["EnvironmentFault", "InputFault", "needs", "plain_faults"]
