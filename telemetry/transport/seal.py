"""Tags that tell who made some bytes, and the window that tells whether they came before.

A tag is the first 64 bits of an AES-128 CMAC (NIST SP 800-38B). A forger who does not know the key has one chance in
2^64 with each try, and no way to try without the receiver, which counts.
"""

from __future__ import annotations

import hmac

from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC

SEAL_KEY_SIZE = 16  # bytes
TAG_SIZE = 8  # bytes
WINDOW = 64
ALL_SEEN = (1 << WINDOW) - 1  # bits of a window


class SealKey:
    """A key for tags; its schedule is computed once and copied for each tag."""

    def __init__(self, key: bytes) -> None:
        self._context = CMAC(AES(key))

    def tag(self, *parts: bytes) -> bytes:
        """Tag of the parts one after the other."""
        context = self._context.copy()
        context.update(b"".join(parts))
        return context.finalize()[:TAG_SIZE]

    def fits(self, tag: bytes, *parts: bytes) -> bool:
        """Return whether a tag is that of the parts, compared in constant time."""
        return hmac.compare_digest(tag, self.tag(*parts))


class ReplayWindow:
    """Numbers that came: each is admitted once, and none that is 64 or more behind the largest."""

    def __init__(self) -> None:
        self._largest = -1
        self._seen = 0  # bit k: the number k below the largest came

    def admit(self, number: int) -> bool:
        """Return whether a number (>= 0) comes for the first time, and note it."""
        ahead = number - self._largest
        if ahead > 0:
            self._seen = (self._seen << ahead | 1) & ALL_SEEN if ahead < WINDOW else 1
            self._largest = number
            return True
        if -ahead >= WINDOW or self._seen >> -ahead & 1:
            return False
        self._seen |= 1 << -ahead
        return True
