"""Seals: what is forged, repeated or meant for another has no effect and is counted; what is honest arrives."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest
from attacks import ARRIVED, END_ATTACKS, END_TO_END, JOINT_ATTACKS, ON_A_JOINT, PAGE, cell, name_of, outcomes
from hypothesis import given
from hypothesis import strategies as st
from sealed_string import NOW, SealedString, aiding, make_folder, messages_in, survey

from borechain.pki.rig_keys import read_secret
from telemetry.application.depth_seal import open_depth, seal_depth
from telemetry.application.end_seal import HEAD as END_HEAD
from telemetry.application.end_seal import OVERHEAD as END_OVERHEAD
from telemetry.application.measurement_seal import MeasurementSeal
from telemetry.application.seal_watch import SealWatch
from telemetry.application.seals import Keys, Seals
from telemetry.frozen import replace
from telemetry.media.credentials import DEPTH_SOURCE
from telemetry.messages import BASE, ENCODER, DepthReading, Event, Severity, Side
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.schema import MessageKind
from telemetry.transport.hop import MAX_FRAME
from telemetry.transport.joint_seal import HEAD, JointSeal
from telemetry.transport.key_ring import Generation, KeyRing, key_file, read_ring
from telemetry.transport.seal import TAG_SIZE, WINDOW, ReplayWindow, SealKey


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_folder(tmp_path_factory.mktemp("keys") / "stick")


def page_rows(name: str) -> dict[str, list[str]]:
    """Rows of a table of the page, by their first cell."""
    part = PAGE.read_text().partition(f"<!-- {name} -->")[2].partition(f"<!-- end {name} -->")[0]
    rows = [
        [c.strip() for c in line.strip().strip("|").split("|")] for line in part.splitlines() if line.startswith("|")
    ]
    return {row[0]: row[1:] for row in rows}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ON_A_JOINT, ids=name_of)
def test_no_attack_on_a_joint_has_an_effect_and_each_is_counted(folder: Path, kind: MessageKind) -> None:
    found = outcomes(folder, kind, JOINT_ATTACKS)
    assert not any(outcome.had_effect for outcome in found.values()), found
    assert all(outcome.counted or not outcome.tried for outcome in found.values()), found
    assert page_rows("joint")[name_of(kind)] == [cell(outcome) for outcome in found.values()]


@pytest.mark.slow
@pytest.mark.parametrize("kind", END_TO_END, ids=name_of)
def test_no_attack_of_a_stolen_relay_has_an_effect(folder: Path, kind: MessageKind) -> None:
    found = outcomes(folder, kind, END_ATTACKS)
    assert not any(outcome.had_effect for outcome in found.values()), found
    silent = {name for name, outcome in found.items() if not outcome.counted}
    assert silent <= {"same session", "64 later"}  # known by its number, as what a link repeats
    assert page_rows("between")[name_of(kind)] == [cell(outcome) for outcome in found.values()]


def test_the_page_shows_every_kind_and_every_attack() -> None:
    assert list(page_rows("joint")) == ["message", "---", *map(name_of, ON_A_JOINT)]
    assert page_rows("joint")["message"] == list(JOINT_ATTACKS)
    assert list(page_rows("between")) == ["message", "---", *map(name_of, END_TO_END)]
    assert page_rows("between")["message"] == list(END_ATTACKS)
    assert set(ON_A_JOINT) == set(MessageKind) - {MessageKind.DEPTH_READING}  # on no joint; tested below


def test_what_is_honest_arrives_under_seals_and_nothing_is_counted(folder: Path) -> None:
    string = SealedString(folder)
    string.settle()
    for kind in ON_A_JOINT:
        string.say(kind)
        string.run(1.0)
    string.run(12.0)
    assert string.counts() == {}
    kinds = {type(message).__name__ for message in string.heard[BASE]}
    assert kinds == {"SurveyMeasurement", "Event", "StaticRecord", "NodeState", "Reply", "BlockStatus"}
    assert string.endpoints[1].mail.outbox_size == 0
    assert string.endpoints[1].place.hops == 2


@pytest.mark.slow
def test_restarts_of_everybody_cost_no_survey_and_count_as_no_attack(folder: Path) -> None:
    string = SealedString(folder)
    string.settle()
    string.talking = True
    for address in (BASE, 2, ENCODER, 1, BASE):
        string.say(MessageKind.SURVEY_MEASUREMENT)
        string.start(address)
        string.run(20.0)
    assert string.endpoints[1].mail.outbox_size == 0
    assert string.counts() == {}


def test_orders_that_wait_for_a_session_are_obeyed_once(folder: Path) -> None:
    string = SealedString(folder)
    string.say(MessageKind.COMMAND)
    string.settle()
    string.start(1)
    string.say(MessageKind.COMMAND)
    string.settle()
    assert [type(m).__name__ for m in string.heard[1]].count("Command") == 2
    assert [type(m).__name__ for m in string.heard[BASE]].count("Reply") == 2


@pytest.mark.parametrize("byte", range(TAG_SIZE))
def test_each_byte_of_a_tag_counts(folder: Path, byte: int) -> None:
    string = SealedString(folder)
    string.settle()
    string.say(MessageKind.NODE_STATE)
    string.run(1.0)
    (frame,) = string.frames_with(MessageKind.NODE_STATE)[-1:]
    (payload,) = [p for kind, p in messages_in(frame) if kind is MessageKind.NODE_STATE]
    base = string.seals(BASE)
    for bit in range(8):
        for place, judge in (
            (len(frame) - TAG_SIZE + byte, lambda f: base.joints[Side.LOWER].open(f, string.now)),
            (END_HEAD.size + byte, lambda f: base.hear(f, 1, string.now).is_believed or None),
        ):
            whole = frame if place >= len(frame) - TAG_SIZE else payload
            flipped = bytearray(whole)
            flipped[place] ^= 1 << bit
            assert judge(bytes(flipped)) is None
    assert base.counters()["seal_wrong_tag"] == base.counters()["seal_end_wrong_tag"] == 8


def forgeries(folder: Path, count: int) -> int:
    """Random tags on a frame, a payload, a measurement and a depth; how many of ``count`` each were believed."""
    string = SealedString(folder)
    string.settle()
    string.say(MessageKind.SURVEY_MEASUREMENT)
    string.run(ARRIVED)
    base, tube = string.seals(BASE), string.seals(1)
    frame = string.frames_with(MessageKind.SURVEY_MEASUREMENT)[-1]
    (payload,) = [p for kind, p in messages_in(frame) if kind is MessageKind.SURVEY_MEASUREMENT]
    reading = seal_depth(
        read_ring(key_file(folder, DEPTH_SOURCE), DEPTH_SOURCE), encode_message(DepthReading(9, 1.0, 2.0, ()))
    )
    measured = aiding(10**6, string.now)
    believed = 0
    for number in range(count):
        tag = string.random.randbytes(TAG_SIZE)
        body = frame[: -TAG_SIZE - 1] + number.to_bytes(1, "little") if number < 256 else frame[:-TAG_SIZE]
        believed += base.joints[Side.LOWER].open(body + tag, string.now) is not None
        believed += base.hear(payload[: END_HEAD.size] + tag + payload[END_OVERHEAD:], 1, string.now).is_believed
        believed += base.depth_content(reading[: END_HEAD.size] + tag + reading[END_OVERHEAD:]) is not None
        believed += tube.measurement.admits(replace(measured, seal=b"\x01" + tag), 1, string.now)
    return believed


@pytest.mark.slow
def test_no_random_tag_is_believed(folder: Path) -> None:
    assert forgeries(folder, 2_000) == 0


@pytest.mark.statistical
@pytest.mark.timeout(1800)
def test_no_random_tag_of_a_million_is_believed(folder: Path) -> None:
    assert forgeries(folder, 1_000_000) == 0


@pytest.mark.slow
@given(st.lists(st.integers(0, 300), max_size=400))
def test_a_window_admits_each_number_once_and_none_far_behind(numbers: list[int]) -> None:
    window, admitted, largest = ReplayWindow(), set(), -1
    for number in numbers:
        expected = number not in admitted and number > largest - WINDOW
        assert window.admit(number) == expected
        if expected:
            admitted.add(number)
            largest = max(largest, number)


def test_a_tag_is_that_of_the_standard() -> None:
    """Source: NIST SP 800-38B, appendix D.1, examples 1 to 3."""
    key = SealKey(bytes.fromhex("2b7e151628aed2a6abf7158809cf4f3c"))
    message = bytes.fromhex("6bc1bee22e409f96e93d7e117393172aae2d8a571e03ac9c9eb76fac45af8e5130c81c46a35ce411")
    assert key.tag().hex() == "bb1d6929e9593728"
    assert key.tag(message[:16]).hex() == "070a16b46b4d4144"
    assert key.tag(message[:7], message[7:]).hex() == "dfa66747de9ae630"


class Thief:
    """A stolen tube 2, with its keys and no others, that writes wherever it likes."""

    def __init__(self, string: SealedString) -> None:
        self.string = string
        self.keys = Keys(key_file(string.folder, 2), 2)
        self.ring = self.keys.ring

    def frame_as(self, sender: int, addressee: int, session: int) -> bytes | None:
        """Frame in another's name, under whatever joint key the thief has for the addressee."""
        key = self.ring.seal_key(1, "joint", addressee)
        assert key is not None
        body = HEAD.pack(1, 1, 1, sender, addressee, 7, session, 1) + b"x"
        return body + key.tag(body)


