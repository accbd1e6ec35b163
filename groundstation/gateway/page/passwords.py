"""Passwords of the page: a line for a role, or a role and a person, in a private file, each with its hash (RFC 9106).

A name that has a password of its own is signed in with that alone, so the record shows who it was.
"""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from pathlib import Path

from cryptography.exceptions import InvalidKey
from cryptography.hazmat.primitives.kdf.argon2 import Argon2id

from groundstation.errors import ConfigurationError
from telemetry.errors import KeyFileError
from telemetry.transport.key_ring import read_private

OPERATOR, DRILLER = "operator", "driller"  # one reads, the other also orders
ROLES = (OPERATOR, DRILLER)
SHORTEST, LONGEST = 8, 256  # characters
SALT_BYTES, HASH_BYTES = 16, 32
NEVER = "$argon2id$v=19$m=65536,t=3,p=1$AAAAAAAAAAAAAAAAAAAAAA$AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA"  # of none
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


def holder_of(role: str, name: str = "") -> str:
    """What a password is kept under: a role, or a role and the name of a person."""
    return f"{role}/{name}" if name else role


def roles_of(passwords: Mapping[str, str]) -> list[str]:
    """Roles that have a password, or of whose persons one has."""
    return sorted({holder.partition("/")[0] for holder in passwords})


def find_holder(passwords: Mapping[str, str], role: str, name: str) -> str | None:
    """Under what the password of a role and a name is kept: their own, or the role's where the name has none."""
    own = holder_of(role, name)
    if own in passwords:
        return own
    is_named = any(holder.partition("/")[2] == name for holder in passwords)
    return role if role in passwords and not is_named else None


class PasswordBook:
    """Passwords as they are now: a file that was changed is read again, with one that cannot be read there are none.

    Parameters
    ----------
    passwords : as of the start
    path : of their file; None where there is none
    """

    def __init__(self, passwords: Mapping[str, str], path: Path | None) -> None:
        self._passwords, self._path = passwords, path
        self._stamp = self._stamp_now()
        self.fault = ""  # of the file

    def current(self) -> Mapping[str, str]:
        """Hash of each holder."""
        if self._path is not None and (stamp := self._stamp_now()) != self._stamp:
            self._stamp = stamp
            try:
                self._passwords, self.fault = read_passwords(self._path), ""
            except (ConfigurationError, KeyFileError) as error:
                self._passwords, self.fault = {}, str(error)
        return self._passwords

    def _stamp_now(self) -> tuple[int, int]:
        try:
            status = None if self._path is None else self._path.stat()
        except OSError:
            status = None
        return (-1, -1) if status is None else (status.st_mtime_ns, status.st_size)


def read_passwords(path: Path) -> dict[str, str]:
    """Hash of each role, and of each role and person, in a file.

    Raises
    ------
    KeyFileError
        When the file cannot be read, or others than its owner can.
    ConfigurationError
        When a line is not ``ROLE HASH``.
    """
    found: dict[str, str] = {}
    for number, line in enumerate(read_private(path).splitlines(), 1):
        holder, _, hashed = line.strip().rpartition(" ")
        if holder.partition("/")[0] not in ROLES or not hashed.startswith("$argon2id$"):
            raise ConfigurationError(
                f"{path}, line {number}: expected what borechain pki password wrote, "
                f"one of {', '.join(ROLES)}, perhaps /NAME, and a hash"
            )
        found[holder] = hashed
    return found


def text_of(passwords: Mapping[str, str]) -> str:
    """The file that ``read_passwords`` reads."""
    return "".join(f"{holder} {hashed}\n" for holder, hashed in sorted(passwords.items()))
