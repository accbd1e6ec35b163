"""The stepper's end of a bus, on a bus in memory: who is there, what goes where, and what belongs to no process."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from typing import Any

import pytest

from sim.rig.bus_stepper import BusStepper
from sim.rig.stepper import Acted, FrameEvent
from telemetry import keys
from telemetry.messages import BASE, ENCODER, Side
from telemetry.runtime.marked_frames import UNMARKED, mark_frame
from telemetry.runtime.stepped import Done, Due, DueEvent, Sent, pack_done, unpack_step

RIG = "rig-7"
ADDRESSES = {"encoder": ENCODER, "base": BASE}


def address_of(name: str) -> int:
    return ADDRESSES[name] if name in ADDRESSES else int(name)


class Publisher:
    def __init__(self, put: Callable[[bytes], None]) -> None:
        self.put = put


class MemoryBus:
    """Keys in memory: what was put on each, in order, and who is told what comes on one."""

    def __init__(self) -> None:
        self.said: list[tuple[str, bytes]] = []
        self.listeners: dict[str, Callable[[str, Any], None]] = {}
        self.answer: Callable[[str, bytes], None] = lambda _key, _payload: None

    def publisher(self, key: str) -> Publisher:
        def put(payload: bytes) -> None:
            self.said.append((key, payload))
            self.answer(key, payload)

        return Publisher(put)

    def subscribe(self, key: str, hear: Callable[[str, Any], None]) -> None:
        self.listeners[key] = hear

    subscribe_at_once = liveliness_subscribe = subscribe

    def tell(self, template: str, payload: Any, **places: str) -> None:
        """Say something on a key of a template, as a process of the rig or a stranger would."""
        any_of = template.format(rig=RIG, **{name: places.get(f"{name}_is", "*") for name in _names(template)})
        self.listeners[any_of](template.format(rig=RIG, **places), payload)


def _names(template: str) -> set[str]:
    return {part.partition("}")[0] for part in template.split("{")[1:]} - {"rig"}


class Rig:
    """A stepper and processes that answer each step with what ``frames`` says of them."""

    def __init__(self, **options: Any) -> None:
        self.bus = MemoryBus()
        self.stepper = BusStepper(self.bus, RIG, hang_limit=0.05, **options)  # type: ignore[arg-type]
        self.frames: dict[str, list[tuple[Side, bytes]]] = defaultdict(list)
        self.steps: dict[str, list[Any]] = defaultdict(list)
        self.silent: set[str] = set()
        self.foreign = 0
        self.bus.answer = self.answer

    def answer(self, key: str, payload: bytes) -> None:
        parts = key.split("/")
        if parts[2] != "stepper":
            return
        name = parts[3]
        number, events = unpack_step(payload)
        self.steps[name].append((number, events))
        if name in self.silent:
            return
        for side, frame in self.frames[name]:
            self.send(name, side, frame)
        sent = [Sent(side, 5.0 + k, mark_frame(frame)) for k, (side, frame) in enumerate(self.frames[name])]
        self.done(name, pack_done(Done(number, sent, 7.5, self.foreign)))

    def send(self, name: str, side: Side, frame: bytes) -> None:
        self.bus.tell(keys.PORT, frame, tube=name, side=side.name.lower(), direction="tx", direction_is="tx")

    def done(self, name: str, payload: bytes) -> None:
        self.bus.tell(keys.DONE, payload, process=name)

    def token(self, name: str, *, alive: bool) -> None:
        self.bus.tell(keys.LIVELINESS, alive, process=name)

    def join(self, *names: str) -> None:
        for name in names:
            self.token(name, alive=True)
        for name in names:
            assert self.stepper.wait_for(address_of(name), alive=True, timeout=0.0)


TIMER: list[FrameEvent] = [(DueEvent(Due.TIMER, 1.0), b"")]


def test_who_has_a_token_is_there_in_the_order_of_addresses_until_it_goes() -> None:
    rig = Rig()
    rig.join("base", "12", "encoder", "3")
    assert rig.stepper.alive() == [ENCODER, 3, 12, BASE]
    assert not rig.stepper.wait_for(4, alive=True, timeout=0.0)
    rig.token("12", alive=False)
    assert rig.stepper.wait_for(12, alive=False, timeout=0.0)
    rig.token("stranger", alive=True)
    rig.token("300", alive=True)
    assert not rig.stepper.wait_for(4, alive=True, timeout=0.01)
    assert rig.stepper.alive() == [ENCODER, 3, BASE]


def test_a_step_is_numbered_for_each_process_and_frames_go_before_it_with_their_marks() -> None:
    rig = Rig()
    rig.join("2", "5")
    events: list[FrameEvent] = [
        (DueEvent(Due.UPPER_FRAME, 1.0), b"from above"),
        (DueEvent(Due.LOWER_FRAME, 1.5, -3.0), b"from below"),
        (DueEvent(Due.CYCLE, 2.0, [1.0, 2.0]), b""),
    ]
    answers = rig.stepper.round({5: TIMER, 2: events, 9: TIMER})
    assert list(answers) == [2, 5]  # 9 is not there
    assert answers[2].frames == []
    assert answers[2].wake_at == 7.5
    assert [key for key, _ in rig.bus.said] == [
        f"borechain/{RIG}/port/2/upper/rx",
        f"borechain/{RIG}/port/2/lower/rx",
        f"borechain/{RIG}/stepper/2/step",
        f"borechain/{RIG}/stepper/5/step",
    ]
    assert [payload for _, payload in rig.bus.said[:2]] == [b"from above", b"from below"]
    ((number, told),) = rig.steps["2"]
    assert number == 1
    assert [(event.kind, event.at, event.data) for event in told] == [
        (Due.UPPER_FRAME, 1.0, None), (Due.LOWER_FRAME, 1.5, -3.0), (Due.CYCLE, 2.0, [1.0, 2.0]),
    ]  # fmt: skip
    assert [event.mark for event in told] == [mark_frame(b"from above"), mark_frame(b"from below"), UNMARKED]
    rig.stepper.round({2: TIMER})
    rig.stepper.round({2: TIMER, 5: TIMER})
    assert [number for number, _ in rig.steps["2"]] == [1, 2, 3]
    assert [number for number, _ in rig.steps["5"]] == [1, 2]


def test_a_depth_is_shown_to_watchers_and_handed_over_in_the_step_alone() -> None:
    rig = Rig()
    rig.join("base")
    rig.stepper.round({BASE: [(DueEvent(Due.DEPTH, 3.0, b"reading"), b"")]})
    assert rig.bus.said[0] == (f"borechain/{RIG}/surface/depth", b"reading")
    assert [key for key, _ in rig.bus.said[1:]] == [f"borechain/{RIG}/stepper/base/step"]
    assert rig.steps["base"][0][1] == [DueEvent(Due.DEPTH, 3.0, b"reading", UNMARKED)]


def test_an_answer_has_the_frames_of_both_ends_in_the_order_in_which_they_were_sent() -> None:
    rig = Rig()
    rig.join("2")
    rig.frames["2"] = [(Side.LOWER, b"a"), (Side.UPPER, b"b"), (Side.LOWER, b"c"), (Side.LOWER, b"a")]
    frames = rig.stepper.round({2: TIMER})[2].frames
    assert frames == [
        (Sent(Side.LOWER, 5.0), b"a"), (Sent(Side.UPPER, 6.0), b"b"), (Sent(Side.LOWER, 7.0), b"c"),
        (Sent(Side.LOWER, 8.0), b"a"),
    ]  # fmt: skip
    assert rig.stepper.foreign == 0


@pytest.mark.parametrize("rounds", [1, 3])
def test_frames_answers_and_cues_of_strangers_are_counted_and_change_nothing(rounds: int) -> None:
    rig = Rig()
    rig.join("2")
    rig.frames["2"] = [(Side.UPPER, b"mine")]
    for k in range(rounds):
        rig.send("2", Side.UPPER, b"stranger's")  # before those of the step, and at the other end after all
        rig.send("2", Side.LOWER, b"stranger's")
        rig.done("2", b"\xc1 no answer")
        rig.done("2", pack_done(Done(k, [], 0.0)))  # of the step before: late, and no stranger's
        rig.bus.tell(keys.CUE, b"nonsense of someone")
        assert rig.stepper.round({2: TIMER})[2].frames == [(Sent(Side.UPPER, 5.0), b"mine")]
    assert rig.stepper.foreign == 4 * rounds
    rig.foreign = 9  # that the process itself has dropped: a sum of its own, so not added up again
    rig.stepper.round({2: TIMER})
    rig.stepper.round({2: TIMER})
    assert rig.stepper.foreign == 4 * rounds + 9


def test_one_that_does_not_answer_is_dropped_once_and_the_others_have_answered() -> None:
    rig = Rig()
    rig.join("1", "2", "3")
    rig.silent = {"1", "3"}
    assert list(rig.stepper.round({1: TIMER, 2: TIMER, 3: TIMER})) == [2]
    assert rig.stepper.alive() == [2]
    assert rig.stepper.drain_hung() == [1, 3]
    assert rig.stepper.drain_hung() == []
    rig.done("1", pack_done(Done(1, [], 3.0)))  # too late: it is not there any more
    rig.token("1", alive=True)
    assert rig.stepper.wait_for(1, alive=True, timeout=0.0)
    rig.silent = set()
    assert rig.stepper.round({1: TIMER})[1].wake_at == 7.5
    assert [number for number, _ in rig.steps["1"]] == [1, 2]


def test_one_that_dies_in_a_step_is_missing_at_once_and_leaves_nothing_to_its_next_life() -> None:
    rig = Rig()
    rig.join("1", "2")
    rig.silent = {"1"}
    answer = rig.bus.answer

    def die(key: str, payload: bytes) -> None:
        answer(key, payload)
        if key.endswith("/1/step"):
            rig.send("1", Side.UPPER, b"half-said")
            rig.token("1", alive=False)

    rig.bus.answer = die
    assert list(rig.stepper.round({1: TIMER, 2: TIMER})) == [2]
    assert rig.stepper.drain_hung() == []  # it did not hang
    rig.bus.answer, rig.silent = answer, set()
    rig.join("1")
    rig.frames["1"] = [(Side.UPPER, b"anew")]
    assert rig.stepper.round({1: TIMER})[1].frames == [(Sent(Side.UPPER, 5.0), b"anew")]
    assert rig.stepper.foreign == 0


@pytest.mark.parametrize("acted", [Acted.DONE, Acted.LATER, Acted.NO_ANSWER])
def test_a_cue_is_answered_once_under_its_whole_name(acted: Acted) -> None:
    rig = Rig()
    assert rig.stepper.wait_for_cue("add 3", 0.0) is Acted.NO_ANSWER
    rig.bus.tell(keys.CUE, f"{acted.value} add 3".encode())
    if acted is Acted.NO_ANSWER:  # "no answer" is two words, which no process says on the bus
        assert rig.stepper.wait_for_cue("add 3", 0.0) is Acted.NO_ANSWER
        assert rig.stepper.foreign == 1
        return
    assert rig.stepper.wait_for_cue("add 33", 0.0) is Acted.NO_ANSWER
    assert rig.stepper.wait_for_cue("add 3", 0.0) is acted
    assert rig.stepper.wait_for_cue("add 3", 0.0) is Acted.NO_ANSWER
    assert rig.stepper.foreign == 0


class FarPort:
    def __init__(self, end: Any) -> None:
        self.end, self.sent, self.is_open = end, [], True
        self.hear: Callable[[bytes], object] = lambda _frame: None

    def listen(self, deliver: Callable[[bytes], object]) -> None:
        self.hear = deliver

    def send(self, frame: Any) -> bool:
        self.sent.append(frame.payload)
        return True


def test_an_end_on_another_medium_is_faced_while_its_process_lives(monkeypatch: pytest.MonkeyPatch) -> None:
    """The upper end of tube 2 on CAN: frames go by its port and are counted there, not compared by marks."""
    import contextlib

    from sim.rig import bus_stepper

    ports: list[FarPort] = []

    @contextlib.contextmanager
    def open_medium(where: str) -> Any:
        assert where == "can:x"

        class Medium:
            def open_port(self, end: Any) -> FarPort:
                ports.append(FarPort(end))
                return ports[-1]

        yield Medium()
        ports[-1].is_open = False

    monkeypatch.setattr(bus_stepper, "open_medium", open_medium)
    rig = Rig(medium_of=lambda address, side: "can:x" if (address, side) == (2, Side.UPPER) else None)
    rig.join("2", "3")
    (port,) = ports
    assert (port.end.address, port.end.side, port.end.neighbour) == (254, Side.LOWER, 2)
    answer = rig.bus.answer

    def by_can(key: str, payload: bytes) -> None:
        number, events = unpack_step(payload) if "stepper" in key else (0, [])
        if key.endswith("/2/step"):
            rig.steps["2"].append((number, events))
            port.hear(b"rounded")
            rig.send("2", Side.LOWER, b"below")
            rig.done(
                "2", pack_done(Done(number, [Sent(Side.UPPER, 1.0), Sent(Side.LOWER, 2.0, mark_frame(b"below"))], 3.0))
            )
        else:
            answer(key, payload)

    rig.bus.answer = by_can
    events: list[FrameEvent] = [(DueEvent(Due.UPPER_FRAME, 1.0), b"up"), (DueEvent(Due.LOWER_FRAME, 1.0), b"low")]
    found = rig.stepper.round({2: events, 3: TIMER})
    assert port.sent == [b"up"]
    assert [event.mark for event in rig.steps["2"][0][1]] == [UNMARKED, mark_frame(b"low")]
    assert found[2].frames == [(Sent(Side.UPPER, 1.0), b"rounded"), (Sent(Side.LOWER, 2.0), b"below")]
    assert f"borechain/{RIG}/port/2/upper/rx" not in [key for key, _ in rig.bus.said]
    rig.stepper.drop(2)
    assert not port.is_open
    rig.join("2")
    assert len(ports) == 2
    assert ports[1].is_open
    rig.stepper.close()
    assert not ports[1].is_open
