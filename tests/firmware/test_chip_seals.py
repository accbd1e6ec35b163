"""A chip's node under keys between sealed endpoints of the product, and one below an encoder of a large epoch."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import pytest
from chip_in_process import ANSWERED, EXCHANGES, FD, NEXT_NUMBER, ChipNode, wrapped
from chip_rig import BELOW, CHIP, EPOCH, OFFSET, SETTINGS, Rig
from needed_programs import needs_gcc
from seal_keys import REASONS, ring_of
from sealed_string import make_folder

from node.process.key_page import pack_key_page
from telemetry.application.end_seal import DOWN, Pair, close_payload
from telemetry.media.can_exchange import CanData
from telemetry.media.can_identifier import TUNNEL, packed_identifier
from telemetry.media.isotp import Sender
from telemetry.media.port import Priority
from telemetry.messages import (
    Aiding,
    Command,
    Event,
    NodeFlag,
    NodeMode,
    NodeState,
    Reply,
    Severity,
    Side,
    SurveyMeasurement,
)
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.transport.joint_seal import HEAD, JointSeal
from telemetry.transport.key_ring import key_file, read_ring
from telemetry.transport.seal import TAG_SIZE, SealKey

LARGE = 2**31 + 7
UNFIT = NodeFlag.YAW_UNTRUSTED | NodeFlag.CLOCK_UNSYNCHRONISED
pytestmark = [needs_gcc, pytest.mark.slow]


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folder(tmp_path_factory.mktemp("keys"))


def refused(rig: Rig) -> dict[str, int]:
    """Frames and payloads that the chip refused, by reason."""
    counts = {name: rig.chip.number(100 + k) for k, name in enumerate(REASONS)}
    return {name: count for name, count in counts.items() if count}


def frames_to_chip(rig: Rig) -> list[bytes]:
    """Let every sealed frame from above be noted, as one who listens would."""
    noted: list[bytes] = []
    joint = rig.base.endpoint.seals.joints[Side.LOWER]  # type: ignore[union-attr]
    sealed = joint._sealed

    def note(*told: object) -> bytes | None:
        frame = sealed(*told)  # type: ignore[arg-type]
        if frame is not None:
            noted.append(frame)
        return frame

    joint._sealed = note  # type: ignore[method-assign]
    return noted


def inject(rig: Rig, frame: bytes) -> None:
    """Bring a frame of the link to the chip from above, by ISO-TP; the flow control is the attacker's guess."""
    sender = Sender(frame, FD)
    while not sender.is_done:
        if sender.awaits_flow:
            sender.on_flow(b"\x30\x00\x00")
        data = CanData(packed_identifier(Priority.BLOCK, TUNNEL, 251), sender.next_frame())
        rig.chip.on_frame(Side.UPPER, *data, rig.world.now_us)


