"""The benches of trust on real processes: who is beset is answered, and who is revoked is out while nothing is lost."""

from __future__ import annotations

import json
import socket
from typing import Any

import pytest
from rigs import free_endpoint, run

pytestmark = pytest.mark.process


def bench(*words: str) -> dict[str, Any]:
    done = run("bench", *words, "--json")
    assert done.returncode == 0, done.stderr
    return dict(json.loads(done.stdout.splitlines()[-1]))


def free_address() -> str:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"127.0.0.1:{probe.getsockname()[1]}"


def test_who_is_signed_in_is_answered_while_the_door_is_beset() -> None:
    """Each of 400 half-open connections, 64 unread streams and 150 wrong passwords stands there as it asks on."""
    asks = 6
    found = bench("doors", "--asks", str(asks), "--endpoint", free_endpoint(), "--page", free_address())
    assert (found["half_open"], found["streams"], found["wrong"]) == (400, 64, 150)
    assert found["free_ms"]["count"] == found["answer_ms"]["count"] == asks
    assert found["answer_ms"]["max"] < 60_000.0  # what one that is refused counts


def test_each_person_who_is_revoked_is_out_and_nothing_of_the_string_is_lost() -> None:
    found = bench("shut_out", "--times", "2", "--endpoint", free_endpoint().replace("tcp/", "tls/"))
    assert (len(found["out_s"]), len(found["goes_on_s"])) == (2, 2)
    assert all(0.0 < out < goes_on for out, goes_on in zip(found["out_s"], found["goes_on_s"], strict=True))
    assert found["handed"] > 2
    assert (found["lost"], found["doubled"]) == (0, 0)
