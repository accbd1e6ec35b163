"""A chip's node on this machine, in told time, between endpoints of the product: what it says, keeps and passes on."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import pytest
from chip_in_process import (
    EXCHANGES,
    KEPT_BYTES,
    NEXT_NUMBER,
    OVERFLOWS,
    WRONG_ABOVE,
    WRONG_BELOW,
    PowerFailedError,
    wrapped,
)
from chip_rig import BELOW, CHIP, EPOCH, OFFSET, SETTINGS, Rig
from needed_programs import needs_gcc
from one_node import node_of
from recorded_calls import leaves
from rough_node import RoughNode

from node.firmware.event_table import EVENT_TABLE
from node.firmware.event_words import arguments_in_c
from node.firmware.saved_state import pack_state_slot, resume_node, unpack_state_slot
from node.kernels.record.filter_record import default_config
from node.kernels.record.integer_node import FIXED_CONFIG, FIXED_NODE, new_integers
from node.kernels.step.fixed_node import FixedNode
from node.kernels.step.shadow_words import learn_node
from telemetry.messages import (
    Aiding,
    Command,
    Event,
    NodeFlag,
    NodeState,
    Receipt,
    Reply,
    Side,
    SurveyMeasurement,
    TimeReply,
)
from telemetry.presentation.content import content_of_message
from telemetry.presentation.msgpack_codec import encode_message

pytestmark = [needs_gcc, pytest.mark.slow]


def test_the_table_of_events_has_every_code_and_its_arguments() -> None:
    for code, spec in EVENT_TABLE.items():
        said = arguments_in_c(spec)
        assert [a.name for a in said] == [name for name, _ in spec.arguments] or spec.words is not None, code
        assert len(said) <= 10


def test_a_chip_at_rest_finds_its_yaw_and_tells_of_it(library: ctypes.CDLL, image: bytes) -> None:
    rig = Rig(library, image)
    rig.world.run(65.0)
    rig.base.endpoint.mail.command(Command(CHIP, 5, "take_survey", {}), rig.world.now)
    rig.world.run(6.0)
    states = rig.heard(NodeState)
    assert len(states) > 55
    last = states[-1]
    assert abs(wrapped(last.yaw - 1.0 - OFFSET)) < 1e-3
    assert last.flags == NodeFlag.NONE
    assert (last.hops, last.epoch) == (1, EPOCH)
    assert abs(last.at - rig.world.now) < 2.0
    codes = [event.code for event in rig.heard(Event)]
    assert codes[:2] == ["stopped", "booted"]
    assert "bias_known" in codes
    (survey,) = rig.heard(SurveyMeasurement)
    assert abs(wrapped(survey.yaw - 1.0 - OFFSET)) < 1e-3
    assert survey.imus[0].force[1] == pytest.approx(0.34, abs=2e-3)
    assert survey.imus[0].force[2] == pytest.approx(-9.8, abs=2e-3)
    assert survey.systematic_var == pytest.approx(1e-6 + SETTINGS.mount_std**2, rel=0.15)  # in levels from above
    assert survey.imus[0].force_cov[0][0] == pytest.approx(9e-6 / survey.samples, rel=0.6)
    assert [rig.chip.number(k) for k in (WRONG_ABOVE, WRONG_BELOW, OVERFLOWS)] == [0, 0, 0]
    assert rig.chip.number(EXCHANGES) > 30


def test_orders_are_obeyed_once_and_refused_by_name(library: ctypes.CDLL, image: bytes) -> None:
    rig = Rig(library, image)
    rig.world.run(65.0)
    surveys = len(rig.heard(SurveyMeasurement))
    for number, name, arguments in (
        (7, "take_survey", {}),
        (8, "align", {"method": "circle", "turns": 50.0}),
        (9, "align", {"method": "spiral", "turns": 2.0}),
        (10, "reboot", {}),
    ):
        rig.base.endpoint.mail.command(Command(CHIP, number, name, arguments), rig.world.now)
    rig.world.run(12.0)
    replies = {reply.sequence: reply for reply in rig.heard(Reply)}
    assert sorted(replies) == [7, 8, 9, 10]
    assert replies[7] == Reply(CHIP, 7, True, "at the next settled cycle")
    assert (replies[8].done, replies[8].detail) == (False, "expected a number in its range")
    assert not replies[9].done
    assert replies[10].detail == "expected take_survey or align: a chip obeys no other order"
    assert len(rig.heard(SurveyMeasurement)) == surveys + 1
    rig.base.endpoint.mail.command(Command(CHIP, 7, "take_survey", {}), rig.world.now)
    rig.world.run(12.0)
    assert len(rig.heard(SurveyMeasurement)) == surveys + 1  # a repeated order is answered, not obeyed again


def test_what_is_for_others_goes_on_and_comes_back_unchanged(library: ctypes.CDLL, image: bytes) -> None:
    rig = Rig(library, image, below=True)
    assert rig.tube is not None
    rig.world.run(6.0)
    now = rig.world.now
    assert rig.tube.endpoint.place.hops == 2
    assert abs(rig.tube.endpoint.clock.rig_from_local(now) - now) < 12e-3  # two steps of time
    assert rig.tube.endpoint.clock.variance(now) < (20e-3) ** 2
    aiding = next(m for m in reversed(rig.tube.heard) if isinstance(m, Aiding))
    assert abs(wrapped(aiding.yaw - 1.0)) < 1e-6
    assert aiding.hops == 1
    assert aiding.offset == pytest.approx(OFFSET - 0.4, abs=1e-6)
    assert aiding.systematic_var == pytest.approx(2e-6, rel=0.15)  # of both joints, in levels of 0.5 dB
    events = [Event(BELOW, k, 12.0 + k, EVENT_TABLE[1].severity, "bad_sample", {"k": k}, EPOCH) for k in range(1, 13)]
    for event in events:
        rig.tube.endpoint.mail.submit(event, now)
    for k in range(3):
        rig.base.endpoint.mail.command(Command(BELOW, 40 + k, "align", {"method": "circle", "turns": 2.0}), now)
    rig.world.run(25.0)
    heard = [m for m in rig.base.heard if isinstance(m, Event) and m.tube == BELOW]
    assert {m.sequence: m for m in heard} == {m.sequence: m for m in events}
    assert rig.tube.endpoint.mail.outbox_size == 0  # receipts went down
    ordered = {m.sequence for m in rig.tube.heard if isinstance(m, Command)}  # again, for this tube answers none
    assert ordered == {40, 41, 42}


def test_what_is_for_one_hop_is_not_passed_on_as_a_payload(library: ctypes.CDLL, image: bytes) -> None:
    """An aiding whose epoch no signal can say comes by ISO-TP: below the chip it would be the yaw of another joint."""
    rig = Rig(library, image, below=True)
    assert rig.tube is not None
    rig.world.run(3.0)
    rig.tube.heard.clear()
    rig.world.after_cycle = lambda now: None
    for k in range(10):
        aiding = Aiding(2.0, 1e-8, 0.0, 0.0, 0.0, rig.world.now, 100 + k, 0, epoch=1 << 20)
        rig.base.endpoint.send_aiding(aiding, rig.world.now)
        link = rig.base.endpoint._links[Side.LOWER]
        link.send_reliable(encode_message(aiding))
        link.send_reliable(encode_message(TimeReply(1.0, 2.0, 3.0, 4.0, 1.0, 1e-6, 1 << 20)))
        up = rig.tube.endpoint._links[Side.UPPER]
        up.send_reliable(encode_message(aiding))
        rig.world.run(1.0)
    assert not [m for m in (*rig.tube.heard, *rig.base.heard) if isinstance(m, Aiding)]
    assert abs(rig.tube.endpoint.clock.rig_from_local(rig.world.now) - rig.world.now) < 12e-3


@pytest.mark.parametrize("seed", range(3))
def test_frames_that_are_lost_lose_no_message(library: ctypes.CDLL, image: bytes, seed: int) -> None:
    rig, random = Rig(library, image, below=True), np.random.default_rng(seed)
    rig.world.lose = lambda: bool(random.random() < 0.15)
    rig.world.run(75.0)
    rig.world.lose = lambda: False
    rig.world.run(15.0)
    numbered = {m.sequence for m in rig.base.heard if isinstance(m, Event | SurveyMeasurement) and m.tube == CHIP}
    assert sorted(numbered) == list(range(1, rig.chip.number(NEXT_NUMBER)))
    assert len(numbered) >= 4


@pytest.mark.parametrize("words", [0, 1, 5, 300, 1000, -2, -1, None])
def test_a_cut_while_it_saves_loses_nothing_and_gives_no_number_twice(
    library: ctypes.CDLL, image: bytes, words: int | None
) -> None:
    """After so many words of flash, or so many before the end of the save, which is that of an order's answer."""
    rig = Rig(library, image)
    rig.world.run(62.0)
    all_words = 1 + (rig.chip.number(KEPT_BYTES) + 7) // 8 + 2  # an erasure, the content, its header
    words = all_words if words is None else words % all_words
    before = rig.chip.number(NEXT_NUMBER)
    rig.base.endpoint.mail.command(Command(CHIP, 9, "take_survey", {}), rig.world.now)
    rig.chip.power_fails_after(words)
    try:
        rig.world.run(4.0)
    except PowerFailedError:
        rig.world.now_us += 3_000_000
        rig.chip.begin(rig.world.now_us)
    rig.chip.power_fails_after(-1)
    rig.world.run(20.0)
    events = {event.sequence: event for event in rig.heard(Event)}
    restored = [event for event in events.values() if event.code == "restored"]
    assert len(restored) == 1
    assert restored[0].sequence >= before
    assert abs(wrapped(math.radians(float(restored[0].arguments["yaw_deg"])) - 1.0 - OFFSET)) < 2e-3
    assert [reply.sequence for reply in rig.heard(Reply)][:1] == [9]
    kept = [m for m in rig.base.heard if isinstance(m, Event | SurveyMeasurement) and m.tube == CHIP]
    by_number = {m.sequence: m for m in kept}
    assert all(by_number[m.sequence] == m for m in kept)
    assert sorted(by_number) == list(range(1, rig.chip.number(NEXT_NUMBER)))
    states = [s for s in rig.heard(NodeState) if not s.flags & (NodeFlag.YAW_UNTRUSTED | NodeFlag.CLOCK_UNSYNCHRONISED)]
    assert all(abs(wrapped(s.yaw - 1.0 - OFFSET)) < 3e-3 for s in states)
    assert states[-1].flags == NodeFlag.RESTORED


