"""Mail and seals of both ends over links that note what they are given: what is believed, kept and repeated."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from noted_links import LOWER, STATUS, NotedLink, mail
from test_endpoint import survey
from test_which_key import Ends, Held, lots

from telemetry.application.end_seal import (
    MARK,
    OFFERS_KEPT,
    OVERHEAD,
    BaseEnd,
    SealFinding,
    SealingEnd,
    content_of_sealed,
    is_sealed,
)
from telemetry.application.endpoint import Endpoint
from telemetry.messages import (
    BASE,
    BlockSegment,
    Command,
    Event,
    Receipt,
    Reply,
    SessionOffer,
    Severity,
)
from telemetry.presentation.content import content_of_message
from telemetry.presentation.msgpack_codec import encode_message, open_payload
from telemetry.schema import MessageKind

# mail


def test_a_reply_is_kept_and_told_again_and_a_repeated_order_is_not_obeyed_again() -> None:
    up = NotedLink()
    box = mail(7, up, None)
    order, reply = Command(7, 12, "take_survey"), Reply(7, 12, True, "done")
    payload = encode_message(order)
    assert box.open_from_base(open_payload(payload), payload, 1.0) == order
    box.reply(reply)
    assert up.taken() == [("reliable", encode_message(reply), "SURVEY")]
    for _ in range(2):
        assert box.open_from_base(open_payload(payload), payload, 2.0) is None
        assert up.taken() == [("reliable", encode_message(reply), "SURVEY")]
    other = encode_message(Command(7, 13, "take_survey"))
    assert box.open_from_base(open_payload(other), other, 2.0) is not None
    box.send_status(STATUS)
    assert up.taken() == [("reliable", encode_message(STATUS), "SURVEY")]


def test_what_is_held_leaves_once_it_is_released_and_is_forgotten_on_its_own_receipt() -> None:
    up = NotedLink()
    box = mail(7, up, None)
    for _ in range(2):
        box.hold()
        box.submit(survey(7, 1), 5.0)
        box.send_due(6.0)
        assert up.taken() == []
        box.release(6.0)
        assert up.taken() == [("reliable", encode_message(survey(7, 1)), "SURVEY")]
        box.release(6.0)
        assert up.taken() == []
        for content, left in ((bytes(8), 1), (content_of_message(survey(7, 1)), 0)):
            receipt = encode_message(Receipt(7, 1, content))
            assert box.open_from_base(open_payload(receipt), receipt, 7.0) is None
            assert box.outbox_size == left
    assert box._counters["foreign_receipts"] == 2


def test_a_warning_goes_at_once_and_the_rest_with_states_or_alone_in_time() -> None:
    up = NotedLink()
    box = mail(7, up, None)
    info, warning = (Event(7, n, 1.0, level, "x") for n, level in ((1, Severity.INFO), (2, Severity.WARNING)))
    box.submit(info, 10.0)  # no states go up from here
    assert len(up.taken()) == 1
    box.has_states = True
    box.submit(survey(7, 3), 12.0)
    box.submit(warning, 12.0)
    assert up.taken() == [("reliable", encode_message(warning), "SURVEY")]
    box.send_due(13.1499)
    assert [row for row in up.taken() if row[1] == encode_message(survey(7, 3))] == []
    box.send_due(13.1501)
    assert ("reliable", encode_message(survey(7, 3)), "SURVEY") in up.taken()
    box.submit(survey(7, 4), 15.0)
    up.taken()
    box.go_with_states(15.5)
    assert up.taken() == [("reliable", encode_message(survey(7, 4)), "SURVEY")]


def test_an_order_is_repeated_until_its_tube_answers_and_no_other() -> None:
    down = NotedLink()
    box = mail(BASE, None, down)
    order = Command(7, 12, "take_survey")
    box.command(order, 0.0)
    assert down.taken() == [("reliable", encode_message(order), "COMMAND")]
    for tube, counts in ((6, False), (7, True), (7, False)):
        answer = encode_message(Reply(tube, 12, True, ""))
        assert (box.open_from_tube(open_payload(answer), answer, 1.0) is not None) == counts
        assert len(box._orders) == (0 if tube == 7 else 1)
    box.command(order, 0.0)
    box.withdraw(12)
    down.taken()
    box.send_due(1000.0)
    assert down.taken() == []
    box.acknowledge(survey(7, 5))
    assert down.taken() == [
        ("reliable", encode_message(Receipt(7, 5, content_of_message(survey(7, 5)))), "COMMAND")
    ]  # fmt: skip
    nowhere = mail(3, None, None)
    nowhere.send_status(STATUS)
    nowhere.acknowledge(survey(7, 5))
    assert nowhere._counters["nowhere_to_go"] == 2


class NotedSeals:
    """Seals that believe what a test says, and note what they were asked."""

    def __init__(self) -> None:
        self.believes, self.is_new, self.of, self.begins = True, True, True, False
        self.asked: list[Any] = []

    def is_told(self, payload: bytes, now: float, *, is_offer: bool) -> bool:
        self.asked.append((payload, now, is_offer))
        return self.believes

    def is_of(self, message: Any, tube: int) -> bool:
        self.asked.append(("of", tube))
        return self.of

    def is_order_new(self, number: int, too_old: int) -> bool:
        self.asked.append(("new", number, too_old))
        return self.is_new

    def close_up(self, payload: bytes) -> bytes:
        return b"up" + payload

    def close_down(self, payload: bytes, tube: int) -> bytes | None:
        return None if tube == 99 else b"down%d" % tube + payload

    def hear(self, payload: bytes, tube: int, now: float) -> Any:
        self.asked.append((payload, tube, now))
        return SimpleNamespace(is_believed=self.believes, begins_session=self.begins)

    def due_offers(self) -> list[tuple[int, bytes]]:
        return [(5, b"offer of 5"), (4, b"offer of 4")]


@pytest.mark.parametrize(
    ("message", "is_offer"),
    [(Command(7, 12, "take_survey"), False), (SessionOffer(7), True), (Receipt(7, 1, bytes(8)), False)],
)
def test_what_the_base_says_is_looked_at_as_what_it_is(message: Any, is_offer: bool) -> None:
    seals, up = NotedSeals(), NotedLink()
    box = mail(7, up, None, seals)
    payload = encode_message(message)
    box._answers._of_session.extend([1, 2])
    box._answers.too_old = 2
    kept = survey(7, 3)
    box._outbox.keep_payload(3, encode_message(kept), 1e9)
    found = box.open_from_base(open_payload(payload), b"sealed", 5.0)
    assert seals.asked[:2] == [(b"sealed", 5.0, is_offer), ("of", 7)]
    assert (found is not None) == isinstance(message, Command)
    assert seals.asked[2:] == ([("new", 12, 2)] if isinstance(message, Command) else [])
    assert up.taken() == ([("reliable", b"up" + encode_message(kept), "SURVEY")] if is_offer else [])
    assert box._answers.too_old == (0 if is_offer else 2)
    for change in ({"believes": False}, {"of": False}, {"is_new": False}):
        refusing = NotedSeals()
        vars(refusing).update(change)
        if isinstance(message, Command):
            other = mail(7, NotedLink(), None, refusing)
            assert other.open_from_base(open_payload(payload), b"sealed", 5.0) is None


def test_what_a_tube_says_counts_where_its_seal_does_and_a_session_hastens_orders() -> None:
    seals, down = NotedSeals(), NotedLink()
    box = mail(BASE, None, down, seals)
    order = Command(5, 12, "take_survey")
    box.command(order, 0.0)
    assert down.taken() == [("reliable", b"down5" + encode_message(order), "COMMAND")]
    payload = encode_message(survey(5, 1))
    assert box.open_from_tube(open_payload(payload), b"sealed", 3.0) == survey(5, 1)
    assert seals.asked == [(b"sealed", 5, 3.0), ("of", 5)]
    offers = [("best", b"offer of %d" % tube, (MessageKind.SESSION_OFFER, tube), "COMMAND") for tube in (5, 4)]
    assert down.taken() == offers
    box.send_due(3.0)
    assert down.taken() == []
    seals.begins = True
    box.open_from_tube(open_payload(payload), b"sealed", 4.0)
    down.taken()
    box.send_due(4.0)
    assert len(down.taken()) == 1
    for change in ("believes", "of"):
        setattr(seals, change, False)
        assert box.open_from_tube(open_payload(payload), b"sealed", 5.0) is None
        setattr(seals, change, True)
    box._send_down(b"x", 99, None)  # type: ignore[arg-type]
    assert [row for row in down.taken() if row[0] == "reliable"] == []  # it waits for its session


# seals of the ends


def test_a_state_is_newer_than_the_one_before_and_the_first_may_be_of_cycle_none() -> None:
    for _ in range(2):
        ends = Ends((1,), (1,))
        ends.meet()
        found = [ends.base.is_next_state(1, cycles) for cycles in (0, 0, 1, 1, 3, 2, 3, 4)]
        assert found == [True, False, True, False, True, False, False, True]
        assert ends.base.counters["seal_end_repeated"] == 4
    assert not ends.base.is_next_state(2, 5)  # who has no session says nothing


def test_another_session_counts_cycles_anew() -> None:
    base, lot = BaseEnd(Held(BASE, 1), lots()), lots()
    for start in range(2):
        tube = SealingEnd(1, Held(1, 1), lot)
        base.open(tube.close(b"hello"), 1, 20.0 * start)
        ((_, offer),) = base.due_offers(lambda tube: b"offer")
        assert tube.open(offer, 20.0 * start, is_offer=True)
        assert base.open(tube.close(b"first"), 1, 20.0 * start) is SealFinding.BEGINS
        assert base.is_next_state(1, 0)


def test_an_offer_is_taken_once_and_no_message_stands_for_one() -> None:
    ends = Ends((1,), (1,))
    ends.base.open(ends.tube.close(b"hello"), 1, 0.0)
    ((_, offer),) = ends.base.due_offers(lambda tube: b"offer")
    before = ends.tube._pair
    assert not ends.tube.open(offer, 0.1, is_offer=False)  # it names another base: only an offer may
    assert ends.tube._pair == before
    assert ends.tube.open(offer, 0.1, is_offer=True)
    assert not ends.tube.open(offer, 0.2, is_offer=True)
    assert ends.tube._pair.tube != before.tube
    assert ends.base.open(ends.tube.close(b"first"), 1, 0.2) is SealFinding.BEGINS
    order = ends.base.close(b"order", 1)
    assert order is not None
    assert not ends.tube.open(order, 0.3, is_offer=True)  # nor is a message of the session an offer
    assert ends.tube.open(order, 0.3, is_offer=False)


def test_what_names_a_session_is_proof_of_it_only_with_a_number_drawn_anew() -> None:
    ends = Ends((1,), (1,))
    ends.base.open(ends.tube.close(b"hello"), 1, 0.0)
    ((_, offer),) = ends.base.due_offers(lambda tube: b"offer")
    named = ends.tube._pair
    ends.tube.open(offer, 0.1, is_offer=True)
    taken = ends.tube._pair
    for pair, finding in (
        (named._replace(base=taken.base), SealFinding.NOTHING), (taken._replace(base=1), SealFinding.NOTHING),
        (taken, SealFinding.BEGINS), (taken, SealFinding.BELIEVED),
    ):  # fmt: skip
        ends.tube._pair = pair
        assert ends.base.open(ends.tube.close(b"word"), 1, 0.2) is finding


@pytest.mark.parametrize(("later", "counted"), [(9.999, 0), (10.0, 0), (10.001, 3)])
def test_what_was_sealed_for_a_session_counts_as_old_once_it_was_not_proven_in_time(later: float, counted: int) -> None:
    base = BaseEnd(Held(BASE, 1), lots())
    tube = SealingEnd(1, Held(1, 1), lots())
    for at in (5.0, 5.2, 5.4):
        base.open(tube.close(b"hello"), 1, at)
    base.count_unproven(5.0 + later)
    assert base.counters["seal_end_old_session"] == counted
    assert len(base._offers.get(1, [])) == (counted == 0)


def test_a_full_list_of_offers_counts_what_it_drops_and_keeps_the_others() -> None:
    base, lot = BaseEnd(Held(BASE, 1), lots()), lots()
    for start in range(OFFERS_KEPT + 2):
        tube = SealingEnd(1, Held(1, 1), lot)
        for _ in range(start + 1):
            base.open(tube.close(b"hello"), 1, 0.01 * start)
    assert base.counters["seal_end_old_session"] == 1 + 2
    assert [offer.unproven for offer in base._offers[1]] == list(range(3, OFFERS_KEPT + 3))


@pytest.mark.parametrize(("size", "sealed"), [(OVERHEAD, False), (OVERHEAD + 1, True)])
def test_what_is_sealed_is_longer_than_its_head_and_begins_with_its_mark(size: int, sealed: bool) -> None:
    assert OVERHEAD == 1 + 1 + 1 + 8 + 8 + 8
    assert is_sealed(bytes([MARK]) * size) == sealed
    assert not is_sealed(bytes([MARK ^ 1]) + bytes([MARK]) * size)
    found = SealingEnd(1, Held(1, 1), lots())
    assert not found.open(bytes([MARK]) * size, 0.0, is_offer=False)
    assert found.counters == {"seal_end_wrong_tag" if sealed else "seal_end_unsealed": 1}


def test_the_base_counts_what_is_no_sealed_word_and_knows_the_newest_keys_of_a_tube_in_session() -> None:
    ends = Ends((1, 2), (1, 2))
    assert ends.base.newest_of(1) is None
    ends.meet()
    assert (ends.base.newest_of(1), ends.base.newest_of(2)) == (2, None)
    for payload in (b"plain", bytes([MARK]) * 60, b"plain"):
        assert ends.base.open(payload, 1, 1.0) is SealFinding.NOTHING
    assert ends.base.counters["seal_end_unsealed"] == 2
    assert ends.base.counters["seal_end_wrong_tag"] == 1
    word = ends.tube.close(b"a survey")
    assert (content_of_sealed(word), content_of_sealed(b"a survey")) == (b"a survey", b"a survey")


@pytest.mark.parametrize(
    ("address", "boots", "first"), [(7, 1, 1), (7, 2, (2 << 24) + 1), (7, 5, (5 << 24) + 1), (BASE, 5, 1)]
)
def test_a_start_that_lost_its_numbers_counts_in_a_series_of_its_own(address: int, boots: int, first: int) -> None:
    made = Endpoint(address, frozenset({LOWER}), boot_count=boots).mail
    assert [made.series.take(), made.series.take()] == [first, first + 1]


def test_a_segment_goes_down_to_its_tube_behind_everything_else() -> None:
    down = NotedLink()
    segment = BlockSegment(7, 3, 1, bytes(32), 2, 1, b"part", bytes(32))
    mail(BASE, None, down, NotedSeals()).send_segment(segment)
    assert down.taken() == [("reliable", b"down7" + encode_message(segment), "BLOCK")]
