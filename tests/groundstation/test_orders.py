"""Orders on a string in memory: their course, their numbers, what is refused before anything is sent."""

from pathlib import Path
from typing import Any

import pytest
from memory_rig import Rig

from groundstation.config import GroundConfig
from groundstation.errors import SelectorError
from groundstation.service.orders.order_book import KEPT, OrderBook, OrderState, SentOrder
from groundstation.service.process.ground_process import GroundProcess
from groundstation.service.process.operator_access import ANSWERED_WITHIN, OPEN_AT_MOST
from telemetry.application.commands import find_command
from telemetry.messages import BASE
from telemetry.parameters import ParameterBlock, SensorParameters

BLOCK = ParameterBlock(1, 1, SensorParameters(bias=(1e-3, 0.0, 0.0)))


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    it = Rig(tmp_path, [2, 1])
    it.run(12.0)
    return it


def test_an_order_to_a_silent_tube_holds_no_other_up_and_is_obeyed_once_it_is_back(rig: Rig) -> None:
    rig.part(2, 1)  # tube 1 hangs in the hole, and nothing reaches it
    silent = rig.ground.operator.command(1, "take_survey")
    assert rig.order(2, "parameters").state is OrderState.DONE
    rig.run(60.0)
    assert (silent.state, silent.done) == (OrderState.SENT, None)
    rig.join(2, 1)
    rig.run(70.0, lambda: silent.answered)
    assert (silent.state, silent.detail) == (OrderState.DONE, "at the next settled cycle")


def test_orders_to_a_silent_tube_are_bounded_and_withdrawn_in_the_end(rig: Rig) -> None:
    rig.part(2, 1)
    operator = rig.ground.operator
    orders = [operator.command(1, "take_survey") for _ in range(OPEN_AT_MOST)]
    with pytest.raises(SelectorError, match=f"tube 1: expected at most {OPEN_AT_MOST} orders without an answer"):
        operator.command(1, "take_survey")
    assert rig.order(2, "parameters").state is OrderState.DONE
    operator.expire_orders(rig.ground.model.string.time.now + ANSWERED_WITHIN + 60.0)
    assert {order.state for order in orders} == {OrderState.FAILED}
    rig.join(2, 1)
    rig.run(70.0)
    assert {order.state for order in orders} == {OrderState.FAILED}


def test_numbers_are_not_used_again_after_a_restart(rig: Rig) -> None:
    before = [rig.order(2, "parameters").number, rig.ground.operator.command(1, "take_survey").number]
    rig.start(BASE)
    rig.run(3.0)
    after = [rig.order(2, "parameters").number, rig.order(1, "parameters").number]
    assert len({*before, *after}) == 4


def test_numbers_are_not_used_again_by_a_fresh_database(rig: Rig) -> None:
    before = {rig.order(2, "parameters").number for _ in range(3)}
    rig.ground.store.close()
    for file in (rig.folder / str(BASE)).glob("ground.sqlite*"):
        file.unlink()
    rig.processes[BASE] = rig.build(BASE)
    rig.run(8.0)
    order = rig.order(2, "take_survey")
    assert order.number not in before
    assert order.detail == "at the next settled cycle"  # obeyed, and not the kept answer to another order


def test_an_upload_is_sent_acknowledged_and_done(rig: Rig) -> None:
    seen: list[tuple[OrderState, str]] = []
    order = rig.ground.operator.upload(BLOCK, by="anna")

    def watch() -> bool:
        if not seen or seen[-1][0] is not order.state:
            seen.append((order.state, order.detail))
        return order.ended

    rig.run(60.0, watch)
    assert [state for state, _ in seen] == [OrderState.SENT, OrderState.ACKNOWLEDGED, OrderState.DONE]
    assert order.values == {"phase": "applied", "version": 1, "sha256": BLOCK.sha256().hex()}
    view = rig.ground.operator.ask(f"orders/{order.number}")
    assert (view["by"], view["arguments"], view["values"]) == ("anna", {"version": 1}, order.values)


