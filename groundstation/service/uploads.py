"""Uploads of parameter blocks that are under way, at most one a tube."""

from __future__ import annotations

import math
from concurrent.futures import Future

from telemetry.messages import BlockSegment, BlockStatus
from telemetry.parameters import ParameterBlock
from telemetry.transport.upload import Upload, split


class Uploads:
    """Sends blocks until each node has judged its own.

    Parameters
    ----------
    key : of the rig
    """

    def __init__(self, key: bytes) -> None:
        self._key = key
        self._running: dict[int, tuple[Upload, Future[BlockStatus]]] = {}

    def start(self, block: ParameterBlock, sequence: int, outcome: Future[BlockStatus], now: float) -> None:
        """Begin an upload at ``now`` (s); one that still runs to the same tube is given up."""
        segments = split(block.canonical(), block.tube, sequence, block.version, self._key)
        self.give_up(block.tube)
        self._running[block.tube] = (Upload(segments, now), outcome)

    def give_up(self, tube: int) -> None:
        """End the upload to a tube, if one runs."""
        if (given_up := self._running.pop(tube, None)) is not None:
            given_up[1].cancel()

    def due_segments(self, now: float) -> list[BlockSegment]:
        """Segments to send now."""
        return [segment for upload, _ in self._running.values() for segment in upload.due_segments(now)]

    def next_due(self) -> float:
        """When something is due (s), infinite if nothing is under way."""
        return min((upload.next_due for upload, _ in self._running.values()), default=math.inf)

    def on_status(self, status: BlockStatus) -> None:
        """Take a node's account; its last word is the outcome."""
        upload, outcome = self._running.get(status.tube, (None, None))
        if upload is not None and outcome is not None and upload.on_status(status):
            del self._running[status.tube]
            outcome.set_result(status)