@pytest.mark.parametrize(("sealed", "epoch"), [(True, EPOCH), (True, LARGE), (False, LARGE)])
def test_a_chip_between_two_is_as_without_keys_and_under_any_epoch(
    library: ctypes.CDLL, image: bytes, keys: Path, sealed: bool, epoch: int
) -> None:
    rig = Rig(library, image, below=True, epoch=epoch, keys=keys if sealed else None)
    assert rig.tube is not None
    rig.world.run(65.0)
    rig.base.endpoint.mail.command(Command(CHIP, 5, "take_survey", {}), rig.world.now)
    rig.world.run(6.0)
    now = rig.world.now
    states = rig.heard(NodeState)
    assert len(states) > 50
    state = states[-1]
    assert not state.flags & UNFIT
    assert state.epoch == epoch
    assert state.mode in (NodeMode.SURVEY, NodeMode.STILL)
    assert abs(wrapped(state.yaw - 1.0 - OFFSET)) < 3e-3
    assert abs(state.at - now) < 1.5
    (survey, *_) = rig.heard(SurveyMeasurement)
    assert survey.epoch == epoch
    assert abs(wrapped(survey.yaw - 1.0 - OFFSET)) < 3e-3
    codes = [event.code for event in rig.heard(Event)]
    assert codes[:2] == ["stopped", "booted"]
    assert "seal_refused" not in codes
    assert rig.tube.endpoint.place.hops == 2
    assert rig.tube.endpoint.clock.epoch == epoch
    assert abs(rig.tube.endpoint.clock.rig_from_local(now) - now) < 15e-3
    aiding = next(m for m in reversed(rig.tube.heard) if isinstance(m, Aiding))
    assert (aiding.yaw, aiding.yaw_var, aiding.epoch, aiding.hops) == (1.0, 1e-8, epoch, 1)  # to the bit
    assert aiding.offset == pytest.approx(OFFSET - 0.4, abs=1e-9)
    assert len(aiding.seal) == (9 if sealed else 0)

    events = [Event(BELOW, k, 12.0 + k, Severity.ERROR, "bad_sample", {"k": k}, epoch) for k in range(1, 9)]
    for event in events:
        rig.tube.endpoint.mail.submit(event, now)
    below = NodeState(BELOW, now, 2, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, (0.0, 0.0, 0.0), 0.0, 0.0, 1e-7, 0.5, 1e-9,
                      NodeFlag.NONE, 5, 0, epoch=epoch)  # fmt: skip
    orders = [Command(tube, 40 + tube, "take_survey", {}) for tube in (CHIP, BELOW)]
    for order in orders:
        rig.base.endpoint.mail.command(order, now)
    rig.world.run(12.0)
    rig.tube.endpoint.send_state(below, rig.world.now)
    rig.world.run(3.0)
    assert {m.sequence: m for m in rig.base.heard if isinstance(m, Event) and m.tube == BELOW} == {
        m.sequence: m for m in events
    }
    assert rig.tube.endpoint.mail.outbox_size == 0
    assert [m for m in rig.base.heard if isinstance(m, NodeState) and m.tube == BELOW] == [below]
    assert {m.sequence for m in rig.tube.heard if isinstance(m, Command)} == {40 + BELOW}
    assert [(m.sequence, m.done) for m in rig.heard(Reply)] == [(5, True), (40 + CHIP, True)]
    numbered = {m.sequence for m in rig.base.heard if isinstance(m, Event | SurveyMeasurement) and m.tube == CHIP}
    assert sorted(numbered) == list(range(1, rig.chip.number(NEXT_NUMBER)))
    assert refused(rig).keys() <= {"duplicate", "late", "before_joined"}
    if sealed:
        for endpoint in (rig.base.endpoint, rig.tube.endpoint):
            assert endpoint.seals is not None
            assert endpoint.seals.failures().keys() <= {"seal_end_old_session"}  # sealed before a session was offered


