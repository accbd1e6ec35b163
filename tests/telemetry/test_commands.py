"""The table of commands: what an operator writes, what a tube gets, what either is refused."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.application.arguments import (
    CHECKS,
    check_arguments,
    checked_values,
    parse_parameters,
    parse_tube,
    shown_name,
    shown_values,
)
from telemetry.application.commands import COMMANDS, LONGEST_FINDING, CommandSpec, ObeyedBy, find_command
from telemetry.errors import CommandError
from telemetry.messages import Command, Reply
from telemetry.presentation.msgpack_codec import MAX_PAYLOAD, decode_message, encode_message
from telemetry.quantities import MAX_TEXT, Quantity, ValueKind

ATTITUDE = find_command("recalibrate", "attitude")
RECORD = find_command("static_record")
ALIGN = find_command("align")


def texts(quantity: Quantity) -> st.SearchStrategy[str]:
    """What an operator may write."""
    match quantity.kind:
        case ValueKind.NUMBER:
            turned = math.degrees if quantity.unit == "rad" else float
            return st.floats(turned(quantity.low), turned(quantity.high)).map(repr)
        case ValueKind.INTEGER:
            return st.integers(int(quantity.low), int(quantity.high)).map(str)
        case ValueKind.INTEGERS:
            items = st.integers(int(quantity.low), int(quantity.high))
            return st.lists(items, min_size=1, max_size=8).map(lambda found: ",".join(map(str, found)))
    return st.sampled_from(quantity.choices) if quantity.choices else st.text(max_size=MAX_TEXT)


@pytest.mark.slow
@pytest.mark.parametrize("spec", COMMANDS, ids=lambda spec: f"{spec.name} {spec.action}".strip())
@given(data=st.data())
def test_whatever_the_table_allows_is_read_checked_and_sent(spec: CommandSpec, data: st.DataObject) -> None:
    given_ = {
        shown_name(argument.quantity): data.draw(texts(argument.quantity))
        for argument in spec.arguments
        if argument.needed or data.draw(st.booleans())
    }
    arguments = parse_parameters(spec, given_ | {"tube": "1", "action": spec.action, "by": "anna"})
    obeyed = check_arguments(spec, arguments)
    assert set(obeyed) == {argument.quantity.name for argument in spec.arguments}
    assert {name: obeyed[name] for name in arguments} == arguments
    if spec.by is ObeyedBy.TUBE:
        command = Command(1, 1, spec.name, arguments)
        assert decode_message(encode_message(command)) == command


def test_defaults_are_allowed_values() -> None:
    for spec in COMMANDS:
        for argument in spec.arguments:
            if argument.default is not None:
                assert CHECKS[argument.quantity.kind](argument.quantity, argument.default) == argument.default


def test_an_attitude_is_written_in_degrees() -> None:
    arguments = parse_parameters(ATTITUDE, {"pitch_deg": "-180", "roll_deg": "90", "seconds": "60"})
    assert arguments == {"pitch": -math.pi, "roll": math.pi / 2.0, "seconds": 60.0}


@pytest.mark.parametrize(
    ("spec", "parameters", "named"),
    [
        (RECORD, {}, "expected cmd/static_record?tube=N;seconds=.., got none"),
        (RECORD, {"seconds": "60", "second": "1"}, "got seconds, second"),
        (RECORD, {"seconds": "3601"}, "parameter seconds: expected 5..3600, got '3601'"),
        (RECORD, {"seconds": ""}, "parameter seconds: expected 5..3600, got ''"),
        (ALIGN, {"turns": "0.5"}, "parameter turns: expected 1..20, got '0.5'"),
        (ALIGN, {"method": "x" * 100}, f"method: expected circle, extremes, none, got '{'x' * 40}'"),
        (ATTITUDE, {"pitch_deg": "181", "roll_deg": "0", "seconds": "9"}, "pitch_deg: expected -180..180, got '181'"),
        (ATTITUDE, {"pitch": "1", "roll_deg": "0", "seconds": "9"}, "action=attitude;pitch_deg=..;roll_deg=.."),
    ],
)
def test_a_wrong_parameter_is_named_in_one_line(spec: CommandSpec, parameters: dict[str, str], named: str) -> None:
    with pytest.raises(CommandError) as refused:
        parse_parameters(spec, parameters)
    assert named in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("tube", ["", "0", "251", "-1", "1.0", "x", "9" * 5000, "\u0663\u0663\u0663"])
def test_what_is_no_tube_is_refused(tube: str) -> None:
    with pytest.raises(CommandError, match=r"1\.\.250"):
        parse_tube(RECORD, {"tube": tube})


@pytest.mark.parametrize(
    ("name", "action", "named"),
    [
        ("dance", "", "take_survey|static_record"),
        ("recalibrate", "", "begin|attitude|solve|confirm|cancel|surveys, got ''"),
        ("recalibrate", "dance", "got 'dance'"),
        ("align", "begin", "expected no action"),
        ("nothing", "", "expected cmd/take_survey|static_record|"),
        ("length", "tell", "cmd/length: expected no action, got 'tell'"),
        ("north", "", "expected cmd/north?action=tell|check, got ''"),
        ("alarm", "kill", "expected cmd/alarm?action=acknowledge|shelve|unshelve, got 'kill'"),
    ],
)
def test_a_wrong_name_is_told_the_right_ones(name: str, action: str, named: str) -> None:
    with pytest.raises(CommandError) as refused:
        find_command(name, action)
    assert named in str(refused.value)


def test_values_are_shown_with_their_unit_and_what_is_not_promised_is_left_out() -> None:
    spec = find_command("alignment")
    told: dict[str, Any] = {"method": "circle", "pitch": [math.pi, 0.0], "roll": ["x"], "colour": 1}
    values = checked_values(spec, told)
    assert values == {"method": "circle", "pitch": (math.pi, 0.0)}
    assert shown_values(spec.reply, values) == {"method": "circle", "pitch_deg": [180.0, 0.0]}


def test_the_longest_reply_fits_one_payload() -> None:
    timing = find_command("timing")
    values = {quantity.name: 99.123456789 for quantity in timing.reply} | {"cycles": 2**53, "overruns": 2**53}
    assert len(encode_message(Reply(250, 2**53, True, "", values))) < MAX_PAYLOAD // 4
    angles = dict.fromkeys(("pitch", "pitch_std", "roll", "roll_std"), (1.0,) * 16)
    assert len(encode_message(Reply(250, 2**53, True, "", {"method": "circle"} | angles))) < MAX_PAYLOAD // 4
    board = {quantity.name: "w" * LONGEST_FINDING for quantity in find_command("check_board").reply}
    said = Reply(250, 2**53, True, "d" * MAX_TEXT, board | {"good": False})
    assert len(encode_message(said)) < MAX_PAYLOAD * 3 // 4
