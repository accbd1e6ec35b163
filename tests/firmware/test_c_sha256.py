"""SHA-256 and HMAC in C: known answers of FIPS 180-4's examples and of RFC 4231, and hashlib's for all else."""

from __future__ import annotations

import ctypes
import hashlib
import hmac
from collections.abc import Sequence
from pathlib import Path

import pytest
from c_library import compile_strictly, load_checked
from hypothesis import example, given
from hypothesis import strategies as st
from needed_programs import needs_clang, needs_gcc

SOURCE = Path(__file__).parents[2] / "firmware" / "tube" / "sha256.c"
LONGEST = (
    "abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmnoijklmnopjklmnopqklmnopqrlmnopqrsmnopqrstnopqrstu"
)
HASHES = {
    b"": "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855",
    b"abc": "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
    b"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq": (
        "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"
    ),
    LONGEST.encode(): "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1",
    b"a" * 1_000_000: "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0",
}  # FIPS 180-4, examples of NIST
TAGS = {
    (b"\x0b" * 20, b"Hi There"): "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7",
    (b"Jefe", b"what do ya want for nothing?"): "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843",
    (b"\xaa" * 20, b"\xdd" * 50): "773ea91e36800e46854db8ebd09181a72959098b3ef8c122d9635514ced565fe",
    (bytes(range(1, 26)), b"\xcd" * 50): "82558a389a443c0ea4cc819899f2083a85f0faa3e578f8077a2e3ff46729665b",
    (b"\xaa" * 131, b"Test Using Larger Than Block-Size Key - Hash Key First"): (
        "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54"
    ),
}  # RFC 4231, sections 4.2 to 4.5 and 4.7
PARTS = st.lists(st.binary(max_size=90), max_size=5)
pytestmark = needs_gcc


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    made = load_checked(tmp_path_factory.mktemp("sha256"), [SOURCE])
    made.digests_agree.restype = ctypes.c_bool
    return made


def hash_of(library: ctypes.CDLL, parts: Sequence[bytes]) -> bytes:
    own, digest = (ctypes.c_uint64 * 32)(), (ctypes.c_uint8 * 32)()
    library.sha256_begin(own)
    for part in parts:
        library.sha256_add(own, part, len(part))
    library.sha256_end(own, digest)
    return bytes(digest)


def tag_of(library: ctypes.CDLL, key: bytes, parts: Sequence[bytes]) -> bytes:
    own, tag = (ctypes.c_uint64 * 48)(), (ctypes.c_uint8 * 32)()
    library.hmac_begin(own, key, len(key))
    for part in parts:
        library.hmac_add(own, part, len(part))
    library.hmac_end(own, tag)
    return bytes(tag)


def test_known_hashes(library: ctypes.CDLL) -> None:
    assert {content: hash_of(library, [content]).hex() for content in HASHES} == HASHES


def test_known_tags(library: ctypes.CDLL) -> None:
    assert {(key, content): tag_of(library, key, [content]).hex() for key, content in TAGS} == TAGS


@given(PARTS)
@example([bytes(55)])  # the length still fits the block
@example([bytes(56)])
@example([bytes(63), bytes(1)])
def test_hashes_are_those_of_python_however_it_comes(library: ctypes.CDLL, parts: list[bytes]) -> None:
    assert hash_of(library, parts) == hashlib.sha256(b"".join(parts)).digest()


@given(st.binary(max_size=140), PARTS)
@example(bytes(64), [b"x"])
@example(bytes(65), [b"x"])
def test_tags_are_those_of_python(library: ctypes.CDLL, key: bytes, parts: list[bytes]) -> None:
    assert tag_of(library, key, parts) == hmac.digest(key, b"".join(parts), "sha256")


@given(st.binary(min_size=32, max_size=32), st.integers(0, 255))
def test_digests_agree_in_every_bit(library: ctypes.CDLL, digest: bytes, bit: int) -> None:
    changed = (int.from_bytes(digest) ^ 1 << bit).to_bytes(32)
    assert library.digests_agree(digest, digest)
    assert not library.digests_agree(digest, changed)


@needs_clang
def test_a_second_compiler_takes_it(tmp_path: Path) -> None:
    done = compile_strictly(tmp_path, "clang", "-O2", "-c", SOURCE)
    assert (done.returncode, done.stderr) == (0, "")