def test_what_is_forged_on_a_joint_has_no_effect_and_is_told_by_name(
    library: ctypes.CDLL, image: bytes, keys: Path
) -> None:
    """Each attacker writes frames to the chip from above: none is believed, and the base is told."""
    rig = Rig(library, image, keys=keys)
    noted = frames_to_chip(rig)
    rig.world.run(10.0)
    before = refused(rig)
    assert not before.keys() - {"late", "duplicate", "before_joined"}
    exchanges = rig.chip.number(EXCHANGES)
    frame = noted[-1]
    assert len(frame) > HEAD.size + TAG_SIZE
    for bit in range(8 * TAG_SIZE):  # every byte of a tag is compared
        changed = bytearray(frame)
        changed[len(frame) - TAG_SIZE + bit // 8] ^= 1 << bit % 8
        inject(rig, bytes(changed))
    assert refused(rig)["wrong_tag"] == 8 * TAG_SIZE
    inject(rig, noted[10])  # an old number of this very session
    assert refused(rig)["repeated"] == 1
    generation = bytearray(frame)
    generation[1] += 1
    inject(rig, bytes(generation))
    assert refused(rig)["wrong_tag"] == 8 * TAG_SIZE + 1
    foreign = bytearray(frame)
    foreign[4] = BELOW
    inject(rig, bytes(foreign))
    assert refused(rig)["wrong_joint"] == 1
    native = CanData(packed_identifier(Priority.AIDING, 1, 251, 31), bytes(32))
    rig.chip.on_frame(Side.UPPER, *native, rig.world.now_us)
    inject(rig, frame[HEAD.size : -TAG_SIZE])
    assert refused(rig)["unsealed"] == 2
    assert rig.chip.number(EXCHANGES) == exchanges
    rig.world.run(3.0)
    told = [event for event in rig.heard(Event) if event.code == "seal_refused"]
    total = 8 * TAG_SIZE + 1 + 1 + 1 + 2
    assert [event.arguments for event in told] == [{"refused": total, "mostly": "wrong_tag"}]
    assert not rig.heard(NodeState)[-1].flags & NodeFlag.CLOCK_UNSYNCHRONISED


def test_keys_of_another_rig_or_generation_join_nothing(library: ctypes.CDLL, image: bytes, keys: Path) -> None:
    """Neighbours with other secrets, and one with a generation that the chip has not got."""
    rig = Rig(library, image, keys=keys)
    for number in (1, 2):
        others = JointSeal(CHIP + 1, lambda number=number: ring_of(CHIP + 1, number), lambda: 99)  # type: ignore[misc]
        for frame in others.own_frames(1.0):
            inject(rig, frame)
    assert refused(rig) == {"wrong_tag": 2}
    rig.world.run(3.0)
    assert rig.base.endpoint.clock.synchronised


def test_a_start_after_a_power_cut_takes_a_new_session_and_nothing_of_the_old_one(
    library: ctypes.CDLL, image: bytes, keys: Path
) -> None:
    rig = Rig(library, image, keys=keys)
    noted = frames_to_chip(rig)
    rig.world.run(8.0)
    recorded = noted[-3:]
    rig.world.now_us += 2_000_000
    rig.chip.begin(rig.world.now_us)
    for frame in recorded:
        inject(rig, frame)
    rig.world.run(8.0)
    exchanges = rig.chip.number(EXCHANGES)
    for frame in recorded:
        inject(rig, frame)
    assert refused(rig)["old_session"] == len(recorded)
    assert rig.chip.number(EXCHANGES) == exchanges
    restored = [event for event in rig.heard(Event) if event.code == "restored"]
    assert len(restored) == 1
    states = [s for s in rig.heard(NodeState) if not s.flags & UNFIT]
    assert states
    numbered = {m.sequence for m in rig.base.heard if isinstance(m, Event | SurveyMeasurement) and m.tube == CHIP}
    assert sorted(numbered) == list(range(1, rig.chip.number(NEXT_NUMBER)))


@pytest.mark.parametrize("seed", range(2))
def test_frames_that_are_lost_lose_no_sealed_message(library: ctypes.CDLL, image: bytes, keys: Path, seed: int) -> None:
    rig, random = Rig(library, image, below=True, keys=keys), np.random.default_rng(seed)
    rig.world.lose = lambda: bool(random.random() < 0.05)
    rig.world.run(70.0)
    rig.world.lose = lambda: False
    rig.world.run(15.0)
    numbered = {m.sequence for m in rig.base.heard if isinstance(m, Event | SurveyMeasurement) and m.tube == CHIP}
    assert sorted(numbered) == list(range(1, rig.chip.number(NEXT_NUMBER)))
    assert len(numbered) >= 4
    assert not rig.heard(NodeState)[-1].flags & UNFIT


def test_an_order_older_than_what_is_remembered_is_not_obeyed_again(
    library: ctypes.CDLL, image: bytes, keys: Path
) -> None:
    rig = Rig(library, image, keys=keys)
    rig.world.run(6.0)
    for number in range(50, 57):
        rig.base.endpoint.mail.command(Command(CHIP, number, "reboot", {}), rig.world.now)
        rig.world.run(1.5)
    assert [reply.sequence for reply in rig.heard(Reply)] == list(range(50, 57))
    rig.base.endpoint.mail.command(Command(CHIP, 51, "take_survey", {}), rig.world.now)
    rig.base.endpoint.mail.command(Command(CHIP, 56, "take_survey", {}), rig.world.now)
    rig.world.run(3.0)
    assert [reply.sequence for reply in rig.heard(Reply)] == [*range(50, 57), 56]
    assert refused(rig)["end_old_order"] >= 1


def test_a_stolen_neighbour_orders_nothing(library: ctypes.CDLL, image: bytes, keys: Path) -> None:
    """It has the keys of the joint, and not those of the base: an order in no seal, a changed one, one of its own."""
    rig = Rig(library, image, keys=keys)
    rig.world.run(6.0)
    assert rig.base.endpoint.seals is not None
    base = rig.base.endpoint.seals.base
    assert base is not None
    orders = [encode_message(Command(CHIP, number, "reboot", {})) for number in range(60, 63)]
    sealed = bytearray(base.close(orders[1], CHIP) or b"")
    sealed[20] ^= 1
    theirs = close_payload(SealKey(bytes(16)), DOWN, orders[2], Pair(1, 2), 1, 1, CHIP)
    for payload in (orders[0], bytes(sealed), theirs):
        rig.base.endpoint._links[Side.LOWER].send_reliable(payload)
    rig.world.run(3.0)
    assert rig.chip.number(ANSWERED) == 0  # the base drops answers to what it did not order
    assert {name: count for name, count in refused(rig).items() if name.startswith("end")} == {
        "end_unsealed": 1,
        "end_wrong_tag": 2,
    }


def test_a_page_of_another_tubes_keys_is_not_begun_with(library: ctypes.CDLL, image: bytes, keys: Path) -> None:
    page = pack_key_page(read_ring(key_file(keys, BELOW), BELOW))
    library.shim_page(page, len(page))
    with pytest.raises(AssertionError):
        ChipNode(library, image, SETTINGS)
    library.shim_page(b"", 0)
    ChipNode(library, image, SETTINGS)
