"""Sessions of the page: random tokens, and the delay after wrong passwords. No I/O, no clock of its own."""

from __future__ import annotations

import hmac
import secrets
from collections import OrderedDict
from dataclasses import dataclass

SESSIONS = 64  # at a time; of more the oldest ends
VALID_S = 12 * 3600.0  # s, a shift
ADDRESSES = 256  # whose wrong passwords are remembered
LONGEST_HOLD_S = 30.0
FORGOTTEN_S = 900.0  # s after which wrong passwords of an address no longer count


@dataclass(frozen=True, slots=True)
class OperatorSession:
    """One sign-in, valid until ``ends_at`` (s); every order must repeat ``csrf``."""

    token: str
    csrf: str
    role: str
    name: str
    ends_at: float


class Sessions:
    """Sessions by the token in the browser's cookie; times are seconds of a monotonic clock."""

    def __init__(self) -> None:
        self._sessions: OrderedDict[str, OperatorSession] = OrderedDict()

    def begin(self, role: str, name: str, now: float) -> OperatorSession:
        """Begin and return a session of a role under a name."""
        session = OperatorSession(secrets.token_urlsafe(32), secrets.token_urlsafe(32), role, name, now + VALID_S)
        self._sessions[session.token] = session
        while len(self._sessions) > SESSIONS:
            self._sessions.popitem(last=False)
        return session

    def find(self, token: str | None, now: float) -> OperatorSession | None:
        """Session of a token that has not ended."""
        session = self._sessions.get(token or "")
        if session is not None and session.ends_at <= now:
            self.end(session)
            return None
        return session

    def end(self, session: OperatorSession) -> None:
        """End a session."""
        self._sessions.pop(session.token, None)


def is_from(session: OperatorSession, csrf: str | None) -> bool:
    """Whether a request carries what only our own page knows of the session."""
    return hmac.compare_digest(session.csrf.encode(), (csrf or "").encode())


class WrongPasswords:
    """Counts wrong passwords by address: each in a row makes the next one wait twice as long."""

    def __init__(self) -> None:
        self.total = 0
        self._rows: OrderedDict[str, tuple[int, float]] = OrderedDict()  # in a row, s until which it is held

    def hold_of(self, address: str, now: float) -> float:
        """Seconds for which no password of an address is looked at."""
        return max(self._rows.get(address, (0, now))[1] - now, 0.0)

    def add(self, address: str, now: float) -> tuple[int, float]:
        """Count one; how many in a row there are, and for how many seconds the address is held."""
        self.total += 1
        row, held_until = self._rows.pop(address, (0, now))
        row = 1 if now > held_until + FORGOTTEN_S else row + 1
        hold = min(2.0 ** (row - 1), LONGEST_HOLD_S)
        self._rows[address] = row, now + hold
        while len(self._rows) > ADDRESSES:
            self._rows.popitem(last=False)
        return row, hold

    def forgive(self, address: str) -> None:
        """The right password came."""
        self._rows.pop(address, None)
