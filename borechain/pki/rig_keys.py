"""The folder of a rig's keys: the secret that all of them are derived from, and one key file for each process.

``rig.secret`` holds the secret of each generation that is in use; the stick with the folder stays in the pocket of who
answers for the rig. A key file goes to its process and nowhere else. Nothing here asks a server.
"""

from __future__ import annotations

import datetime
import re
import secrets
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from borechain.pki.access import MEDIUM, ROUTER, write_access
from borechain.pki.certificates import AT_THE_SURFACE, OF_A_PERSON, VALID, make_authority, make_certificate
from borechain.pki.persons import FIRST, Person, admitted_roles, person_lines, person_of, with_person, without_person
from borechain.pki.private_files import write_private
from telemetry.errors import KeyFileError
from telemetry.media.credentials import DEPTH_SOURCE, file_name
from telemetry.messages import BASE, ENCODER, MAX_TUBE
from telemetry.toml_tables import parse_toml_tables
from telemetry.transport.key_ring import (
    MOST_GENERATION,
    SUFFIX,
    Generation,
    KeyRing,
    keys_of,
    pack_ring,
    read_private,
)

SECRET_FILE = "rig.secret"
SECRET_SIZE = 32  # bytes
OVERLAP = datetime.timedelta(days=1)  # for which the old keys stay valid after a rotation
ALWAYS = (BASE, ENCODER, DEPTH_SOURCE)  # processes that every rig has
SURFACE = (ROUTER, MEDIUM, *map(file_name, ALWAYS))  # whose certificates every rig has
NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")


@dataclass(frozen=True, slots=True)
class SecretGeneration:
    """The secret of one generation."""

    number: int
    secret: bytes
    made_at: datetime.datetime
    retires_at: datetime.datetime | None = None


@dataclass(frozen=True, slots=True)
class RigSecret:
    """Content of a rig's folder beside the key files."""

    rig: str
    generations: tuple[SecretGeneration, ...]  # the oldest first
    revoked: frozenset[int] = frozenset()
    persons: tuple[Person, ...] = FIRST

    def ring(self, address: int) -> KeyRing:
        """Keys of a process; joint keys with those revoked are left out."""
        generations = tuple(
            Generation(g.number, keys_of(g.secret, address, self.revoked), g.made_at, g.retires_at)
            for g in self.generations
        )
        return KeyRing(self.rig, address, generations, self.revoked)


def init_rig(
    folder: Path, rig: str, now: datetime.datetime, lot: Callable[[int], bytes] = secrets.token_bytes
) -> RigSecret:
    """Make the folder of a rig with its secret and the key files of base, encoder and depth source.

    ``lot`` gives random bytes; a secret that is to be one uses those of the operating system.

    Raises
    ------
    KeyFileError
        When the folder has a secret already, cannot be written, or the name is invalid.
    """
    if not NAME.fullmatch(rig):
        raise KeyFileError(f"rig: expected 1 to 64 letters, digits, - and _, got {rig!r:.80}")
    if (folder / SECRET_FILE).exists():
        raise KeyFileError(f"{folder / SECRET_FILE}: expected a folder without keys; a second init would lose them")
    secret = RigSecret(rig, (SecretGeneration(1, lot(SECRET_SIZE), now),))
    try:
        folder.mkdir(parents=True, exist_ok=True)
        folder.chmod(0o700)
    except OSError as error:
        raise KeyFileError(f"folder {folder}: {error.strerror}") from error
    make_authority(folder, rig, now)
    for name in SURFACE:
        make_certificate(folder, name, now, AT_THE_SURFACE)
    for person in secret.persons:
        make_certificate(folder, person.name, now, OF_A_PERSON, person.common_name)
    _write(folder, secret, ALWAYS)
    return secret


def add_tube(folder: Path, tube: int, now: datetime.datetime) -> Path:
    """Write the key file of a tube at its make-up, and its certificate if it has none; returns the key file.

    Raises
    ------
    KeyFileError
        When the folder holds no rig's keys, the tube's were revoked, or the number is invalid.
    """
    secret = read_secret(folder)
    if not 1 <= tube <= MAX_TUBE:
        raise KeyFileError(f"tube: expected 1..{MAX_TUBE}, got {tube}")
    if tube in secret.revoked:
        raise KeyFileError(f"tube {tube}: its keys were revoked; expected another number for another tube")
    write_private(_file_of(folder, tube), pack_ring(secret.ring(tube)))
    if not (folder / f"{file_name(tube)}.key").exists():
        make_certificate(folder, file_name(tube), now, VALID)
    return _file_of(folder, tube)


def revoke_tube(folder: Path, tube: int, now: datetime.datetime) -> RigSecret:
    """Revoke a tube, so that it is believed nothing from now on, and make new keys for all others.

    Raises
    ------
    KeyFileError
        When the folder holds no rig's keys, or the number is invalid.
    """
    secret = read_secret(folder)
    if not 1 <= tube <= MAX_TUBE:
        raise KeyFileError(f"tube: expected 1..{MAX_TUBE}, got {tube}")
    for suffix in (SUFFIX, ".pem", ".key"):
        (folder / f"{file_name(tube)}{suffix}").unlink(missing_ok=True)
    return _rotate(folder, replace(secret, revoked=secret.revoked | {tube}), now)


def add_person(folder: Path, name: str, role: str, now: datetime.datetime) -> Path:
    """Make the certificate of a person, and let it in; returns the file of the certificate.

    Raises
    ------
    KeyFileError
        When the folder holds no rig's keys, or the name cannot be.
    """
    secret = read_secret(folder)
    named = replace(secret, persons=with_person(secret.persons, name, role))
    (person,) = (one for one in named.persons if one.name == name)
    make_certificate(folder, name, now, OF_A_PERSON, person.common_name)
    _write(folder, named, ())
    return folder / f"{name}.pem"


