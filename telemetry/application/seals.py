"""Every seal of one process, as its endpoint uses them; an endpoint without keys has none of this."""

from __future__ import annotations

import secrets
from collections import Counter
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path

from telemetry.application.depth_seal import open_depth
from telemetry.application.end_seal import BaseEnd, SealFinding, SealingEnd, content_of_sealed, is_sealed
from telemetry.application.measurement_seal import MeasurementSeal
from telemetry.errors import KeyFileError
from telemetry.media.port import PortFrame, Priority
from telemetry.messages import BASE, Message, NodeState, SessionOffer, Side
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.transport.joint_seal import JointSeal
from telemetry.transport.key_ring import KeyRing, key_file, read_ring

LOOK_EVERY = 2.0  # s between two looks at the key file
NO_FAILURES = (
    "seal_duplicate",
    "seal_late",
    "seal_before_joined",
)  # what happens whenever a joint is made up or a process starts


class Keys:
    """Keys of a process and the file they come from, which is read again when it has changed.

    Parameters
    ----------
    path : of the file
    address : of the process

    Raises
    ------
    KeyFileError
        When the file holds no keys of this process that may be used.
    """

    def __init__(self, path: Path, address: int) -> None:
        self._path, self._address = path, address
        self._read = self._stamp()
        self.ring = read_ring(path, address)
        self.fault = ""  # why the file as it is now is not used, or empty

    def current(self) -> KeyRing:
        """The keys in use."""
        return self.ring

    def refresh(self) -> bool:
        """Read the file again if it has changed; returns whether the keys changed. An invalid file changes nothing."""
        stamp = self._stamp()
        if stamp == self._read:
            return False
        self._read = stamp
        try:
            self.ring = read_ring(self._path, self._address)
        except KeyFileError as error:
            self.fault = str(error)
            return False
        self.fault = ""
        return True

    def _stamp(self) -> tuple[int, int, int] | None:
        try:
            found = self._path.stat()
        except OSError:
            return None
        return found.st_mtime_ns, found.st_ino, found.st_size


