"""What every command of ours shares: its errors as one line and an exit status, and what is missing here by name.

0 done, 1 the job could not be done here, 2 wrong arguments or input. A board that holds ``node`` and ``telemetry``
alone runs its commands with this module, so it knows no other package.
"""

from __future__ import annotations

import functools
import importlib.util
import sys
from collections.abc import Callable, Sequence
from typing import ParamSpec, TypeVar

import click

from telemetry.errors import BorechainError, InputError
from telemetry.runtime.packages import PACKAGES, foreign_package

P = ParamSpec("P")
R = TypeVar("R")

EXTRA_OF = {
    "cantools": "can",
    "defusedxml": "files",
    "distributed": "campaign",
    "ezdxf": "files",
    "matplotlib": "ground",
    "mcap": "ground",
    "openpyxl": "files",
    "orjson": "ground",
    "pyarrow": "campaign",
    "pygeomag": "files",
    "pyproj": "files",
    "rich": "ground",
    "scipy": "ground",
    "smbus2": "board",
    "sqlalchemy": "ground",
    "starlette": "ground",
    "textual": "ground",
    "typst": "ground",
    "uvicorn": "ground",
    "welleng": "landmark",
}  # by the module it brings


class InputFault(click.ClickException):
    """Wrong arguments or input file: exit status 2."""

    exit_code = 2


class EnvironmentFault(click.ClickException):
    """The job could not be done here: exit status 1."""

    exit_code = 1


def fault_of(error: Exception) -> click.ClickException | None:
    """Error as a line for its user; None for an unexpected one."""
    if isinstance(error, click.ClickException):
        return error
    if isinstance(error, InputError):
        return InputFault(str(error))
    if isinstance(error, ModuleNotFoundError):
        return EnvironmentFault(missing_module_text(error.name)) if error.name else None
    if isinstance(error, BorechainError | OSError):
        return EnvironmentFault(str(error))
    return None


def plain_faults(command: Callable[P, R]) -> Callable[P, R]:
    """Turn expected errors into one clear line: status 2 for input, 1 for the environment."""

    @functools.wraps(command)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return command(*args, **kwargs)
        except Exception as error:
            fault = fault_of(error)
            if fault is None:
                raise
            raise fault from error

    return guarded


def missing_module_text(module: str) -> str:
    """Text on what to install for a missing module."""
    root = module.partition(".")[0]
    if root in PACKAGES:
        return f"needs the package {root} of borechain, which is not on this machine: pip install borechain"
    extra = EXTRA_OF.get(root)
    if extra is None:
        return f"needs {root}, which is not installed here"
    return f"needs the extra {extra}: pip install 'borechain[{extra}]' ({root} is not installed)"


def require_modules(*modules: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Refuse a command before it begins where one of ``modules`` is not installed."""

    def decorated(command: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(command)
        def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
            check_installed(*modules)
            return command(*args, **kwargs)

        return guarded

    return decorated


def check_installed(*modules: str) -> None:
    """Raise for the first of ``modules`` that is not installed.

    Raises
    ------
    EnvironmentFault
        Naming the extra that brings it.
    """
    for module in modules:
        if importlib.util.find_spec(module) is None:
            raise EnvironmentFault(missing_module_text(module))


def run_command(
    command: click.Command, name: str, arguments: list[str] | None = None, packages: Sequence[str] = PACKAGES
) -> None:
    """Run a command under ``name`` and exit: 0 done, 1 the job could not be done here, 2 wrong arguments or input.

    ``packages`` are those of ours that it needs; a foreign one in their place is refused by name.
    """
    if (shadowed := foreign_package(packages)) is not None:
        sys.exit(f"{name}: {shadowed}")
    try:
        result = command.main(args=arguments, prog_name=name, standalone_mode=False)
    except click.exceptions.Exit as exit_:
        sys.exit(exit_.exit_code)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        click.echo("borechain: interrupted", err=True)
        sys.exit(1)
    except ModuleNotFoundError as error:
        fault = fault_of(error)
        if fault is None:
            raise
        fault.show()
        sys.exit(fault.exit_code)
    sys.exit(result if isinstance(result, int) else 0)
