"""Steps and their frames put together by hand, streams byte for byte, and options of a process one by one."""

from __future__ import annotations

import math
import socket
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner
from hypothesis import example, given
from hypothesis import strategies as st

from telemetry.errors import MediumError, RadioError, UnknownMediumError
from telemetry.media.media_table import check_medium
from telemetry.messages import BASE, ENCODER, MAX_TUBE, Side
from telemetry.radio.limits import ModelRange, positive_values, values_within
from telemetry.radio.link_request import PipeRequest
from telemetry.radio.path_loss import link_margin, received_power
from telemetry.radio.pipe_links import pipe_result
from telemetry.runtime.command_line import EnvironmentFault, InputFault, fault_of, missing_module_text, run_command
from telemetry.runtime.marked_frames import mark_frame
from telemetry.runtime.process_options import (
    EndsRequest,
    above_option,
    key_option,
    own_neighbours,
    parse_medium,
    parse_neighbour,
    place_options,
)
from telemetry.runtime.step_client import STEP, StepAssembler
from telemetry.runtime.step_stream import LARGEST, StepListener, StepStream, join_steps
from telemetry.runtime.stepped import Due, DueEvent, pack_step
from telemetry.runtime.typed_options import gather_options

UPPER, LOWER = b"from above", b"from below"


def step_of(number: int, *frames: tuple[Due, bytes]) -> bytes:
    """A step that names these frames by their marks, and a cycle between them."""
    events = [DueEvent(kind, 1.0 + k, None, mark_frame(frame)) for k, (kind, frame) in enumerate(frames)]
    return pack_step(number, [DueEvent(Due.CYCLE, 0.5, [0.0, 1.0]), *events])


def test_a_step_waits_until_the_frames_of_both_ends_are_here() -> None:
    assembler = StepAssembler()
    assembler.add(STEP, step_of(7, (Due.UPPER_FRAME, UPPER), (Due.LOWER_FRAME, LOWER)))
    assert assembler.has_step
    assert assembler.take_step() is None
    assembler.add(Due.UPPER_FRAME, UPPER)
    assert assembler.take_step() is None
    assembler.add(Due.LOWER_FRAME, b"none of ours")
    assert assembler.take_step() is None
    assembler.add(Due.LOWER_FRAME, LOWER)
    assembler.add(Due.LOWER_FRAME, b"another foreign one")
    number, events = assembler.take_step() or (0, [])
    assert number == 7
    assert [(event.kind, frame) for event, frame in events] == [
        (Due.CYCLE, b""),
        (Due.UPPER_FRAME, UPPER),
        (Due.LOWER_FRAME, LOWER),
    ]
    assert (assembler.foreign, assembler.has_step, assembler.take_step()) == (2, False, None)


def test_what_is_no_step_is_counted_and_the_next_one_taken() -> None:
    assembler = StepAssembler()
    for payload in (b"\xc1", b"junk", step_of(3), step_of(4)):
        assembler.add(STEP, payload)
    assert [(assembler.take_step() or (0,))[0] for _ in range(2)] == [3, 4]
    assert (assembler.foreign, assembler.take_step()) == (2, None)


@pytest.fixture
def two_ends() -> Iterator[tuple[StepStream, socket.socket]]:
    ours, theirs = socket.socketpair()
    stream = StepStream(ours)
    yield stream, theirs
    stream.close()
    theirs.close()


@given(payloads=st.lists(st.binary(max_size=9), max_size=5), cut=st.integers(1, 60))
@example([b"", b"x"], 4)
@example([b"abc"], 7)
@example([b"abc"], 6)
def test_payloads_come_in_order_wherever_the_bytes_are_cut(payloads: list[bytes], cut: int) -> None:
    ours, theirs = socket.socketpair()
    stream = StepStream(ours)
    with ours, theirs:
        whole = b"".join(struct.pack(">I", len(one)) + one for one in payloads)
        got = []
        for at in range(0, len(whole), cut):
            theirs.sendall(whole[at : at + cut])
            got.append(stream.arrived() or [])
        assert [one for some in got for one in some] == payloads
        lengths = [4 + len(one) for one in payloads]
        done = [sum(1 for k in range(len(lengths)) if sum(lengths[: k + 1]) <= cut * (m + 1)) for m in range(len(got))]
        assert [sum(map(len, got[: m + 1])) for m in range(len(got))] == done  # each as soon as its last byte is here