def test_a_stolen_tube_speaks_for_no_other(folder: Path) -> None:
    string = SealedString(folder)
    string.settle()
    thief = Thief(string)
    assert thief.ring.seal_key(1, "end", 1) is None
    assert thief.ring.seal_key(1, "end", 2) is not None
    for victim, side, named in ((1, Side.UPPER, ENCODER), (BASE, Side.LOWER, ENCODER), (ENCODER, Side.UPPER, BASE)):
        joint = string.seals(victim).joints[side]
        assert joint.open(thief.frame_as(named, victim, joint._session) or b"", string.now) is None
        assert joint.counters["seal_wrong_tag"] == 1
    content = encode_message(survey(1, 99))
    under_own_name = string.seals(2).close_up(content)
    (believed,) = {string.seals(BASE).hear(under_own_name, 1, string.now).is_believed}
    assert not believed
    # in an envelope of its own it names the other inside
    assert not string.seals(BASE).is_of(survey(1, 99), 2)
    assert string.counts()["seal_end_spliced"] == 1


@pytest.mark.slow
def test_a_revoked_tube_is_believed_nothing(tmp_path: Path) -> None:
    from borechain.pki.rig_keys import revoke_tube

    folder = make_folder(tmp_path / "stick")
    string = SealedString(folder)
    string.settle()
    heard = len(string.heard[BASE])
    old = Keys(key_file(folder, 2), 2)
    revoke_tube(folder, 2, NOW)
    assert not key_file(folder, 2).parent.joinpath("tube-2.keys").exists()
    string.run(3.0)  # the others read their new files
    string.endpoints[2].seals = Seals(old, 2, Side)  # it starts anew with its old ones
    string.say(MessageKind.NODE_STATE)
    string.endpoints[2].mail.submit(survey(2, 50), string.now)
    string.run(10.0)
    assert len(string.heard[BASE]) == heard
    assert all(n is None for n in (string.endpoints[ENCODER].place.neighbours[Side.LOWER],))
    assert string.counts()["seal_wrong_tag"] > 0