def test_a_worn_flash_is_told_and_ends_nothing(library: ctypes.CDLL, image: bytes) -> None:
    rig = Rig(library, image)
    rig.world.run(4.0)
    library.shim_wear(1)
    rig.world.motion = lambda at: 0.5
    rig.world.run(8.0)
    library.shim_wear(0)
    assert "started" in [event.code for event in rig.heard(Event)]
    assert rig.heard(NodeState)[-1].flags & NodeFlag.NOT_SAVED
    rig.world.run(40.0)
    assert not rig.heard(NodeState)[-1].flags & NodeFlag.NOT_SAVED  # it is tried again


def test_a_receipt_of_other_content_forgets_nothing(library: ctypes.CDLL, image: bytes) -> None:
    rig = Rig(library, image)
    rig._receipted = _Everything()
    rig.world.run(8.0)
    (first, *_) = [event for event in rig.heard(Event) if event.sequence == 1]
    wrong = Receipt(CHIP, 1, bytes(reversed(content_of_message(first))))
    rig.base.endpoint.mail._send_down(encode_message(wrong), CHIP, 3)  # type: ignore[arg-type]
    count = sum(event.sequence == 1 for event in rig.heard(Event))
    rig.world.run(15.0)
    assert sum(event.sequence == 1 for event in rig.heard(Event)) > count  # it is sent again
    rig.base.endpoint.mail.acknowledge(first)
    rig.world.run(3.0)
    count = sum(event.sequence == 1 for event in rig.heard(Event))
    rig.world.run(40.0)
    assert sum(event.sequence == 1 for event in rig.heard(Event)) == count


