"""Senders and receivers of ISO-TP in C, as the tests hold them."""

import ctypes
from pathlib import Path

from c_library import load_checked

FIRMWARE = Path(__file__).parents[2] / "firmware"
NAMES = {
    -1: "bad_length", -2: "bad_type", -3: "unexpected", -4: "out_of_order", -5: "too_long", -6: "interrupted",
    -7: "bad_flow_control", -8: "refused", -9: "no_flow_control",
}  # fmt: skip
WHOLE, GUARD = 1, 0xA5


class CSender(ctypes.Structure):
    _fields_ = [
        ("payload", ctypes.c_void_p), ("length", ctypes.c_uint32), ("sent", ctypes.c_uint32),
        ("moved_at_ms", ctypes.c_uint32), ("largest", ctypes.c_uint8), ("sequence", ctypes.c_uint8),
        ("allowed", ctypes.c_uint8), ("is_unlimited", ctypes.c_bool), ("is_open", ctypes.c_bool),
    ]  # fmt: skip


class CReceiver(ctypes.Structure):
    _fields_ = [
        ("room", ctypes.c_void_p), ("limit", ctypes.c_uint32), ("length", ctypes.c_uint32), ("taken", ctypes.c_uint32),
        ("moved_at_ms", ctypes.c_uint32), ("sequence", ctypes.c_uint8), ("until_flow", ctypes.c_uint8),
        ("is_open", ctypes.c_bool), ("has_flow", ctypes.c_bool), ("flow", ctypes.c_uint8 * 3),
    ]  # fmt: skip


def load_isotp(folder: Path) -> ctypes.CDLL:
    library = load_checked(folder, [FIRMWARE / "isotp.c"])
    library.isotp_next_frame.restype = ctypes.c_uint8
    library.isotp_fd_length.restype = ctypes.c_uint8
    for name in ("isotp_awaits_flow", "isotp_listen"):
        getattr(library, name).restype = ctypes.c_bool
    return library


class Outward:
    """A sender in C."""

    def __init__(self, library: ctypes.CDLL, payload: bytes, largest: int, now_ms: int = 0) -> None:
        self._library, self._state = library, CSender()
        self._payload = (ctypes.c_uint8 * max(len(payload), 1))(*payload)
        library.isotp_begin(ctypes.byref(self._state), self._payload, len(payload), ctypes.c_uint8(largest), now_ms)

    @property
    def is_open(self) -> bool:
        return bool(self._state.is_open)

    @property
    def awaits_flow(self) -> bool:
        return bool(self._library.isotp_awaits_flow(ctypes.byref(self._state)))

    def next_frame(self, now_ms: int = 0) -> bytes:
        data = (ctypes.c_uint8 * 72)(*[GUARD] * 72)
        length = self._library.isotp_next_frame(ctypes.byref(self._state), data, now_ms)
        assert bytes(data)[64:] == bytes([GUARD] * 8)
        return bytes(data)[:length]

    def on_flow(self, data: bytes, now_ms: int = 0) -> str | None:
        given = (ctypes.c_uint8 * max(len(data), 1))(*data)
        return NAMES.get(self._library.isotp_on_flow(ctypes.byref(self._state), given, len(data), now_ms))

    def advance(self, now_ms: int) -> str | None:
        return NAMES.get(self._library.isotp_advance_sender(ctypes.byref(self._state), now_ms))


class Inward:
    """A receiver in C, its room between guards."""

    def __init__(self, library: ctypes.CDLL, limit: int) -> None:
        self._library, self._state, self._limit = library, CReceiver(), limit
        self._room = (ctypes.c_uint8 * (limit + 16))(*[GUARD] * (limit + 16))
        begin = ctypes.addressof(self._room) + 8
        assert library.isotp_listen(ctypes.byref(self._state), ctypes.c_void_p(begin), limit)

    @property
    def is_open(self) -> bool:
        return bool(self._state.is_open)

    def on_frame(self, data: bytes, now_ms: int = 0) -> bytes | str | None:
        """The payload that is whole, or the name of what failed."""
        given = (ctypes.c_uint8 * max(len(data), 1))(*data)
        answer = self._library.isotp_on_frame(ctypes.byref(self._state), given, ctypes.c_size_t(len(data)), now_ms)
        whole = bytes(self._room)
        assert whole[:8] == whole[8 + self._limit :] == bytes([GUARD] * 8)
        return whole[8 : 8 + self._state.length] if answer == WHOLE else NAMES.get(answer)

    def take_flow(self) -> bytes | None:
        """What is to be answered."""
        if not self._state.has_flow:
            return None
        self._state.has_flow = False
        return bytes(self._state.flow)

    def advance(self, now_ms: int) -> str | None:
        return NAMES.get(self._library.isotp_advance_receiver(ctypes.byref(self._state), now_ms))
