"""How errors of the packages become one line and an exit status."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import click

P = ParamSpec("P")
R = TypeVar("R")


class InputFault(click.ClickException):
    """Wrong arguments or input file: exit status 2."""

    exit_code = 2


class EnvironmentFault(click.ClickException):
    """The job could not be done here: exit status 1."""

    exit_code = 1


def plain_faults(command: Callable[P, R]) -> Callable[P, R]:
    """Turn errors of our packages into one clear line: 2 for input, 1 for the environment."""

    @functools.wraps(command)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        from groundstation.calibration.errors import CalibrationError
        from groundstation.errors import GroundError, SurveyError, ToolError
        from node.errors import ConfigurationError, NodeError
        from sim.errors import ScenarioError, SimError
        from telemetry.errors import TelemetryError

        try:
            return command(*args, **kwargs)
        except (ScenarioError, ConfigurationError, SurveyError, ToolError, CalibrationError) as error:
            raise InputFault(str(error)) from error
        except (SimError, NodeError, TelemetryError, GroundError, OSError) as error:
            raise EnvironmentFault(str(error)) from error

    return guarded