def test_a_stream_ends_where_the_peer_goes_and_where_it_announces_too_much(
    two_ends: tuple[StepStream, socket.socket],
) -> None:
    stream, theirs = two_ends
    stream.send(b"hello")
    assert theirs.recv(100) == b"\0\0\0\x05hello"
    with pytest.raises(TimeoutError):
        stream.receive(0.0001)
    theirs.sendall(struct.pack(">I", LARGEST - 3))
    assert stream.receive() is None
    theirs.close()
    assert stream.arrived() is None
    stream.send(b"to an end that is gone")


def test_a_listener_knows_its_streams_by_name_and_tells_which_ended(tmp_path: Path) -> None:
    heard: list[tuple[str, Any]] = []
    listener = StepListener(
        tmp_path / "s", lambda name, _: heard.append((name, "joined")), lambda *one: heard.append(one)
    )

    def settle() -> None:
        while listener.wait(0.0):
            pass

    first = join_steps(tmp_path / "s", "node-1")
    settle()
    first.send(b"one")
    first.send(b"two")
    settle()
    second = join_steps(tmp_path / "s", "node-1")  # the same again takes the place of the first
    settle()
    assert first.receive() is None
    second.close()
    settle()
    assert heard == [
        ("node-1", "joined"), ("node-1", b"one"), ("node-1", b"two"), ("node-1", None), ("node-1", "joined"),
        ("node-1", None),
    ]  # fmt: skip
    listener.wake()
    assert listener.wait(0.0)
    assert not listener.wait(0.0)
    listener.close()
    first.close()
    with pytest.raises(MediumError, match=r"node-2: no stepper at .*; is the medium running"):
        join_steps(tmp_path / "s", "node-2")


@pytest.mark.parametrize(
    ("text", "expected"),
    [(None, None), ("encoder", ENCODER), ("base", BASE), ("1", 1), (str(MAX_TUBE), MAX_TUBE), ("7", 7)],
)
def test_a_neighbour_is_named_or_numbered(text: str | None, expected: int | None) -> None:
    assert parse_neighbour(None, None, text) == expected  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["0", str(MAX_TUBE + 1), "-1", "tube", "", "1.0"])
def test_another_neighbour_is_refused_with_the_range(text: str) -> None:
    with pytest.raises(click.BadParameter, match=f"expected encoder, base or a tube 1..{MAX_TUBE}, got {text}"):
        parse_neighbour(None, None, text)  # type: ignore[arg-type]


ENDS = {Side.UPPER: ENCODER, Side.LOWER: 4}
NO_ENDS = dict.fromkeys(Side)
SENSOR = ("--imu", "mpu:1")


def test_the_ends_of_a_clock_of_its_own_are_those_that_are_named_or_on_can() -> None:
    assert own_neighbours("stepper", 5, SENSOR, NO_ENDS, NO_ENDS) is None
    assert own_neighbours("own", 5, SENSOR, ENDS, NO_ENDS) == ENDS
    assert own_neighbours("own", 5, SENSOR, NO_ENDS, NO_ENDS) == {}
    on_can = {Side.UPPER: "can:can0", Side.LOWER: None}
    assert own_neighbours("own", 5, SENSOR, NO_ENDS, on_can) == {Side.UPPER: None}
    assert own_neighbours("own", 5, SENSOR, {Side.UPPER: None, Side.LOWER: 4}, on_can) == {
        Side.UPPER: None,
        Side.LOWER: 4,
    }
    given = EndsRequest("own", ENCODER, None, None, "can:can1").to_own_time(5, SENSOR)
    assert given is not None
    assert given.neighbours == {Side.UPPER: ENCODER, Side.LOWER: None}
    assert EndsRequest("stepper", None, None, None, None).to_own_time(5, SENSOR) is None


