"""What an endpoint says at which pace and end, what it counts, and what of a measurement its seal covers."""

from __future__ import annotations

import hmac
import struct
from pathlib import Path

import pytest
from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC
from sealed_string import SealedString, make_folder
from test_which_key import SECRETS, Held

from telemetry.application.endpoint import Endpoint
from telemetry.application.measurement_seal import MeasurementSeal
from telemetry.application.place import StringPlace
from telemetry.media.port import Priority
from telemetry.messages import (
    BASE,
    ENCODER,
    HOPS_UNKNOWN,
    Aiding,
    Hello,
    NodeMode,
    Side,
    SurveyMeasurement,
    TimeReply,
    TimeRequest,
)
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.schema import MessageKind
from telemetry.transport.hop import HopLink, parse_frame

BURST, QUICK, SLOW = 30, 1.0, 10.0  # exchanges at the quick pace, and s between two, then and later


class Upper:
    """The encoder above an endpoint, which answers every question for the time; s on the endpoint's clock."""

    def __init__(self, endpoint: Endpoint, side: Side, *, answers: bool = True) -> None:
        self.endpoint, self.side, self.answers = endpoint, side, answers
        self.link = HopLink(ENCODER, 1)
        self.asked: list[float] = []
        self.frames = 0

    def run(self, seconds: int) -> None:
        """Step a tenth of a second at a time."""
        for step in range(10 * seconds):
            now = 100.0 + 0.1 * step
            self.link.send_best_effort(encode_message(Hello(ENCODER, 1, 0, NodeMode.BOOT, 1.0)), "hello")
            self._pass_down(now)
            self.endpoint.advance(now)
            for side, frame in self.endpoint.take_frames(now):
                if side is self.side:
                    self._hear(frame.payload, now)
            self._pass_down(now)

    def _hear(self, frame: bytes, now: float) -> None:
        for payload in self.link.receive(frame, now):
            message = decode_message(payload)
            if isinstance(message, TimeRequest):
                self.asked.append(now)
                if self.answers:
                    reply = TimeReply(message.asked_at, now, now, now + 50.0, 1.0, 1e-8, 7)
                    self.link.send_best_effort(encode_message(reply), "time", Priority.TIME)

    def _pass_down(self, now: float) -> None:
        for frame in self.link.take_frames(now):
            self.endpoint.receive(self.side, frame.payload, now)
            self.frames += 1


def test_clocks_are_compared_every_second_at_first_and_then_every_ten() -> None:
    endpoint = Endpoint(3, frozenset(Side), boot_count=1)
    above = Upper(endpoint, Side.UPPER)
    above.run(90)
    waits = [later - before for before, later in zip(above.asked, above.asked[1:], strict=False)]
    assert [wait == pytest.approx(QUICK, abs=0.11) for wait in waits[: BURST - 2]] == [True] * (BURST - 2)
    slow = [wait for wait in waits if wait > 5.0]
    assert slow == pytest.approx([SLOW] * len(slow), abs=0.11)
    assert len(slow) >= 4
    assert endpoint.clock.synchronised
    assert endpoint.clock.rig_from_local(150.0) == pytest.approx(200.0, abs=1e-3)


@pytest.mark.parametrize(("address", "side"), [(3, Side.UPPER), (BASE, Side.LOWER)])
def test_time_is_taken_from_the_encoders_end_and_from_no_other(address: int, side: Side) -> None:
    sides = frozenset(Side) if address != BASE else frozenset({Side.LOWER})
    endpoint = Endpoint(address, sides, boot_count=1)
    Upper(endpoint, side).run(10)
    assert endpoint.clock.exchanges > 5
    if address != BASE:
        below = Endpoint(address, sides, boot_count=1)
        other = Upper(below, Side.LOWER)
        other.link.send_best_effort(encode_message(TimeReply(99.9, 99.95, 99.95, 500.0, 1.0, 1e-8, 7)), "time")
        other.run(5)
        assert (other.asked, below.clock.exchanges) == ([], 0)


def test_each_frame_of_the_neighbour_is_counted_once_and_the_quality_is_of_them() -> None:
    endpoint = Endpoint(3, frozenset(Side), boot_count=1)
    above = Upper(endpoint, Side.UPPER)
    above.run(5)
    link = endpoint._links[Side.UPPER]
    assert link.counters["frames_received"] == above.frames > 20
    assert link.quality == 1.0


def test_the_encoder_knows_where_it_hangs_and_a_tube_once_it_is_told() -> None:
    assert StringPlace(ENCODER, 1, Endpoint(1, frozenset(Side), boot_count=1).counters).told_hops == 0
    tube = Endpoint(3, frozenset(Side), boot_count=1)
    assert tube.place.told_hops == HOPS_UNKNOWN
    Upper(tube, Side.UPPER).run(2)
    assert tube.place.told_hops == 1
    again = Endpoint(3, frozenset(Side), boot_count=2, restored=tube.export_state())
    assert (again.place.told_hops, again.place.hops) == (HOPS_UNKNOWN, 1)


def test_the_seal_of_a_measurement_is_that_of_its_documented_bytes() -> None:
    """Yaw, its variance, rate, time, number, torque, under torque, epoch: an earlier version believes no other."""
    one = Aiding(0.1, 0.2, 0.3, 0.4, 0.5, 100.5, 7, 8, torque=12.5, torsion_var=0.6, under_torque=True, epoch=3)
    fields = (
        struct.pack("<d", one.yaw)
        + struct.pack("<d", one.yaw_var)
        + struct.pack("<d", one.rate)
        + struct.pack("<d", one.valid_at)
        + one.sequence.to_bytes(8, "little")
        + struct.pack("<d", one.torque)
        + bytes([one.under_torque])
        + one.epoch.to_bytes(4, "little")
    )
    key = hmac.digest(SECRETS[1], b"borechain keys 1|measurement", "sha256")[:16]
    mac = CMAC(AES(key))
    mac.update(b"\x01" + fields)
    assert MeasurementSeal(Held(ENCODER, 1)).close(one).seal == b"\x01" + mac.finalize()[:8]


def test_a_string_under_keys_is_joined_and_each_message_comes_through_it(tmp_path: Path) -> None:
    string = SealedString(make_folder(tmp_path / "stick"))
    string.settle()
    string.say(MessageKind.SURVEY_MEASUREMENT)
    string.run(8.0, lambda: any(isinstance(one, SurveyMeasurement) for one in string.heard[BASE]))
    assert any(isinstance(one, SurveyMeasurement) for one in string.heard[BASE])
    frames = [frame for frames in string.wire.values() for frame in frames]
    assert frames
    assert all(parse_frame(frame) is None for frame in frames)  # nothing goes unsealed
