"""What a process has answered to orders: one that is repeated is answered again and not obeyed again."""

from __future__ import annotations

from collections import OrderedDict, deque

KEPT = 64


class Answers:
    """The newest answers, by the number of their order.

    Attributes
    ----------
    too_old : number of an order from which on down none of the session with the base is obeyed: its answer is forgotten
    """

    def __init__(self) -> None:
        self.too_old = 0
        self._payloads: OrderedDict[int, bytes] = OrderedDict()
        self._of_session: deque[int] = deque()

    def __contains__(self, sequence: int) -> bool:
        return sequence in self._payloads

    def keep(self, sequence: int, payload: bytes) -> None:
        """Remember an answer; the oldest makes room."""
        self._payloads[sequence] = payload
        while len(self._payloads) > KEPT:
            self._payloads.popitem(last=False)
        self._of_session.append(sequence)
        if len(self._of_session) > KEPT:
            self.too_old = max(self.too_old, self._of_session.popleft())

    def payload(self, sequence: int) -> bytes:
        """Answer to an order that is kept."""
        return self._payloads[sequence]

    def begin_session(self) -> None:
        """Begin a session, in which the base counts its orders anew."""
        self._of_session.clear()
        self.too_old = 0

    def contents(self) -> list[tuple[int, bytes]]:
        """All answers with the number of their order, to be saved."""
        return list(self._payloads.items())

    def restore(self, contents: list[tuple[int, bytes]]) -> None:
        """Continue from saved answers."""
        self._payloads.update(contents)
