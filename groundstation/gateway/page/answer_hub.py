"""Live answers for many readers: what changed is rendered once, and a slow reader is given the newest alone.

A reader holds the names of the paths that changed since it was served last, not their answers; so its memory is bounded
by the number of paths, however slowly it reads.
"""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Iterable
from typing import Any

import orjson

from groundstation.errors import SelectorError
from groundstation.service.answers.answer_table import find_answer
from groundstation.service.answers.paths import answered_paths
from groundstation.service.process.ground_process import HEARTBEAT, GroundProcess

VERDICT = "verdict"
BEATS_MISSED = 2  # after which a ground station that is asked is not taken for live
READERS = 64  # streams at a time
UNSIGNED_OF_ONE = 32  # of these, from one address without a session
GATHER_S = 0.1  # for which changes are gathered into one packet


class Reader:
    """One browser that follows the answers; ``changed`` are paths that it is to be given."""

    def __init__(self, changed: Iterable[str], address: str = "", *, is_signed: bool = False) -> None:
        self.address, self.is_signed = address, is_signed
        self._changed = dict.fromkeys(changed)
        self._woken = asyncio.Event()
        self.is_closed = False

    def note(self, path: str) -> None:
        """A path has changed."""
        self._changed[path] = None
        self._woken.set()

    def close(self) -> None:
        """Nothing more will come."""
        self.is_closed = True
        self._woken.set()

    def take(self) -> list[str]:
        """Paths that have changed since the last call."""
        self._woken.clear()
        changed, self._changed = list(self._changed), {}
        return changed

    async def changes(self, patience: float) -> list[str]:
        """Paths that have changed, gathered for a moment; none after ``patience`` (s) without a change."""
        try:
            async with asyncio.timeout(patience):
                await self._woken.wait()
        except TimeoutError:
            return []
        await asyncio.sleep(GATHER_S)
        return self.take()


class Hub:
    """Brings what the ground station publishes to every reader.

    Parameters
    ----------
    process : whose answers; the hub lives on the loop that drives it
    is_replay : its verdict is of then, whenever it is asked for
    """

    def __init__(self, process: GroundProcess, *, is_replay: bool = False) -> None:
        self._process = process
        self._is_replay = is_replay
        self._readers: dict[Reader, None] = {}  # the oldest first
        self._rendered: dict[str, bytes] = {}
        self._beat_at = -math.inf  # s, monotonic, of the newest verdict
        process.listeners.append(self._on_change)

    def __len__(self) -> int:
        """How many readers there are."""
        return len(self._readers)

    def join(self, address: str = "", *, is_signed: bool = False) -> Reader | None:
        """A reader that is given the whole picture first; a verdict only if it is of this moment.

        None where there is no place: those at one address who have not signed in have a share of the places, and give
        way to who has.
        """
        if not self._make_room(address, is_signed=is_signed):
            return None
        is_live = self._is_replay or time.monotonic() <= self._beat_at + BEATS_MISSED * HEARTBEAT
        known = answered_paths(self._process.model)
        followed = [path for path, one in known.items() if one.answer.on_page and (is_live or path != VERDICT)]
        reader = Reader(followed, address, is_signed=is_signed)
        self._readers[reader] = None
        return reader

    def _make_room(self, address: str, *, is_signed: bool) -> bool:
        unsigned = [reader for reader in self._readers if not reader.is_signed]
        if not is_signed:
            there = sum(reader.address == address for reader in unsigned)
            return there < UNSIGNED_OF_ONE and len(self._readers) < READERS
        if len(self._readers) >= READERS and unsigned:
            unsigned[0].close()
            self.leave(unsigned[0])
        return len(self._readers) < READERS

    def leave(self, reader: Reader) -> None:
        """A reader has gone."""
        self._readers.pop(reader, None)

    def close(self) -> None:
        """End every reader."""
        self._process.listeners.remove(self._on_change)
        for reader in self._readers:
            reader.close()

    def packet(self, paths: Iterable[str]) -> bytes:
        """Newest answers of paths as server-sent events; a path that has none any more is left out."""
        return b"".join(self._event(path) for path in paths)

    def _on_change(self, paths: list[str]) -> None:
        if VERDICT in paths:
            self._beat_at = time.monotonic()
        for path in paths:
            if find_answer(path).on_page:
                self._rendered.pop(path, None)
                for reader in self._readers:
                    reader.note(path)

    def _event(self, path: str) -> bytes:
        if path in self._rendered:
            return self._rendered[path]
        try:
            answer = self._process.operator.ask_json(path)
        except SelectorError:
            return b""
        rendered = server_sent_event("answer", {"path": path, "answer": orjson.Fragment(answer)})
        if not find_answer(path).of_the_hole:  # what shows a long hole is long, and its text is kept already
            self._rendered[path] = rendered
        return rendered


def server_sent_event(kind: str, content: dict[str, Any]) -> bytes:
    """One server-sent event."""
    return b"event: %s\ndata: %s\n\n" % (kind.encode(), orjson.dumps(content))
