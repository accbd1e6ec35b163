"""What a port does at its largest frame and on whose thread, which keys are orders, who a stepped end faces."""

from __future__ import annotations

import re
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from telemetry.application.commands import COMMANDS, NAMES, find_command
from telemetry.errors import CommandError, MediumError
from telemetry.keys import is_order, port_key
from telemetry.media.can_medium import CanSettings
from telemetry.media.neighbours import stepped_ports, stepped_ports_on
from telemetry.media.port import MAX_FRAME, STEPPER, PortFrame, TubeEnd
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.media.zenoh_port import ZenohMedium, ZenohPort
from telemetry.messages import BASE, ENCODER, HOPS_UNKNOWN, MAX_TUBE, NodeMode, NodeState, Side
from telemetry.presentation.msgpack_codec import encode_message, state_origin
from telemetry.schema import SCHEMA
from telemetry.unwritten import Unwritten


class NotedPublisher:
    """A publisher that notes what is put."""

    def __init__(self, put: Callable[[bytes], object], is_heard: Callable[[], bool]) -> None:
        self.put, self._is_heard, self.is_closed = put, is_heard, False

    def watch(self) -> None:
        """Know at any time whether the key has a subscriber."""

    @property
    def is_heard(self) -> bool:
        return self._is_heard()

    def close(self) -> None:
        self.is_closed = True


class NotedBus:
    """What a port asks of a session, noted: a router would drop or not as its load is."""

    def __init__(self) -> None:
        self.sent: list[tuple[str, bool, bytes]] = []
        self.hears: dict[str, Callable[[bytes], object]] = {}
        self.heard = True
        self.made: list[Any] = []

    def publisher(self, key: str, encoding: str, *, droppable: bool = False) -> NotedPublisher:
        self.made.append(NotedPublisher(lambda data: self.sent.append((key, droppable, data)), lambda: self.heard))
        return self.made[-1]

    def hear(self, key: str, deliver: Callable[[bytes], object]) -> NotedPublisher:
        self.hears[key] = deliver
        self.made.append(NotedPublisher(lambda data: None, lambda: True))
        return self.made[-1]


def test_a_frame_of_the_largest_size_goes_and_one_byte_more_does_not() -> None:
    bus: Any = NotedBus()
    port = ZenohPort(bus, "out", "in")
    assert port.send(PortFrame(b"x" * MAX_FRAME))
    assert not port.send(PortFrame(b"x" * (MAX_FRAME + 1)))
    assert [(key, len(data)) for key, _, data in bus.sent] == [("out", MAX_FRAME)]
    assert port.counters == {"too_large": 1}


def test_what_answers_on_the_thread_that_heard_may_be_dropped_and_nothing_else() -> None:
    bus: Any = NotedBus()
    port = ZenohPort(bus, "out", "in")
    port.listen(lambda frame: port.send(PortFrame(b"answer to " + frame)))
    port.send(PortFrame(b"first"))
    bus.hears["in"](b"x")
    port.send(PortFrame(b"last"))
    assert bus.sent == [("out", False, b"first"), ("out", True, b"answer to x"), ("out", False, b"last")]


def test_who_is_not_heard_waits_in_order_and_goes_before_what_comes_later() -> None:
    bus: Any = NotedBus()
    port = ZenohPort(bus, "out", "in")
    bus.heard = False
    assert port.send(PortFrame(b"1"))
    assert not port.is_up
    bus.heard = True
    port.send(PortFrame(b"2"))
    assert [data for _, _, data in bus.sent] == [b"1", b"2"]
    port.listen(lambda _: None)
    port.close()
    port.close()
    assert all(one.is_closed for one in bus.made)
    assert not port.is_up
    with pytest.raises(MediumError, match="port out: it is closed"):
        port.send(PortFrame(b"3"))


@pytest.mark.parametrize("neighbour", [None, 5])
def test_an_end_hears_what_its_neighbour_sends_or_what_a_stepper_brings(neighbour: int | None) -> None:
    bus: Any = NotedBus()
    port = ZenohMedium(bus).open_port(TubeEnd("r", 4, Side.UPPER, neighbour))
    port.listen(lambda _: None)
    port.send(PortFrame(b"x"))
    facing = port_key("r", 4, Side.UPPER, "rx") if neighbour is None else port_key("r", 5, Side.LOWER, "tx")
    assert list(bus.hears) == [facing]
    assert bus.sent[0][0] == port_key("r", 4, Side.UPPER, "tx")


@pytest.mark.parametrize(
    ("selector", "expected"),
    [
        ("borechain/rig/cmd/north", True),
        ("borechain/rig/cmd/north?action=tell;angle_deg=3", True),
        ("borechain/rig/cmd", True),
        ("borechain/rig/cmd?a=b/c", True),
        ("borechain/rig/ground/status", False),
        ("borechain/rig/ground/cmd", False),
        ("cmd", False),
        ("borechain/rig/ground/status?x=a/b/cmd", False),
        ("borechain/rig/state?/cmd", False),
        ("", False),
    ],
)
def test_an_order_is_what_stands_below_the_key_of_commands(selector: str, expected: bool) -> None:
    assert is_order(selector) is expected


