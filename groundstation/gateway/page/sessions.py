"""Sessions of the page: random tokens, and the delay after wrong passwords. No I/O, no clock of its own.

A wrong password holds its address and its name. A name can be held by strangers, so one who was right once is not held
by name at the address where it was.
"""

from __future__ import annotations

import hmac
import secrets
from collections import OrderedDict
from dataclasses import dataclass

SESSIONS = 64  # at a time; of more the oldest ends
VALID_S = 12 * 3600.0  # s, a shift
REMEMBERED = 256  # addresses, and names, whose wrong passwords are remembered
LONGEST_HOLD_S = 30.0
FORGOTTEN_S = 900.0  # s after which wrong passwords of an address no longer count


@dataclass(frozen=True, slots=True)
class OperatorSession:
    """One sign-in, valid until ``ends_at`` (s); every order must repeat ``csrf``.

    ``holder`` and ``hashed`` are the password of then: a session ends with it.
    """

    token: str
    csrf: str
    role: str
    name: str
    ends_at: float
    holder: str = ""
    hashed: str = ""


class Sessions:
    """Sessions by the token in the browser's cookie; times are seconds of a monotonic clock."""

    def __init__(self) -> None:
        self._sessions: OrderedDict[str, OperatorSession] = OrderedDict()

    def begin(self, role: str, name: str, now: float, holder: str = "", hashed: str = "") -> OperatorSession:
        """Begin and return a session of a role under a name."""
        token, csrf = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
        session = OperatorSession(token, csrf, role, name, now + VALID_S, holder, hashed)
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


class WrongRows:
    """Wrong passwords in a row, of each address or of each name: each makes the next one wait twice as long."""

    def __init__(self) -> None:
        self._rows: OrderedDict[str, tuple[int, float]] = OrderedDict()  # in a row, s until which it is held

    def hold_of(self, whose: str, now: float) -> float:
        """Seconds for which no password of one is looked at."""
        return max(self._rows.get(whose, (0, now))[1] - now, 0.0)

    def add(self, whose: str, now: float) -> tuple[int, float]:
        """Count one; how many in a row there are, and for how many seconds it is held."""
        row, held_until = self._rows.pop(whose, (0, now))
        row = 1 if now > held_until + FORGOTTEN_S else row + 1
        hold = min(2.0 ** (row - 1), LONGEST_HOLD_S)
        self._rows[whose] = row, now + hold
        while len(self._rows) > REMEMBERED:
            self._rows.popitem(last=False)
        return row, hold

    def forgive(self, whose: str) -> None:
        """The right password came."""
        self._rows.pop(whose, None)


class WrongPasswords:
    """Counts wrong passwords by address and by name."""

    def __init__(self) -> None:
        self.total = 0
        self._addresses, self._names = WrongRows(), WrongRows()
        self._known: OrderedDict[tuple[str, str], None] = OrderedDict()  # where a name has signed in before

    def hold_of(self, address: str, now: float, name: str = "") -> float:
        """Seconds for which no password of an address, or for a name, is looked at."""
        of_name = 0.0 if (address, name) in self._known else self._names.hold_of(name, now)
        return max(self._addresses.hold_of(address, now), of_name)

    def add(self, address: str, now: float, name: str = "") -> tuple[int, float]:
        """Count one; how many in a row there are of the address, and for how many seconds it is held."""
        self.total += 1
        if name:
            self._names.add(name, now)
        return self._addresses.add(address, now)

    def forgive(self, address: str, name: str = "") -> None:
        """The right password came."""
        self._addresses.forgive(address)
        if name:
            self._names.forgive(name)
            self._known[address, name] = None
            while len(self._known) > REMEMBERED:
                self._known.popitem(last=False)