@pytest.mark.parametrize(
    ("clock", "address", "sensor", "ends", "media", "words"),
    [
        ("stepper", 5, SENSOR, ENDS, NO_ENDS, "expected --clock own with them"),
        ("stepper", 5, SENSOR, NO_ENDS, {Side.UPPER: "can:x", Side.LOWER: None}, "expected --clock own with them"),
        ("own", 5, ("--imu", None), ENDS, NO_ENDS, "--clock own: expected --imu with it"),
        ("own", 4, SENSOR, ENDS, NO_ENDS, "two others than 4 itself, got encoder, 4"),
        ("own", 5, SENSOR, {Side.UPPER: 3, Side.LOWER: 3}, NO_ENDS, "two others than 5 itself, got 3, 3"),
        (
            "own",
            5,
            SENSOR,
            NO_ENDS,
            {Side.UPPER: "zenoh:a", Side.LOWER: None},
            "--upper zenoh:a: expected --above with it",
        ),
        (
            "own",
            5,
            SENSOR,
            NO_ENDS,
            {Side.UPPER: None, Side.LOWER: "zenoh:a"},
            "--lower zenoh:a: expected --below with it",
        ),
    ],
)
def test_ends_that_do_not_fit_are_refused(
    clock: str, address: int, sensor: Any, ends: Any, media: Any, words: str
) -> None:
    with pytest.raises(InputFault, match=words):
        own_neighbours(clock, address, sensor, ends, media)


@click.command()
@place_options
@above_option
@key_option
@click.option("--upper", callback=parse_medium)
def told(**options: Any) -> None:
    """Tell its options."""
    click.echo("|".join(f"{name}={options[name]}" for name in sorted(options)))


def ask(*words: str) -> tuple[int, str]:
    result = CliRunner().invoke(told, words)
    return result.exit_code, result.output


