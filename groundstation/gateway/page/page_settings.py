"""Where the page is served, and who may order on it."""

from __future__ import annotations

import socket
import ssl
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from groundstation.errors import ConfigurationError, PageError
from telemetry.media.credentials import needs_tls

BACKLOG = 1024  # connections that wait to be accepted


@dataclass(frozen=True, slots=True)
class PageSettings:
    """Address of the page, its certificate and key for TLS, and the hash of each password, with the file they are in.

    ``replay`` names the recording that is shown in place of a rig that lives.
    """

    host: str
    port: int
    certificate: Path | None = None
    key: Path | None = None
    passwords: Mapping[str, str] = field(default_factory=dict)
    password_file: Path | None = None
    replay: str = ""

    @property
    def is_local(self) -> bool:
        """Whether only this machine can reach the page; everybody may read it then."""
        return not needs_tls(f"tcp/{self.host}:{self.port}")

    @property
    def url(self) -> str:
        """Address as a browser takes it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{'http' if self.certificate is None else 'https'}://{host}:{self.port}"

    @property
    def names(self) -> tuple[str, ...]:
        """Names by which a browser may call the page; another name is that of a page that was led here."""
        if self.is_local:
            return ("localhost", "127.0.0.1", "[::1]", self.host)
        return ("*",)


def parse_address(text: str) -> tuple[str, int]:
    """Host and port of ``HOST:PORT``, an IPv6 address in brackets.

    Raises
    ------
    ConfigurationError
        When it is invalid.
    """
    host, _, port = text.rpartition(":")
    host = host.removeprefix("[").removesuffix("]")
    if not host or not port.isdecimal() or not 0 < int(port) < 1 << 16:
        raise ConfigurationError(f"page: expected HOST:PORT such as 127.0.0.1:8080, got {text!r:.60}")
    return host, int(port)


def check_certificate(certificate: Path, key: Path) -> None:
    """Refuse files with which no HTTPS can be served.

    Raises
    ------
    ConfigurationError
        When they are not a certificate and its key.
    """
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(certificate, key)
    except (OSError, ssl.SSLError) as error:
        reason = getattr(error, "reason", None) or error.strerror or "no PEM"
        raise ConfigurationError(
            f"page-tls: expected a certificate and its key in PEM, got {certificate} and {key}: {reason}"
        ) from error


def open_page_socket(page: PageSettings) -> socket.socket:
    """Listening socket of the page.

    Raises
    ------
    PageError
        When the port is taken, or the machine has no such address.
    """
    listening = socket.socket(socket.AF_INET6 if ":" in page.host else socket.AF_INET, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((page.host, page.port))
        listening.listen(BACKLOG)
    except OSError as error:
        listening.close()
        raise PageError(
            f"page {page.host}:{page.port}: {error.strerror}; choose another with --page 127.0.0.1:PORT"
        ) from error
    return listening
