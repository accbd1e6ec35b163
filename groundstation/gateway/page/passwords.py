"""Passwords of the page's roles: one line a role in a private file, its hash after RFC 9106 (Argon2id)."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from pathlib import Path

from cryptography.exceptions import InvalidKey
from cryptography.hazmat.primitives.kdf.argon2 import Argon2id

from groundstation.errors import ConfigurationError
from telemetry.transport.key_ring import read_private

OPERATOR, DRILLER = "operator", "driller"  # one reads, the other also orders
ROLES = (OPERATOR, DRILLER)
SHORTEST, LONGEST = 8, 256  # characters
SALT_BYTES, HASH_BYTES = 16, 32
PASSES, LANES, MEMORY_KIB = 3, 1, 65_536  # second recommendation of RFC 9106, with one lane for a small machine


def hash_of(password: str) -> str:
    """Hash of a password with a salt of its own, as a PHC string.

    Raises
    ------
    ConfigurationError
        When the password is too short or too long.
    """
    if not SHORTEST <= len(password) <= LONGEST:
        raise ConfigurationError(
            f"password: expected {SHORTEST} to {LONGEST} characters, got {len(password)}; a few words are good"
        )
    kdf = Argon2id(
        salt=secrets.token_bytes(SALT_BYTES), length=HASH_BYTES, iterations=PASSES, lanes=LANES, memory_cost=MEMORY_KIB
    )
    return kdf.derive_phc_encoded(password.encode())


def is_right(password: str, hashed: str) -> bool:
    """Whether a password has a hash; takes a tenth of a second of one core."""
    try:
        Argon2id.verify_phc_encoded(password.encode(), hashed)
    except InvalidKey:
        return False
    return True


def drawn_password() -> str:
    """Return a random password of 80 bits, in groups that can be read out."""
    letters = "abcdefghjkmnpqrstuvwxyz23456789"
    return "-".join("".join(secrets.choice(letters) for _ in range(4)) for _ in range(4))


def read_passwords(path: Path) -> dict[str, str]:
    """Hash of each role in a file.

    Raises
    ------
    KeyFileError
        When the file cannot be read, or others than its owner can.
    ConfigurationError
        When a line is not ``ROLE HASH``.
    """
    found: dict[str, str] = {}
    for number, line in enumerate(read_private(path).splitlines(), 1):
        role, _, hashed = line.strip().partition(" ")
        if role not in ROLES or not hashed.startswith("$argon2id$"):
            raise ConfigurationError(
                f"{path}, line {number}: expected what borechain pki password wrote, "
                f"one of {', '.join(ROLES)} and a hash"
            )
        found[role] = hashed
    return found


def text_of(passwords: Mapping[str, str]) -> str:
    """The file that ``read_passwords`` reads."""
    return "".join(f"{role} {hashed}\n" for role, hashed in sorted(passwords.items()))
