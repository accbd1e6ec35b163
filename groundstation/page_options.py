"""Options of a command that serves the page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from telemetry.media.credentials import needs_tls
from telemetry.runtime.process_options import INSECURE

if TYPE_CHECKING:
    from groundstation.gateway.page.page_settings import PageSettings

DEFAULT = "127.0.0.1:8080"


def page_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Where the page is served, with which certificate and passwords; ``--insecure`` stands among the others."""
    for option in (
        click.option("--page", metavar="HOST:PORT", help=f"Serve the page there, such as {DEFAULT}."),
        click.option(
            "--page-tls",
            nargs=2,
            type=click.Path(path_type=Path, exists=True, dir_okay=False),
            metavar="CERTIFICATE KEY",
            help="Files (PEM) with which the page is served over HTTPS.",
        ),
        click.option(
            "--page-passwords",
            type=click.Path(path_type=Path, dir_okay=False),
            help="File of borechain pki password: who may order on the page. Without it the page only shows.",
        ),
    ):
        command = option(command)
    return command


@dataclass(frozen=True, slots=True)
class PageRequest:
    """The options as they were given."""

    page: str | None = None
    page_tls: tuple[Path, Path] | None = None
    page_passwords: Path | None = None


def page_settings(asked: PageRequest) -> PageSettings | None:
    """Settings of the options as they were given to the command that runs; None without a page.

    Raises
    ------
    ConfigurationError, KeyFileError
        When one of them cannot be.
    EnvironmentFault
        When the web server is not installed.
    click.BadParameter
        When everybody on a network could read along.
    """
    from groundstation.errors import ConfigurationError
    from telemetry.runtime.command_line import check_installed

    page, tls, passwords = asked.page, asked.page_tls, asked.page_passwords
    if page is None:
        if tls or passwords is not None:
            raise ConfigurationError("page-tls, page-passwords: expected --page with them")
        return None
    check_installed("starlette", "uvicorn")
    from groundstation.gateway.page.page_settings import PageSettings, check_certificate, parse_address
    from groundstation.gateway.page.passwords import read_passwords

    host, port = parse_address(page)
    is_insecure = click.get_current_context().meta.get(INSECURE, False)
    if needs_tls(f"tcp/{host}:{port}") and not tls and not is_insecure:
        raise click.BadParameter(
            f"page: expected --page-tls with it, or an address of this machine alone, got {page}; --insecure allows it"
        )
    certificate, key = tls or (None, None)
    if certificate is not None and key is not None:
        check_certificate(certificate, key)
    return PageSettings(host, port, certificate, key, {} if passwords is None else read_passwords(passwords), passwords)