@pytest.mark.slow
def test_keys_rotated_on_a_string_that_works_cost_no_message(tmp_path: Path) -> None:
    """Base and encoder get the new keys at once, tube 2 later, tube 1 not at all."""
    from borechain.pki.rig_keys import rotate_keys

    folder = make_folder(tmp_path / "stick")
    string = SealedString(folder)
    string.settle()
    before = key_file(folder, 1).read_text(), key_file(folder, 2).read_text()
    rotate_keys(folder, datetime.datetime.now(datetime.UTC))
    after = key_file(folder, 2).read_text()
    for tube, text in ((1, before[0]), (2, before[1])):
        key_file(folder, tube).write_text(text)
    for number in range(4):
        string.say(MessageKind.SURVEY_MEASUREMENT)
        string.say(MessageKind.COMMAND)
        string.run(4.0)
        if number == 1:
            key_file(folder, 2).write_text(after)
    assert string.seals(BASE).ring.newest == string.seals(2).ring.newest == 2
    assert string.seals(1).ring.newest == 1
    names = [type(message).__name__ for message in string.heard[BASE]]
    assert (names.count("SurveyMeasurement"), names.count("Reply")) == (4, 4)
    assert string.counts() == {}
    assert read_secret(folder).generations[0].retires_at is not None