def test_an_upload_that_another_overtakes_fails(rig: Rig) -> None:
    first = rig.ground.operator.upload(BLOCK)
    second = rig.ground.operator.upload(ParameterBlock(1, 2, BLOCK.gyroscope))
    rig.run(60.0, lambda: second.ended)
    assert (first.state, first.detail) == (OrderState.FAILED, f"order {second.number} uploads another block")
    assert second.state is OrderState.DONE


def test_a_record_goes_on_after_the_answer_and_is_done_when_it_is_stored(rig: Rig) -> None:
    order = rig.order(1, "static_record", seconds=5.0)
    assert (order.state, order.done) == (OrderState.ACKNOWLEDGED, True)
    rig.run(20.0, lambda: order.ended)
    (record,) = rig.ground.operator.ask("static_records")["static_records"]
    assert (order.state, record["order"]) == (OrderState.DONE, order.number)


def test_what_a_calibration_asks_for_are_orders_too(rig: Rig) -> None:
    begun = rig.ground.operator.order("recalibrate", {"action": "begin", "tubes": "1"}, "anna")
    assert (begun.tube, begun.state, begun.arguments) == (None, OrderState.DONE, {"tubes": (1,)})
    assert rig.ground.operator.reply_of(begun)["state"] == "collecting"
    rig.run(5.0)
    (asked,) = [order for order in rig.ground.model.orders if order.by == "recalibration"]
    assert (asked.spec.name, asked.tube, asked.state) == ("parameters", 1, OrderState.DONE)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tube", "name", "arguments", "named"),
    [
        (1, "dance", {}, "take_survey|static_record"),
        (3, "take_survey", {}, "tube 3: not in the string; expected one of 2, 1"),
        (1, "take_survey", {"seconds": 5.0}, "got seconds"),
        (1, "static_record", {}, "seconds=.., got none"),
        (1, "static_record", {"seconds": 4.0}, r"seconds: expected a number in \[5, 3600\], got 4.0"),
        (1, "static_record", {"seconds": "60"}, r"seconds: expected a number in \[5, 3600\], got '60'"),
        (1, "static_record", {"seconds": True}, "seconds: expected a number"),
        (1, "align", {"method": 3}, "method: expected at most"),
        (1, "recalibrate", {}, "action=begin"),
    ],
)
def test_a_wrong_order_is_refused_before_anything_is_sent(
    rig: Rig, tube: int, name: str, arguments: dict[str, Any], named: str
) -> None:
    with pytest.raises(SelectorError, match=named):
        rig.ground.operator.command(tube, name, arguments)
    assert not rig.ground.operator.has_pending
    assert not list(rig.ground.model.orders)


def test_an_operator_writes_degrees_and_seconds_and_the_tube_gets_si(rig: Rig) -> None:
    order = rig.ground.operator.order("align", {"tube": "2", "method": "extremes", "turns": "3"})
    assert order.arguments == {"method": "extremes", "turns": 3.0}
    order = rig.ground.operator.order("static_record", {"tube": "2", "seconds": "60", "by": "anna"})
    assert order.arguments == {"seconds": 60.0}


def test_a_tube_that_is_heard_and_hangs_nowhere_may_be_asked_after_those_that_hang(rig: Rig) -> None:
    """A tube that was taken out of the string still answers on the bench."""
    string = rig.ground.model.string
    string.tally.remove(2)
    assert string.tubes == [1]
    assert rig.ground.operator.command(2, "take_survey").tube == 2
    with pytest.raises(SelectorError, match=r"^tube 3: not in the string; expected one of 1, 2$"):
        rig.ground.operator.command(3, "take_survey")


def test_a_ground_station_that_knows_no_tube_says_so(tmp_path: Path) -> None:
    ground = GroundProcess(GroundConfig(folder=tmp_path))
    with pytest.raises(SelectorError, match="tube 1: not in the string; no tube has reported yet"):
        ground.operator.command(1, "take_survey")
    ground.close()


def test_the_oldest_orders_that_ended_make_room_and_those_that_have_not_stay() -> None:
    book = OrderBook()
    for number in range(KEPT + 20):
        book.add(SentOrder(number, find_command("take_survey"), 1, {}, "anna", 0.0, ""))
        if number % 2:
            book.finish(number)
    kept = [order.number for order in book]
    assert len(kept) == KEPT
    assert kept[:3] == [0, 2, 4]
