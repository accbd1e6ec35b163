"""Orders in C beside those of Python, which change the float64 record and are learnt by the step after: every word.

The oracle is ``node.firmware.tube`` with the kernel in integers; the C works on a copy of its record.
"""

import math
from collections.abc import Callable

import numpy as np
import pytest
from chip_tools import needs_gcc
from orders_in_c import FIXED, WORK_SPACE, OrdersInC, aligned, differing, record_of
from test_every_event import FAST, SLOW, Bench, held, known

from node.firmware.event_table import EVENT_TABLE, take_events
from node.kernels.record.events import Code
from node.kernels.record.node_record import EVENTS_KEPT

METHODS = {"circle": 1, "extremes": 2, "spiral": 7}
pytestmark = [needs_gcc, pytest.mark.slow]


@pytest.fixture(scope="module")
def orders(tmp_path_factory: pytest.TempPathFactory) -> OrdersInC:
    return OrdersInC(tmp_path_factory.mktemp("orders"))


BENCHES: dict[str, Callable[[], Bench]] = {
    "new": lambda: Bench(FIXED),
    "learning": lambda: Bench(FIXED).cycles(20),
    "at rest": lambda: known(FIXED),
    "aligned": aligned,
    "just stopped": lambda: known(FIXED).cycles(30, FAST).cycles(1),
    "turning": lambda: known(FIXED).cycles(30, FAST),
    "slow": lambda: known(FIXED).cycles(30, SLOW),
    "faulty": lambda: known(FIXED).cycles(90, 0.0, held),
}

OLD_SUMS = ".aligner.sweeps"  # of the alignment before, cleared as the next one begins; floats round them


def go_on(bench: Bench, state: str) -> None:
    """A cycle more as it is."""
    rate = {"turning": FAST, "slow": SLOW}.get(state, 0.0)
    if state == "faulty":
        bench.cycles(1, rate, held)
    else:
        bench.cycles(1, rate)


@pytest.mark.parametrize("state", BENCHES)
def test_orders_of_an_alignment_are_those_of_python(state: str, orders: OrdersInC) -> None:
    answers: set[int] = set()
    bench = BENCHES[state]()
    for method, number in METHODS.items():
        for turns in (0.5, 20.5, 1.0, 2.25, 20.0):
            mine = record_of(bench)
            answer = orders.call("order_alignment", mine, number, round(turns * (1 << 24)))
            assert (answer == 0) == (bench.tube.align(method, turns) == ""), (method, turns, answer)
            found = differing(mine, record_of(bench))
            assert not [path for path in found if not path.startswith(OLD_SUMS)], (method, turns)
            answers.add(answer)
            go_on(bench, state)
    assert (0 in answers) == (6 in answers) == (state in ("at rest", "aligned", "just stopped", "slow")), answers


@pytest.mark.parametrize("state", BENCHES)
def test_orders_of_a_static_record_are_those_of_python(state: str, orders: OrdersInC) -> None:
    bench, answers = BENCHES[state](), set()
    for command, seconds in enumerate((4.75, 5.0, 60.5, 3600.0, 3600.25), 1):
        mine = record_of(bench)
        answer = orders.call("order_record", mine, round(seconds * (1 << 28)), command)
        assert (answer == 0) == (bench.tube.start_record(seconds, command) == ""), (seconds, answer)
        assert differing(mine, record_of(bench)) == {}, seconds
        go_on(bench, state)
        answers.add(answer)
    assert 1 in answers


def test_a_survey_that_is_wanted_again_is_taken_again(orders: OrdersInC) -> None:
    bench = known(FIXED).cycles(20, FAST).cycles(60)
    mine = record_of(bench)
    assert mine[0]["filter"]["surveyed"] == 1
    assert orders.call("order_survey", mine) == 0
    bench.tube.take_survey()
    assert mine[0]["filter"]["surveyed"] == record_of(bench)[0]["filter"]["surveyed"] == 0
    assert {path.partition("[")[0] for path in differing(mine, record_of(bench))} <= WORK_SPACE


@pytest.mark.parametrize("told", [0, 1, 5, EVENTS_KEPT, EVENTS_KEPT + 9])
def test_events_are_those_that_python_takes(told: int, orders: OrdersInC) -> None:
    bench = known(FIXED)
    list(take_events(bench.tube.node["events"]))
    mine, random, events = record_of(bench), np.random.default_rng(told), bench.tube.node["events"]
    codes = random.integers(16, 27, told)  # of the status, whose numbers may be any
    own = mine[0]["events"]
    own["said"] = own["told"]
    for code in codes:
        slot, numbers = int(own["told"]) % EVENTS_KEPT, random.integers(-(1 << 40), 1 << 40, 10)
        own["ring"][slot]["code"], own["ring"][slot]["numbers"] = code, numbers
        events["ring"][slot]["code"], events["ring"][slot]["numbers"] = code, numbers * 2.0**-24
        own["told"] += 1
        events["told"] += 1
    expected = [name for name, _, _ in take_events(events)]
    taken, numbers = [], np.zeros(10, np.int64)
    while code := orders.call("next_event", mine, numbers):
        taken.append(EVENT_TABLE[Code(code)].name)
        slot = (int(own["said"]) - 1) % EVENTS_KEPT
        assert np.array_equal(numbers * 2.0**-24, events["ring"][slot]["numbers"])
    assert taken == expected
    assert len(taken) == min(told, EVENTS_KEPT)
    assert own["said"] == own["told"] == events["said"]
    assert not math.isnan(float(numbers.sum()))
