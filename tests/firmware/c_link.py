"""The link of a joint in C for the tests, and Python's beside it, each as one end that takes frames and gives them."""

from __future__ import annotations

import ctypes

from telemetry.transport.hop import HopLink

SLOTS, ROOM, GUARD = 8, 2000, 0xA5


class Header(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint64) for name in ("sender", "epoch", "number", "peer_epoch", "ack", "mask")]


class Entry(ctypes.Structure):
    _fields_ = [
        ("number", ctypes.c_uint64), ("payload", ctypes.c_void_p), ("length", ctypes.c_uint32),
        ("head_length", ctypes.c_uint32), ("head", ctypes.c_uint8 * 27),
    ]  # fmt: skip


class Entries(ctypes.Structure):
    _fields_ = [("at", ctypes.c_void_p), ("left", ctypes.c_uint32), ("count", ctypes.c_uint32)]


class Slot(ctypes.Structure):
    _fields_ = [
        ("payload", ctypes.c_void_p), ("length", ctypes.c_uint32), ("send_at_ms", ctypes.c_uint32),
        ("timeout_ms", ctypes.c_uint32), ("number", ctypes.c_uint64),
    ]  # fmt: skip


class State(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_uint64) for name in ("epoch", "peer_epoch", "peer_sender", "received", "received_mask")),
        ("frames", ctypes.c_uint64), ("next_number", ctypes.c_uint64), ("boot_count", ctypes.c_uint32),
        ("last_heard_ms", ctypes.c_uint32), ("ack_due_ms", ctypes.c_uint32), ("count", ctypes.c_uint32),
        ("session", ctypes.c_uint16), ("address", ctypes.c_uint8), ("has_peer", ctypes.c_bool),
        ("was_heard", ctypes.c_bool), ("is_ack_due", ctypes.c_bool), ("slots", Slot * SLOTS),
        ("close", ctypes.c_void_p), ("close_own", ctypes.c_void_p),
    ]  # fmt: skip


DELIVER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.POINTER(Entry))


class Guarded:
    """Room for a frame between guards."""

    def __init__(self, size: int = ROOM) -> None:
        self._size = size
        self._room = (ctypes.c_uint8 * (size + 16))(*[GUARD] * (size + 16))
        self.begin = ctypes.c_void_p(ctypes.addressof(self._room) + 8)

    def content(self, length: int) -> bytes:
        whole = bytes(self._room)
        assert whole[:8] == whole[8 + self._size :] == bytes([GUARD] * 8)
        return whole[8 : 8 + length]


class CLink:
    """One end in C, which keeps what it is given until it is acknowledged."""

    def __init__(self, library: ctypes.CDLL, address: int, boot_count: int, begin_ms: int = 0) -> None:
        self._library, self.state, self._begin = library, State(), begin_ms
        self._kept: list[ctypes.Array[ctypes.c_char]] = []
        library.link_begin(ctypes.byref(self.state), ctypes.c_uint8(address), boot_count)

    def _at(self, now_ms: int) -> int:
        return self._begin + now_ms & 0xFFFFFFFF

    def send(self, payload: bytes) -> bool:
        content = ctypes.create_string_buffer(payload, len(payload))
        self._kept.append(content)
        return bool(self._library.link_send(ctypes.byref(self.state), content, len(payload)))

    def receive(self, frame: bytes, now_ms: int) -> list[bytes] | None:
        """What came for the first time; None for what is no frame, or an old one."""
        came: list[bytes] = []
        take = DELIVER(lambda _, entry: came.append(ctypes.string_at(entry[0].payload, entry[0].length)))
        state, content = ctypes.byref(self.state), ctypes.create_string_buffer(frame, len(frame))
        answer = self._library.link_receive(state, content, len(frame), self._at(now_ms), take, None)
        return came if answer == 0 else None

    def frames(self, now_ms: int, best_effort: list[bytes]) -> list[bytes]:
        """Every frame that is due."""
        state, frames = ctypes.byref(self.state), []
        room = Guarded()
        while length := self._library.link_next_numbered(state, self._at(now_ms), room.begin, ROOM):
            frames.append(room.content(length))
        for payload in best_effort:
            length = self._library.link_best_effort(state, payload, len(payload), room.begin, ROOM)
            frames.append(room.content(length))
        if length := self._library.link_acknowledgement(state, self._at(now_ms), room.begin, ROOM):
            frames.append(room.content(length))
        return frames


class PythonLink:
    """One end of the product, one payload a frame as on CAN."""

    def __init__(self, address: int, boot_count: int) -> None:
        self.link = HopLink(address, boot_count)
        self.link.bundle_limit = 0

    def receive(self, frame: bytes, now_ms: int) -> list[bytes] | None:
        before = self.link.counters["bad_frames"] + self.link.counters["stale_frames"]
        came = [bytes(payload) for payload in self.link.receive(frame, now_ms / 1e3)]
        after = self.link.counters["bad_frames"] + self.link.counters["stale_frames"]
        return came if after == before else None

    def frames(self, now_ms: int, best_effort: list[bytes]) -> list[bytes]:
        for place, payload in enumerate(best_effort):
            self.link.send_best_effort(payload, place)
        return [frame.payload for frame in self.link.take_frames(now_ms / 1e3)]
