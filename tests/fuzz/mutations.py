"""Changes of a file's bytes, drawn: bits, pieces, numbers and words that a reader may not expect."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

LONGEST = 1 << 20  # bytes of what is made
ODD = (
    b"", b"0", b"-1", b"1e999", b"-1e308", b"nan", b"inf", b"9" * 400, b"1e-400", b"true", b"[]", b"{}", b'""',
    b"'", b'"', b"\\",
    b",", b";", b"\t", b"\n", b"\r", b"\x00", b"\xff\xfe", b"\xef\xbb\xbf", "½".encode(),
    b"[" * 300, b"a." * 300, b"=1+1", b"#", b"2030-01-01",
)  # fmt: skip
WORD = re.compile(rb"[A-Za-z_]+|[-+0-9.eE]+")


def flip_bits(lot: random.Random, content: bytes, _other: bytes) -> bytes:
    """Some bits the other way."""
    changed = bytearray(content)
    for _ in range(lot.randint(1, 8)):
        if changed:
            changed[lot.randrange(len(changed))] ^= 1 << lot.randrange(8)
    return bytes(changed)


def drop_piece(lot: random.Random, content: bytes, _other: bytes) -> bytes:
    """A piece less."""
    begin, end = sorted(lot.randint(0, len(content)) for _ in range(2))
    return content[:begin] + content[end:]


def cut_short(lot: random.Random, content: bytes, _other: bytes) -> bytes:
    """What a write that was cut has left."""
    return content[: lot.randint(0, len(content))]


def say_twice(lot: random.Random, content: bytes, _other: bytes) -> bytes:
    """A piece again, elsewhere."""
    begin, end = sorted(lot.randint(0, len(content)) for _ in range(2))
    at = lot.randint(0, len(content))
    return content[:at] + content[begin:end] + content[at:]


def put_odd(lot: random.Random, content: bytes, _other: bytes) -> bytes:
    """Something odd at any place."""
    at = lot.randint(0, len(content))
    return content[:at] + lot.choice(ODD) + content[at:]


def swap_word(lot: random.Random, content: bytes, _other: bytes) -> bytes:
    """A word or number that is something odd, or another of the file."""
    found = list(WORD.finditer(content[:65_536]))
    if not found:
        return content
    old, new = lot.choice(found), lot.choice([*ODD, lot.choice(found).group()])
    return content[: old.start()] + new + content[old.end() :]


def swap_lines(lot: random.Random, content: bytes, _other: bytes) -> bytes:
    """Lines in another order, one twice."""
    lines = content.splitlines(keepends=True)
    if not lines:
        return content
    for _ in range(lot.randint(1, 4)):
        lines.insert(lot.randint(0, len(lines)), lines[lot.randrange(len(lines))])
        del lines[lot.randrange(len(lines))]
    return b"".join(lines)


def splice(lot: random.Random, content: bytes, other: bytes) -> bytes:
    """The begin of one file and the end of another."""
    return content[: lot.randint(0, len(content))] + other[lot.randint(0, len(other)) :]


MUTATIONS: tuple[Callable[[random.Random, bytes, bytes], bytes], ...] = (
    flip_bits, drop_piece, cut_short, say_twice, put_odd, swap_word, swap_word, swap_lines, splice,
)  # fmt: skip


def mutate(lot: random.Random, seeds: list[bytes]) -> bytes:
    """One of the files, changed up to four times."""
    content = lot.choice(seeds)
    for _ in range(lot.randint(1, 4)):
        content = lot.choice(MUTATIONS)(lot, content, lot.choice(seeds))[:LONGEST]
    return content
