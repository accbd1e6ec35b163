"""Keys of one process: what it may seal and what it may believe, read from a file that its owner alone may read.

Every key is derived from the secret of a generation, which no process has: HMAC-SHA256 of the secret and the purpose.

===========  ==========================================  ===================================
key          seals                                       held by
===========  ==========================================  ===================================
end          messages between a tube and the base        that tube (or the encoder), the base
joint        frames between two processes                these two
call         calls for the process at the other end      everybody
measurement  the encoder's measurement                   everybody on the string
depth        readings of the depth                       the source of the depth, the base
block        segments of a parameter block               the tube, the base
===========  ==========================================  ===================================

A key file holds the newest generation and the one before it. That one is valid for a day; then it is warned of and
still used, until the crew ends it: nothing ends in the middle of a hole because of a clock.
"""

from __future__ import annotations

import datetime
import hmac
import os
import stat
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from telemetry.errors import KeyFileError
from telemetry.media.credentials import DEPTH_SOURCE, file_name
from telemetry.messages import BASE, ENCODER
from telemetry.toml_tables import parse_toml_tables
from telemetry.transport.seal import SEAL_KEY_SIZE, SealKey

FORMAT = 1
ADDRESSES = range(BASE + 1)
BLOCK_KEY_SIZE = 32
MOST_GENERATION = 255
SUFFIX = ".keys"
AHEAD_WARNED = datetime.timedelta(hours=1)
Secret = bytes


@dataclass(slots=True)
class Generation:
    """Keys of one generation.

    Parameters
    ----------
    number : 1..255; the larger is the newer
    keys : by purpose and, where it is one of many, the other's address
    made_at, retires_at : UTC; a generation that has no successor yet is not retired
    """

    number: int
    keys: dict[tuple[str, int], bytes]
    made_at: datetime.datetime
    retires_at: datetime.datetime | None = None
    _seal_keys: dict[tuple[str, int], SealKey] = field(default_factory=dict)

    def seal_key(self, purpose: str, other: int = 0) -> SealKey | None:
        """Key of a purpose, None where this process has none."""
        name = purpose, other
        found = self._seal_keys.get(name)
        if found is None and name in self.keys:
            found = self._seal_keys[name] = SealKey(self.keys[name])
        return found


@dataclass(frozen=True, slots=True)
class KeyRing:
    """Keys of one process; generations from the oldest to the newest, at least one.

    ``revoked`` are addresses that are believed nothing. ``warnings`` say what is odd about the file.
    """

    rig: str
    address: int
    generations: tuple[Generation, ...]
    revoked: frozenset[int] = frozenset()
    warnings: tuple[str, ...] = ()

    @property
    def newest(self) -> int:
        """Number of the newest generation."""
        return self.generations[-1].number

    @property
    def oldest(self) -> int:
        """Number of the oldest generation, which every process has that was given keys since it was made."""
        return self.generations[0].number

    def common(self, others_newest: int) -> int:
        """Newest generation that both have, where the other's newest is known."""
        return max((g.number for g in self.generations if g.number <= others_newest), default=self.oldest)

    def seal_key(self, generation: int, purpose: str, other: int = 0) -> SealKey | None:
        """Key of a generation, None where this process has none or the other one is revoked."""
        if purpose in ("end", "joint") and other in self.revoked:
            return None
        for g in self.generations:
            if g.number == generation:
                return g.seal_key(purpose, other)
        return None

    def block_key(self, tube: int, tubes_newest: int | None = None) -> bytes | None:
        """Key of the parameter blocks of a tube whose newest generation may be known; None for a revoked one."""
        number = self.oldest if tubes_newest is None else self.common(tubes_newest)
        found = next(g for g in self.generations if g.number == number)
        return None if tube in self.revoked else found.keys.get(("block", tube))


def derived_key(secret: Secret, purpose: str, *addresses: int, size: int = SEAL_KEY_SIZE) -> bytes:
    """Key of a purpose."""
    label = "|".join(["borechain keys 1", purpose, *map(str, addresses)])
    return hmac.digest(secret, label.encode(), "sha256")[:size]


def keys_of(secret: Secret, address: int, revoked: Iterable[int] = ()) -> dict[tuple[str, int], bytes]:
    """Keys that the process ``address`` is given of a generation; none with those that are revoked."""
    if address == DEPTH_SOURCE:
        return {("depth", 0): derived_key(secret, "depth")}
    others = [other for other in ADDRESSES if other != address and other not in set(revoked)]
    keys = {("joint", other): derived_key(secret, "joint", *sorted((address, other))) for other in others}
    keys["call", 0] = derived_key(secret, "call")
    keys["measurement", 0] = derived_key(secret, "measurement")
    tubes = [other for other in others if other != BASE] if address == BASE else [address]
    for tube in tubes:
        keys["end", tube] = derived_key(secret, "end", tube)
        if tube != ENCODER:
            keys["block", tube] = derived_key(secret, "block", tube, size=BLOCK_KEY_SIZE)
    if address == BASE:
        keys["depth", 0] = derived_key(secret, "depth")
    return keys


