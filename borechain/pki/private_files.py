"""Files that are written whole or not at all, the private ones for their owner alone."""

from __future__ import annotations

import os
from pathlib import Path

from cryptography.hazmat.primitives.asymmetric.ec import EllipticCurvePrivateKey
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from telemetry.errors import KeyFileError
from telemetry.transport.key_ring import read_private


def write_private(path: Path, text: str) -> None:
    """Write a file that its owner alone may read.

    Raises
    ------
    KeyFileError
        When it cannot be written.
    """
    _write(path, text, 0o600)


def write_file(path: Path, text: str) -> None:
    """Write a file that everybody may read.

    Raises
    ------
    KeyFileError
        When it cannot be written.
    """
    _write(path, text, 0o644)


def read_private_key(path: Path) -> EllipticCurvePrivateKey:
    """Key of an authority.

    Raises
    ------
    KeyFileError
        When the file cannot be read, is open to others or holds no such key.
    """
    try:
        key = load_pem_private_key(read_private(path).encode(), None)
    except (ValueError, TypeError):
        key = None
    if not isinstance(key, EllipticCurvePrivateKey):
        raise KeyFileError(f"key file {path}: expected the key that borechain pki wrote, got something else")
    return key


def _write(path: Path, text: str, mode: int) -> None:
    fresh = path.with_name(f".{path.name}.new")
    try:
        descriptor = os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, mode)
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            os.fchmod(file.fileno(), mode)
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
    except OSError as error:
        raise KeyFileError(f"key file {path}: {error.strerror}") from error