def revoke_person(folder: Path, name: str) -> RigSecret:
    """Shut a person out, for as long as its certificate may be good; no tube's keys change.

    Raises
    ------
    KeyFileError
        When the folder holds no rig's keys, or no person has this name.
    """
    secret = read_secret(folder)
    shut = replace(secret, persons=without_person(secret.persons, name))
    for suffix in (".pem", ".key"):
        (folder / f"{name}{suffix}").unlink(missing_ok=True)
    _write(folder, shut, ())
    return shut


def renew_certificate(folder: Path, name: str, now: datetime.datetime) -> Path:
    """Make a certificate anew, and the key with it; the one of before is good until its end.

    Raises
    ------
    KeyFileError
        When the folder holds no rig's keys, or none of this name has a certificate.
    """
    secret = read_secret(folder)
    person = next((one for one in secret.persons if one.name == name and not one.is_revoked), None)
    tubes = [file_name(tube) for tube in tubes_of(folder)]
    if person is not None:
        make_certificate(folder, name, now, OF_A_PERSON, person.common_name)
    elif name in tubes or name in SURFACE:
        make_certificate(folder, name, now, VALID if name in tubes else AT_THE_SURFACE)
    else:
        persons = sorted(one.name for one in secret.persons if not one.is_revoked)
        names = ", ".join((*SURFACE, *tubes, *persons))
        raise KeyFileError(f"renew: expected one of {names}, got {name!r:.80}")
    return folder / f"{name}.pem"


def rotate_keys(folder: Path, now: datetime.datetime) -> RigSecret:
    """Make new keys for all; the old ones stay valid for a day.

    Raises
    ------
    KeyFileError
        When the folder holds no rig's keys, or no generation is left.
    """
    return _rotate(folder, read_secret(folder), now)


def retire_keys(folder: Path) -> RigSecret:
    """Remove all but the newest keys from every file, once every process of the rig has them.

    Raises
    ------
    KeyFileError
        When the folder holds no rig's keys.
    """
    secret = read_secret(folder)
    retired = replace(secret, generations=secret.generations[-1:])
    _write(folder, retired, [*ALWAYS, *tubes_of(folder)])
    return retired


def read_secret(folder: Path) -> RigSecret:
    """The secret of a rig's folder.

    Raises
    ------
    KeyFileError
        When it cannot be read, is open to others or is invalid.
    """
    path = folder / SECRET_FILE
    text = read_private(path)
    try:
        rows: dict[str, Any] = parse_toml_tables(text)
        generations = tuple(_generation_of(row) for row in rows["generation"])
        persons = tuple(map(person_of, rows["person"])) if "person" in rows else FIRST  # of a folder from before them
        secret = RigSecret(str(rows["rig"]), generations, frozenset(map(int, rows["revoked"])), persons)
    except (KeyError, TypeError, ValueError, AttributeError):
        raise KeyFileError(f"key file {path}: expected what borechain pki wrote, got something else") from None
    if not secret.generations:
        raise KeyFileError(f"key file {path}: expected a generation of keys, got none")
    return secret


def tubes_of(folder: Path) -> list[int]:
    """Tubes that were given keys."""
    names = {_file_of(folder, tube).name: tube for tube in range(1, MAX_TUBE + 1)}
    return sorted(names[path.name] for path in folder.glob(f"*{SUFFIX}") if path.name in names)


def _rotate(folder: Path, secret: RigSecret, now: datetime.datetime) -> RigSecret:
    newest = secret.generations[-1]
    if newest.number == MOST_GENERATION:
        raise KeyFileError(f"folder {folder}: all {MOST_GENERATION} generations are used; begin with a new folder")
    kept = replace(newest, retires_at=now + OVERLAP)
    fresh = SecretGeneration(newest.number + 1, secrets.token_bytes(SECRET_SIZE), now)
    rotated = replace(secret, generations=(kept, fresh))
    _write(folder, rotated, [*ALWAYS, *tubes_of(folder)])
    return rotated


def _write(folder: Path, secret: RigSecret, addresses: Iterable[int]) -> None:
    """Write the secret last: until then the earlier files can be made again."""
    for address in addresses:
        write_private(_file_of(folder, address), pack_ring(secret.ring(address)))
    write_access(folder, secret.rig, admitted_roles(secret.persons), secret.revoked)
    write_private(folder / SECRET_FILE, _pack_secret(secret))


def _pack_secret(secret: RigSecret) -> str:
    lines = [f'rig = "{secret.rig}"', f"revoked = {sorted(secret.revoked)}"]
    for g in secret.generations:
        lines += ["", "[[generation]]", f"number = {g.number}", f"made_at = {g.made_at.isoformat()}"]
        if g.retires_at is not None:
            lines.append(f"retires_at = {g.retires_at.isoformat()}")
        lines.append(f'secret = "{g.secret.hex()}"')
    lines += person_lines(secret.persons)
    return "\n".join(lines) + "\n"


def _generation_of(row: dict[str, Any]) -> SecretGeneration:
    secret = bytes.fromhex(row["secret"])
    if len(secret) != SECRET_SIZE or row["made_at"].utcoffset() is None:
        raise ValueError("generation")
    return SecretGeneration(int(row["number"]), secret, row["made_at"], row.get("retires_at"))


def _file_of(folder: Path, address: int) -> Path:
    return folder / f"{file_name(address)}{SUFFIX}"
