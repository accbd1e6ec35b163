"""The hash by which a receipt names what was stored."""

from __future__ import annotations

import hashlib

from telemetry.messages import CONTENT_SIZE, Message
from telemetry.presentation.msgpack_codec import encode_message


def content_of(payload: bytes) -> bytes:
    """Hash of a payload, as it stands in a receipt."""
    return hashlib.blake2b(payload, digest_size=CONTENT_SIZE).digest()


def content_of_message(message: Message) -> bytes:
    """Hash of the payload of a message; a message has one payload only."""
    return content_of(encode_message(message))
