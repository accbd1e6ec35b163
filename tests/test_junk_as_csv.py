"""What is no answer of a ground station is refused in a line where it is wanted as CSV, whatever its bytes are."""

from __future__ import annotations

import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from borechain.cli.ground.query import csv_of
from telemetry.media.zenoh_bus import QueryReply
from telemetry.runtime.command_line import InputFault

JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["stations", "md_m", "x"]), inner),
    max_leaves=8,
)


def refused(key: str, payload: bytes) -> str:
    with pytest.raises(InputFault) as told:
        csv_of([QueryReply(key, payload, None)])
    assert "\n" not in str(told.value)
    return str(told.value)


@given(st.binary(max_size=200))
def test_bytes_are_no_table(payload: bytes) -> None:
    assert "expected rows of a ground station" in refused("borechain/rig-1/ground/stations", payload)


@given(JSON)
def test_other_json_is_a_table_of_its_rows_or_refused(value: object) -> None:
    reply = QueryReply("borechain/rig-1/ground/stations", json.dumps(value).encode(), None)
    try:
        head, *_ = csv_of([reply]).splitlines()
    except InputFault as fault:
        assert "\n" not in str(fault)  # noqa: PT017 - either way is right, a traceback is not
    else:
        assert head.startswith("station,")


@pytest.mark.parametrize("key", ["elsewhere", "borechain/rig-1/cmd/north", "borechain/rig-1/ground/nonsense"])
def test_a_key_of_no_table_is_named(key: str) -> None:
    assert refused(key, b"{}").startswith("--csv: ")
