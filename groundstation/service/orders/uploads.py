"""Uploads of parameter blocks that are under way, at most one a tube."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from groundstation.config import GroundConfig
from telemetry.messages import BlockSegment, BlockStatus
from telemetry.parameters import ParameterBlock
from telemetry.transport.authentication import read_key
from telemetry.transport.upload import Upload, split_block

if TYPE_CHECKING:
    from telemetry.application.seals import Seals


class Uploads:
    """Sends blocks until each node has judged its own.

    Parameters
    ----------
    key_of : gives the key of a tube's blocks; None for a tube that is to be sent none
    """

    def __init__(self, key_of: Callable[[int], bytes | None]) -> None:
        self._key_of = key_of
        self._running: dict[int, Upload] = {}

    def start(self, block: ParameterBlock, number: int, now: float) -> int | None:
        """Begin upload ``number`` at ``now`` (s); returns the number of the one to the same tube that ended by it.

        To a tube whose keys were revoked nothing is sent.
        """
        key = self._key_of(block.tube)
        if key is None:
            return self.cancel(block.tube)
        segments = split_block(block.canonical(), block.tube, number, block.version, key)
        ended = self.cancel(block.tube)
        self._running[block.tube] = Upload(segments, now)
        return ended

    def cancel(self, tube: int) -> int | None:
        """End the upload to a tube; returns its number, None if none was under way."""
        upload = self._running.pop(tube, None)
        return None if upload is None else upload.segments[0].sequence

    def due_segments(self, now: float) -> list[BlockSegment]:
        """Segments to send now."""
        return [segment for upload in self._running.values() for segment in upload.due_segments(now)]

    def next_due(self) -> float:
        """When something is due (s), infinite if nothing is under way."""
        return min([upload.next_due for upload in self._running.values()], default=math.inf)

    def on_status(self, status: BlockStatus) -> bool:
        """Handle a node's status of an upload; True when it is the last word on one that is under way."""
        upload = self._running.get(status.tube)
        if upload is None or not upload.on_status(status):
            return False
        del self._running[status.tube]
        return True


def uploads_of(config: GroundConfig, seals: Seals | None) -> Uploads | None:
    """Uploads under the keys of each tube, or under the one key of the rig; None without any."""
    if seals is not None:
        return Uploads(seals.block_key_of)
    if config.key_file is None:
        return None
    key = read_key(config.key_file)
    return Uploads(lambda _tube: key)