def key_file(place: Path, address: int) -> Path:
    """Key file of a process: the file itself, or the one with its name in a folder."""
    return place / f"{file_name(address)}{SUFFIX}" if place.is_dir() else place


def pack_ring(ring: KeyRing) -> str:
    """Text of a key file."""
    lines = [
        f"# keys of {file_name(ring.address)} of the rig {ring.rig}; a holder of this file can speak for it",
        f"format = {FORMAT}",
        f'rig = "{ring.rig}"',
        f"address = {ring.address}",
        f"revoked = {sorted(ring.revoked)}",
    ]
    for generation in ring.generations:
        lines += ["", "[[generation]]", f"number = {generation.number}", f"made_at = {generation.made_at.isoformat()}"]
        if generation.retires_at is not None:
            lines.append(f"retires_at = {generation.retires_at.isoformat()}")
        lines += [f'"{purpose}.{other}" = "{key.hex()}"' for (purpose, other), key in generation.keys.items()]
    return "\n".join(lines) + "\n"


def read_ring(path: Path, address: int, now: datetime.datetime | None = None) -> KeyRing:
    """Keys of the process ``address`` from their file; oddities of its dates at ``now`` (UTC) become warnings.

    Raises
    ------
    KeyFileError
        When the file cannot be read, is open to others, holds no keys or those of another process; what it holds is
        never repeated.
    """
    text = read_private(path)
    try:
        rows: dict[str, Any] = parse_toml_tables(text)
        ring = _ring_of(rows)
    except (KeyError, TypeError, ValueError, AttributeError):
        raise KeyFileError(f"key file {path}: expected keys as borechain pki writes them, got something else") from None
    if ring.address != address:
        expected, got = file_name(address), file_name(ring.address)
        raise KeyFileError(f"key file {path}: expected keys of {expected}, got those of {got}")
    return _warned(ring, path, now or datetime.datetime.now(datetime.UTC))


def read_private(path: Path) -> str:
    """Return the text of a file that only its owner may read.

    Raises
    ------
    KeyFileError
        When it cannot be read, is not text or is open to others.
    """
    try:
        with path.open(encoding="ascii") as file:
            mode = os.fstat(file.fileno()).st_mode
            text = file.read()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not text"
        raise KeyFileError(f"key file {path}: {reason}") from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise KeyFileError(f"key file {path}: expected permissions 0600, got {stat.S_IMODE(mode):04o}")
    return text


def _ring_of(rows: dict[str, Any]) -> KeyRing:
    if rows["format"] != FORMAT:
        raise ValueError("format")
    address = int(rows["address"])
    if address not in (*ADDRESSES, DEPTH_SOURCE):
        raise ValueError("address")
    generations = sorted((_generation_of(row) for row in rows["generation"]), key=lambda g: g.number)
    if not generations or len({g.number for g in generations}) < len(generations):
        raise ValueError("generation")
    return KeyRing(str(rows["rig"]), address, tuple(generations), frozenset(map(int, rows["revoked"])))


def _generation_of(row: dict[str, Any]) -> Generation:
    number, made_at, retires_at = row.pop("number"), row.pop("made_at"), row.pop("retires_at", None)
    if type(number) is not int or not 1 <= number <= MOST_GENERATION or made_at.utcoffset() is None:
        raise ValueError("generation")
    keys = {}
    for name, text in row.items():
        purpose, _, other = name.partition(".")
        key = bytes.fromhex(text)
        if len(key) != (BLOCK_KEY_SIZE if purpose == "block" else SEAL_KEY_SIZE):
            raise ValueError("key")
        keys[purpose, int(other)] = key
    if retires_at is not None:
        retires_at.utcoffset()
    return Generation(number, keys, made_at, retires_at)


def _warned(ring: KeyRing, path: Path, now: datetime.datetime) -> KeyRing:
    """Return the ring with warnings on its dates; a board without a clock drills all the same."""
    warnings = []
    for g in ring.generations:
        if g.made_at > now + AHEAD_WARNED:
            when = f"was made at {g.made_at:%Y-%m-%d %H:%M} UTC, which is in the future"
            warnings.append(f"key file {path}: generation {g.number} {when}; expected a clock that is set")
        if g.retires_at is not None and g.retires_at <= now and g.number != ring.newest:
            since = f"was valid until {g.retires_at:%Y-%m-%d %H:%M} UTC"
            warnings.append(f"key file {path}: generation {g.number} {since}; borechain pki retire ends it")
    return KeyRing(ring.rig, ring.address, ring.generations, ring.revoked, tuple(warnings))