class Seals:
    """Seals of one endpoint.

    Parameters
    ----------
    keys : of the process
    address : of the process
    sides : ends that exist
    lot : 64 random bits, for session numbers; those of the operating system if absent
    """

    def __init__(
        self,
        keys: Keys,
        address: int,
        sides: Iterable[Side],
        lot: Callable[[], int] | None = None,
    ) -> None:
        lot = lot or partial(secrets.randbits, 64)
        self._keys = keys
        ring = keys.current
        self.joints = {side: JointSeal(address, ring, lot) for side in sorted(sides)}
        self.base = BaseEnd(ring, lot) if address == BASE else None
        self.tube = None if address == BASE else SealingEnd(address, ring, lot)
        self.measurement = MeasurementSeal(ring)
        self._depth_counters: Counter[str] = Counter()
        self._depth_number = -1
        self._looked_at = -LOOK_EVERY

    @staticmethod
    def content(payload: bytes) -> bytes:
        """Return the content of a payload without a look at its seal; a relay needs no more."""
        return content_of_sealed(payload)

    def hear(self, payload: bytes, tube: int, now: float) -> SealFinding:
        """Judge a payload from a tube, at the base."""
        return SealFinding.NOTHING if self.base is None else self.base.open(payload, tube, now)

    def is_told(self, payload: bytes, now: float, *, is_offer: bool) -> bool:
        """Return whether a tube believes a payload from the base."""
        return self.tube is not None and self.tube.open(payload, now, is_offer=is_offer)

    def is_of(self, message: Message, tube: int) -> bool:
        """Return whether a message is of the tube whose seal it came under and, for a state, newer than the last."""
        end = self.base or self.tube
        if end is not None and getattr(message, "tube", None) != tube:
            end.counters["seal_end_spliced"] += 1
            return False
        return self.base is None or not isinstance(message, NodeState) or self.base.is_next_state(tube, message.cycles)

    def is_order_new(self, number: int, too_old: int) -> bool:
        """Return whether an order is newer than all that a tube has forgotten."""
        if number <= too_old and self.tube is not None:
            self.tube.counters["seal_end_old_order"] += 1
        return number > too_old

    def close_up(self, payload: bytes) -> bytes:
        """Seal a payload for the base."""
        return payload if self.tube is None else self.tube.close(payload)

    def close_down(self, payload: bytes, tube: int) -> bytes | None:
        """Seal a payload for a tube; None without a session."""
        return None if self.base is None else self.base.close(payload, tube)

    def due_offers(self) -> list[tuple[int, bytes]]:
        """Sealed offers of sessions that are due, each with its tube."""
        return [] if self.base is None else self.base.due_offers(lambda tube: encode_message(SessionOffer(tube)))

    def next_wake(self) -> float:
        """Time (s) at which ``frames_of`` has something to send by itself, infinite if never."""
        return min(joint.next_wake() for joint in self.joints.values())

    def depth_content(self, payload: bytes) -> bytes | None:
        """Payload of a reading of the depth; None where its seal does not fit."""
        content = open_depth(self._keys.current, payload)
        if content is None:
            self._depth_counters["seal_depth_wrong_tag" if is_sealed(payload) else "seal_depth_unsealed"] += 1
        return content

    def is_next_depth(self, number: int) -> bool:
        """Return whether a reading of the depth is newer than all before; after a restart rig time bounds it."""
        if number <= self._depth_number:
            self._depth_counters["seal_depth_repeated"] += 1
            return False
        self._depth_number = number
        return True

    @property
    def block_keys(self) -> list[bytes]:
        """Candidate keys of a segment of a parameter block for this tube, one a generation."""
        ring = self._keys.ring
        keys = [generation.keys.get(("block", ring.address)) for generation in ring.generations]
        return [key for key in keys if key is not None]

    def block_key_of(self, tube: int) -> bytes | None:
        """Key of the parameter blocks for a tube, of a generation that the tube has; None for a revoked one."""
        newest = None if self.base is None else self.base.newest_of(tube)
        return self._keys.ring.block_key(tube, newest)

    @property
    def ring(self) -> KeyRing:
        """The keys in use."""
        return self._keys.ring

    @property
    def trouble(self) -> str:
        """Fault of the key file, or warnings on the keys in use; empty if there are none."""
        return self._keys.fault or "; ".join(self._keys.ring.warnings)

    def frames_of(self, side: Side, frames: Iterable[PortFrame], now: float) -> list[PortFrame]:
        """Sealed frames of a link, and before them the call or answer that is due at ``now`` (s).

        Frames of a link without a partner are dropped: a clock exchange must not wait, and the link repeats the rest.
        """
        joint = self.joints[side]
        sealed = [PortFrame(payload, Priority.HELLO, "call") for payload in joint.own_frames(now)]
        for frame in frames:
            payload = joint.close(frame.payload)
            if payload is not None:
                sealed.append(frame._replace(content=payload))
        return sealed

    def advance(self, now: float) -> None:
        """Let time pass to ``now`` (s): look at the key file, count what was not proven in time."""
        if self.base is not None:
            self.base.count_unproven(now)
        if now < self._looked_at + LOOK_EVERY:
            return
        self._looked_at = now
        if self._keys.refresh():
            for joint in self.joints.values():
                joint.forget_revoked()
            if self.base is not None:
                self.base.forget_revoked()

    def counters(self) -> Counter[str]:
        """Counts of refused frames and payloads, of every seal."""
        total = self.measurement.counters + self._depth_counters
        for one in (*self.joints.values(), self.base, self.tube):
            if one is not None:
                total.update(one.counters)
        return total

    def failures(self) -> dict[str, int]:
        """Counters of failures, by name."""
        return {name: count for name, count in self.counters().items() if name not in NO_FAILURES}


def seals_of(
    place: Path | None, address: int, sides: Iterable[Side], reach: int = 1, rig: str | None = None
) -> Seals | None:
    """Seals of a process whose keys lie in a file, or in a folder in a file of its name; None without a place.

    Raises
    ------
    KeyFileError
        When there are no keys that may be used, or those of another rig than ``rig``, or a radio hears more than the
        next tube: a frame is sealed for one.
    """
    if place is None:
        return None
    if reach > 1:
        raise KeyFileError(f"--keys: expected joints of which each hears its neighbour alone, got a reach of {reach}")
    keys = Keys(key_file(place, address), address)
    if rig is not None and keys.ring.rig != rig:
        raise KeyFileError(f"key file {key_file(place, address)}: expected keys of {rig}, got those of {keys.ring.rig}")
    return Seals(keys, address, sides)