def test_a_file_of_options_is_read_and_the_command_line_wins(tmp_path: Path) -> None:
    file = tmp_path / "o.toml"
    file.write_text('rig = "well"\nabove = "7"\nfolder = "there"\n')
    ok, line = ask("--config", str(file), "--folder", "here")
    assert (ok, line.strip()) == (
        0,
        "above=7|endpoint=tcp/127.0.0.1:7447|folder=here|key_file=None|rig_name=well|upper=None",
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('rigs = "well"', "rigs: unknown key; expected one of above, endpoint, folder, insecure, key-file, rig, upper"),
        ('config = "x"', "config: unknown key"),
        ("rig = ", "not TOML"),
    ],
)
def test_a_wrong_file_of_options_is_refused(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "o.toml"
    file.write_text(text)
    ok, line = ask("--config", str(file))
    assert ok == 2
    assert words in " ".join(line.replace("│", " ").split())


@pytest.mark.parametrize(
    ("words", "status", "line"),
    [
        (("--endpoint", "tcp/10.0.0.1:7447"), 2, "--insecure allows it"),
        (("--insecure", "--endpoint", "tcp/10.0.0.1:7447"), 0, "endpoint=tcp/10.0.0.1:7447"),
        (("--endpoint", "tcp/localhost:7447"), 0, "endpoint=tcp/localhost:7447"),
        (("--endpoint", "tls/10.0.0.1:7447"), 0, "endpoint=tls/10.0.0.1:7447"),
        (("--endpoint", "10.0.0.1"), 2, "expected tcp/HOST:PORT, got 10.0.0.1"),
        (("--upper", "zenoh:tcp/10.0.0.1:7447"), 2, "--insecure allows it"),
        (("--upper", "zenoh:tcp/127.0.0.1:7447"), 0, "upper=zenoh:tcp/127.0.0.1:7447"),
        (("--upper", "wire:0"), 2, "medium: expected one of can, memory, zenoh, got wire"),
    ],
)
def test_an_open_network_is_joined_only_where_that_is_allowed(words: tuple[str, ...], status: int, line: str) -> None:
    ok, output = ask(*words)
    assert ok == status
    assert line in " ".join(output.replace("│", " ").split())


def test_a_medium_that_is_not_in_the_table_is_refused_by_name() -> None:
    check_medium("memory:net")
    with pytest.raises(UnknownMediumError, match="expected one of can, memory, zenoh, got none"):
        check_medium("")
    with pytest.raises(MediumError):
        check_medium("can:vcan0,frames=narrow")


def test_an_error_ends_a_command_by_whose_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    assert isinstance(fault_of(MediumError("bus")), EnvironmentFault)
    assert isinstance(fault_of(OSError("disk")), EnvironmentFault)
    assert fault_of(ValueError("ours")) is None
    fault = InputFault("wrong")
    assert fault_of(fault) is fault
    assert (InputFault.exit_code, EnvironmentFault.exit_code) == (2, 1)
    assert "extra ground: pip install 'borechain[ground]' (rich is not installed)" in missing_module_text(
        "rich.console"
    )
    assert missing_module_text("nothing.at") == "needs nothing, which is not installed here"
    assert "needs the package sim of borechain" in missing_module_text("sim.world")
    for error, status in ((fault, 2), (EnvironmentFault("no"), 1), (click.Abort(), 1), (KeyboardInterrupt(), 1)):

        @click.command()
        def ending(error: BaseException = error) -> None:
            raise error

        with pytest.raises(SystemExit) as ended:
            run_command(ending, "x", [])
        assert ended.value.code == status
    with pytest.raises(SystemExit) as done:
        run_command(click.Command("x", callback=lambda: 3), "x", [])
    assert done.value.code == 3
    assert "interrupted" in capsys.readouterr().err


def test_an_object_that_stands_in_another_does_not_reach_the_command() -> None:
    seen: dict[str, Any] = {}

    @click.command()
    @gather_options(
        click.option("--a", type=int), click.option("--b", type=int), click.option("--own", type=int),
        inner=lambda a: ("inner", a), outer=lambda inner, b: ("outer", inner, b),
    )  # fmt: skip
    def command(**given: Any) -> None:
        seen.update(given)

    command.main(["--a", "1", "--b", "2", "--own", "3"], standalone_mode=False)
    assert seen == {"own": 3, "outer": ("outer", ("inner", 1), 2)}


def test_the_first_value_outside_is_named_in_its_unit() -> None:
    with pytest.raises(RadioError, match=r"^length: expected 10\.\.20 cm, got 30$"):
        values_within("length", [0.1, 0.3, 0.2, 0.05], ModelRange(0.1, 0.2, 100.0, "cm"))
    assert values_within("length", [0.1, 0.2], ModelRange(0.1, 0.2)).tolist() == [0.1, 0.2]
    for wrong, shown in (([2.0, -3.0, -4.0], "-3"), (0.0, "0"), (math.inf, "inf"), ([math.nan, 1.0], "nan")):
        with pytest.raises(RadioError, match=rf"^power: expected more than 0 W, got {shown}$"):
            positive_values("power", wrong, "W")
    with pytest.raises(RadioError, match=r"^power: expected more than 0 mW, got -3000$"):
        positive_values("power", -3.0, "mW", 1000.0)


def test_a_receiver_hears_what_is_sent_and_gained_less_what_is_lost() -> None:
    assert (float(received_power(70.0)), float(received_power(70.0, 10.0, 3.0))) == (-68.0, -57.0)
    assert (float(link_margin(-90.0)), float(link_margin(-90.0, -110.0))) == (13.0, 20.0)


def test_a_mode_that_does_not_propagate_has_its_cut_off_and_no_reach() -> None:
    """Zeros of J1', J0 and J2' (Abramowitz and Stegun, table 9.5), a bore of 3 cm, between the second and third."""
    result = pipe_result(PipeRequest(radius_cm=3.0, frequency_ghz=4.0))
    rows = {row["mode"]: row for row in result["links"]}
    cut_offs = {"TE11": 1.84118, "TM01": 2.40483, "TE21": 3.05424}
    for mode, zero in cut_offs.items():
        assert rows[mode]["cut_off_ghz"] == pytest.approx(zero * 0.299792458 / (math.tau * 0.03), rel=1e-5)
    assert (rows["TE21"]["attenuation_db_per_m"], rows["TE21"]["reach_m"]) == (None, None)
    assert rows["TE11"]["reach_m"] * rows["TE11"]["attenuation_db_per_m"] == pytest.approx(110.0)
    assert result["carbon_percent"] == 0.26