def test_a_measurement_that_is_forged_or_old_is_refused(folder: Path) -> None:
    ring = Keys(key_file(folder, ENCODER), ENCODER).current
    encoder, tube = MeasurementSeal(ring), MeasurementSeal(Keys(key_file(folder, 1), 1).current)
    sealed = encoder.close(aiding(5, 100.0))
    assert tube.admits(replace(sealed, offset=1.0, hops=3, systematic_var=1.0, torsion_var=2.0), 1, 100.1)
    assert tube.admits(sealed, 1, 100.2)  # the same measurement again
    changes = ({"yaw": 2.0}, {"yaw_var": 1e-7}, {"rate": 0.2}, {"valid_at": 100.05}, {"sequence": 6}, {"torque": 1.0})
    for change in (*changes, {"under_torque": True}, {"epoch": 2}, {"seal": b""}):
        assert not tube.admits(replace(sealed, **change), 1, 100.2)  # type: ignore[arg-type]
    assert not tube.admits(encoder.close(aiding(4, 100.1)), 1, 100.2)
    assert not tube.admits(encoder.close(aiding(6, 90.0)), 1, 100.2)
    assert not MeasurementSeal(Keys(key_file(folder, 1), 1).current).admits(sealed, 1, 200.0)  # after its restart
    assert tube.counters["seal_measurement_repeated"] == 2


def test_a_depth_is_believed_under_its_own_key_alone(folder: Path) -> None:
    base = SealedString(folder).seals(BASE)
    payload = encode_message(DepthReading(3, 1.0, 2.0, ()))
    source = read_ring(key_file(folder, DEPTH_SOURCE), DEPTH_SOURCE)
    sealed = seal_depth(source, payload)
    assert base.depth_content(sealed) == payload
    assert base.depth_content(payload) is None
    assert base.depth_content(sealed[:-1]) is None
    assert open_depth(lambda: Keys(key_file(folder, 1), 1).ring, sealed) is None
    assert [base.is_next_depth(number) for number in (3, 3, 2, 4)] == [True, False, False, True]
    counts = base.failures()
    assert (counts["seal_depth_unsealed"], counts["seal_depth_wrong_tag"]) == (1, 1)
    assert counts["seal_depth_repeated"] == 2


@given(st.binary(max_size=200))
def test_whatever_comes_at_a_sealed_end_has_no_effect(frame: bytes) -> None:
    joint = JointSeal(1, lambda: RING, lambda: 5)
    assert joint.open(frame, 1.0) is None
    assert sum(joint.counters.values()) == 1
    assert joint.partner is None


def test_the_crew_is_told_at_most_once_a_minute(folder: Path) -> None:
    string = SealedString(folder)
    told: list[dict[str, object]] = []
    watch = SealWatch(string.endpoints[1], lambda severity, code, arguments: told.append(dict(arguments)))
    for number in range(200):
        string.inject((1, Side.UPPER), b"forged" * 10)
        watch.look(100.0 + number)
    assert len(told) == 4
    assert told[0] == {"refused": 1, "mostly": "unsealed"}
    assert told[-1]["refused"] == 181


def test_an_order_of_frames_as_large_as_can_be_is_sealed(folder: Path) -> None:
    string = SealedString(folder)
    string.settle()
    for number in range(40):
        string.endpoints[1].mail.submit(
            Event(1, 100 + number, 1.0, Severity.INFO, "x", {"text": "y" * 200, "z": number}), string.now
        )
    string.run(3.0)
    assert string.endpoints[1].mail.outbox_size == 0
    assert max(len(frame) for frame in string.wire[BASE, Side.LOWER]) <= MAX_FRAME


def test_an_unsealed_neighbour_and_a_sealed_one_do_not_meet(folder: Path) -> None:
    string = SealedString(folder)
    string.endpoints[1].seals = None
    string.run(5.0)
    assert string.endpoints[1].place.neighbours[Side.UPPER] is None
    assert string.endpoints[2].place.neighbours[Side.LOWER] is None
    assert string.counts_of(2)["seal_unsealed"] > 0


RING = KeyRing("rig-1", 1, (Generation(1, {}, NOW),))
