"""Who may change a node: HMAC-SHA256 of every segment under the key of the rig.

The tag covers the addressee, the upload, the version, the hash of the whole block and the segment's place in it, so
that no segment can be moved to another tube, block or place. What is fresh is told by the version: a node takes
newer ones only, and its version survives a restart.
"""

from __future__ import annotations

import hmac
import os
import secrets
import stat
import struct
from pathlib import Path

from telemetry.errors import KeyFileError
from telemetry.frozen import replace
from telemetry.messages import BlockSegment

DOMAIN = b"borechain block segment 1"
FIELDS = struct.Struct("<HQIHH")  # tube, sequence, version, count, index
KEY_SIZE = 32


def sealed_segment(segment: BlockSegment, key: bytes) -> BlockSegment:
    """The segment with its tag."""
    return replace(segment, tag=_tag(segment, key))


def is_authentic(segment: BlockSegment, key: bytes) -> bool:
    """Return whether the tag was made with ``key``, compared in constant time."""
    return hmac.compare_digest(segment.tag, _tag(segment, key))


def read_key(path: Path) -> bytes:
    """Key of a rig: 64 hex digits in a file that only its owner may read.

    Raises
    ------
    KeyFileError
        When the file cannot be read, is open to others or holds no key; what it holds is never repeated.
    """
    try:
        mode = path.stat().st_mode
        text = path.read_text(encoding="ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not text"
        raise KeyFileError(f"key file {path}: {reason}") from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise KeyFileError(f"key file {path}: expected permissions 0600, got {stat.S_IMODE(mode):04o}")
    try:
        key = bytes.fromhex(text)
    except ValueError:
        key = b""
    if len(key) != KEY_SIZE:
        raise KeyFileError(f"key file {path}: expected {2 * KEY_SIZE} hex digits, got {len(text)} characters")
    return key


def new_key(path: Path) -> Path:
    """Make a key for a rig in a new file; returns the file.

    Raises
    ------
    KeyFileError
        When the file exists or cannot be written.
    """
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except OSError as error:
        raise KeyFileError(f"key file {path}: {error.strerror}") from error
    with os.fdopen(descriptor, "w", encoding="ascii") as file:
        file.write(secrets.token_hex(KEY_SIZE) + "\n")
    return path


def _tag(segment: BlockSegment, key: bytes) -> bytes:
    s = segment
    place = FIELDS.pack(s.tube, s.sequence, s.version, s.count, s.index)
    return hmac.digest(key, DOMAIN + place + s.digest + s.data, "sha256")
