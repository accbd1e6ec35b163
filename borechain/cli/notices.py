"""Lines for people on stderr, beside what a command prints."""

from __future__ import annotations

from contextlib import AbstractContextManager

import click

from telemetry.runtime.warning_lines import telling_warnings


def print_notice(line: str) -> None:
    """Say something that is no part of the output."""
    click.echo(line, err=True)


def warnings_in_lines() -> AbstractContextManager[None]:
    """Say every warning once, in one line on stderr."""
    return telling_warnings(print_notice)