@pytest.mark.parametrize("name", NAMES)
def test_a_command_is_found_by_its_action_and_another_is_refused_with_those_there_are(name: str) -> None:
    lines = [spec for spec in COMMANDS if spec.name == name]
    for spec in lines:
        assert find_command(name, spec.action) is spec
    actions = [spec.action for spec in lines]
    asked = f"cmd/{name}?action={'|'.join(actions)}" if any(actions) else "no action"
    words = re.escape(f"expected {asked}, got 'no'")
    with pytest.raises(CommandError, match=words):
        find_command(name, "no")
    if "" not in actions:
        with pytest.raises(CommandError, match=f"expected cmd/{name}\\?action="):
            find_command(name)


def test_a_command_that_is_none_is_refused_with_all_names() -> None:
    with pytest.raises(CommandError, match=f"expected cmd/{NAMES[0]}.*{NAMES[-1]}, got 'danc'".replace("|", r"\|")):
        find_command("danc")


def test_a_stepped_process_has_its_sides_and_faces_the_stepper() -> None:
    with stepped_ports_on("edges", 4, {Side.UPPER: "memory:edges", Side.LOWER: "memory:edges"}) as ports:
        assert list(ports) == [Side.UPPER, Side.LOWER]
        heard: list[tuple[str, bytes]] = []
        with stepped_ports_on("edges", STEPPER, {}) as none:
            assert none == {}
        from telemetry.media.media_table import open_medium

        with open_medium("memory:edges") as net:
            far = net.open_port(TubeEnd("edges", STEPPER, Side.LOWER, 4))
            far.listen(lambda frame: heard.append(("far", frame)))
            ports[Side.UPPER].listen(lambda frame: heard.append(("near", frame)))
            far.send(PortFrame(b"a"))
            ports[Side.UPPER].send(PortFrame(b"b"))
            assert not ports[Side.LOWER].is_up
            alone = stepped_ports(net, "edges", 9, [Side.LOWER])
            assert list(alone) == [Side.LOWER]
            assert not alone[Side.LOWER].is_up
        assert heard == [("near", b"a"), ("far", b"b")]


def test_a_bus_reads_no_settings_of_the_machine(monkeypatch: pytest.MonkeyPatch, tmp_path: Any) -> None:
    """A file of python-can in the home folder, or its environment, would say another channel or rate."""
    import can

    asked: list[dict[str, Any]] = []
    monkeypatch.setattr(can, "Bus", lambda channel, **options: asked.append({"channel": channel} | options))
    CanSettings.parse("can0").open_bus("2-3")
    (options,) = asked
    assert options["ignore_config"] is True
    assert (options["channel"], options["fd"], options["receive_own_messages"]) == ("can0", True, True)


class Written(Unwritten):
    """Bytes that are made on demand, how often is counted."""

    def __init__(self) -> None:
        self._written, self.times = None, 0

    @property
    def most(self) -> int:
        return 9

    def _write(self) -> bytes:
        self.times += 1
        return b"abc"


def test_bytes_are_made_once() -> None:
    one = Written()
    assert (bytes(one), len(one), bytes(one), one.times) == (b"abc", 3, b"abc", 1)


def test_a_message_is_as_new_as_its_newest_field() -> None:
    for spec in SCHEMA:
        assert spec.newest == sorted(field.since for field in spec.fields)[-1]
    assert {BASE, ENCODER}.isdisjoint({STEPPER})
    ranges = {(f.low, f.high) for spec in SCHEMA for f in spec.fields if f.kind.name == "COVARIANCE"}
    assert ranges == {(-1e6, 1e6)}


@pytest.mark.parametrize("tube", [1, 127, 128, 250])
def test_a_state_cut_off_anywhere_is_known_or_none(tube: int) -> None:
    """The tube is one byte up to 127 and two beyond; what ends before it has no tube, and raises nothing."""
    state = NodeState(
        tube, 1000.0, 2, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, (0.01, 0.0, -0.01), 1e-3, 0.01, 1e-5, 2.0, 1e-8, 0, 5, 0
    )  # type: ignore[arg-type]
    payload = encode_message(state)
    found = [state_origin(payload[:size]) for size in range(len(payload) + 1)]
    assert found[-1] == tube
    first = found.index(tube)
    assert found[:first] == [None] * first
    assert set(found[first:]) == {tube}
    assert payload[first - 1] == tube or payload[first - 2] == tube


def test_hops_that_are_not_known_are_no_number_of_hops() -> None:
    assert HOPS_UNKNOWN not in range(MAX_TUBE + 1)
    saved = next(spec for spec in SCHEMA if any(field.name == "hops" for field in spec.fields))
    field = next(field for field in saved.fields if field.name == "hops")
    assert field.low <= HOPS_UNKNOWN < 0.0


def test_tokens_of_a_session_are_keys_and_an_error_is_none() -> None:
    replies = [SimpleNamespace(ok=SimpleNamespace(key_expr=key)) for key in ("b", "a", "b")]
    asked: list[Any] = []

    def get(pattern: str, timeout: float) -> list[Any]:
        asked.append((pattern, timeout))
        return [*replies, SimpleNamespace(ok=None, err="late")]

    session: Any = SimpleNamespace(liveliness=lambda: SimpleNamespace(get=get))
    assert ZenohBus(session).tokens("r/*", 0.5) == ["a", "b", "b"]
    assert asked == [("r/*", 0.5)]
