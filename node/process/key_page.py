"""Keys of a tube as a page of a chip's flash: what ``borechain pki tube`` made, in fixed places, with a checksum.

``firmware/tube/key_page.h`` reads it. A chip has no file that could be read again: new keys are a new page.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Final

from telemetry.transport.key_ring import ADDRESSES, Generation, KeyRing, key_file, read_ring
from telemetry.transport.seal import SEAL_KEY_SIZE

KEY_PAGE: Final = "borechain_keys.bin"
MAGIC: Final = b"BCKY"
FORMAT: Final = 1
HEAD: Final = struct.Struct("<4sBBBx")  # magic, format, tube, generations
GENERATION_HEAD: Final = struct.Struct("<B7x32s")  # number, a bit for each address with a key of a joint
SINGLE: Final = ("end", "call", "measurement")  # in their places before the keys of joints
NO_KEY: Final = bytes(SEAL_KEY_SIZE)


def pack_key_page(ring: KeyRing) -> bytes:
    """Page of the keys of one tube; of one that is revoked it has none."""
    body = HEAD.pack(MAGIC, FORMAT, ring.address, len(ring.generations))
    body += b"".join(_packed(generation, ring) for generation in ring.generations)
    return body + zlib.crc32(body).to_bytes(4, "little")


def write_key_page(place: Path, tube: int, out: Path) -> Path:
    """Write the page of a tube's keys, which lie in a file or in a folder in a file of its name, into ``out``.

    Raises
    ------
    KeyFileError
        When there are no keys of this tube that may be used.
    """
    page = pack_key_page(read_ring(key_file(place, tube), tube))
    out.mkdir(parents=True, exist_ok=True)
    path = out / KEY_PAGE
    path.touch(mode=0o600)
    path.chmod(0o600)  # also one that was there before
    path.write_bytes(page)
    return path


def _packed(generation: Generation, ring: KeyRing) -> bytes:
    joints = {
        other: generation.keys["joint", other]
        for other in ADDRESSES
        if ("joint", other) in generation.keys and other not in ring.revoked
    }
    bits = sum(1 << other for other in joints).to_bytes(32, "little")
    single = [generation.keys[purpose, ring.address if purpose == "end" else 0] for purpose in SINGLE]
    keys = [*single, *(joints.get(other, NO_KEY) for other in ADDRESSES)]
    return GENERATION_HEAD.pack(generation.number, bits) + b"".join(keys)