class _Everything(set[int]):
    """As if all were receipted: the base sends no receipt by itself."""

    def __contains__(self, _: object) -> bool:
        return True


WORK_SPACE = ("filter.gain", "filter.ph", "filter.rest", "filter.decay", "filter.overflows", "guard.found", ".m")


@pytest.mark.parametrize("cycles", [5, 150, 470, 640])
def test_a_start_from_a_save_is_that_of_python(library: ctypes.CDLL, cycles: int) -> None:
    """Word by word, but for what floats round and for work space; at rest, turning, aligning, with faults."""
    node, rough = FixedNode(), RoughNode(1, np.random.default_rng(cycles))
    nodes, settings, parameters = node_of(1, 2, np.random.default_rng(cycles))
    for k in range(cycles):
        node.step(nodes, settings, parameters, *rough.step(k))
        node.aiding(nodes, settings, rough.aiding(k))
    ours = bytearray(node._integers["node"].tobytes())
    kept = np.frombuffer(ours, FIXED_NODE)
    for record in (kept[0], nodes[0]):
        record["twist"]["wound"], record["mount"]["aligning"], record["joints"]["solved"] = 0, 1, 1
    configs = default_config()
    nodes = unpack_state_slot(pack_state_slot(nodes, b"", 1)).nodes
    resume_node(nodes, configs)
    integers = new_integers()
    learn_node(nodes, settings, integers)
    given = np.frombuffer(bytearray(integers["node"][0]["config"].tobytes()), FIXED_CONFIG)
    library.shim_resume(kept.ctypes.data_as(ctypes.c_void_p), given.ctypes.data_as(ctypes.c_void_p))
    theirs = integers["node"].tobytes()
    differ = {}
    for path, at, size in leaves(FIXED_NODE):
        a, b = (int.from_bytes(of[at : at + size], "little", signed=True) for of in (bytes(ours), theirs))
        is_near = abs(a - b) <= abs(b) >> 48
        if not is_near and not any(name in path for name in WORK_SPACE):
            differ[path] = (a, b)
    assert differ == {}
