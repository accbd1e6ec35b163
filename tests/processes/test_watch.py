"""``borechain watch`` on a real router: a silent key is reported, a binary one is shown."""

import json
import subprocess
from collections.abc import Iterator

import msgpack
import pytest
from rigs import free_endpoint, run, started

from telemetry.media.zenoh_bus import open_router

KEY = "borechain/rig-1/surface/depth"


@pytest.fixture
def endpoint() -> Iterator[str]:
    place = free_endpoint()
    with open_router(place):
        yield place


def test_a_silent_key_is_reported_and_given_up_after_the_timeout(endpoint: str) -> None:
    done = run("watch", KEY, "--endpoint", endpoint, "--timeout", "0.3")
    assert done.returncode == 1
    first, last = done.stderr.splitlines()
    assert first.startswith(f"nothing on {KEY} for 0.3 s; waiting, Ctrl-C ends it. keys are borechain/{{rig}}/port/")
    assert last == f"Error: {KEY}: nothing was published within 0.3 s"
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("payload", "value"),
    [
        (b'{"md_m": 12.5}', {"md_m": 12.5}),
        (b"[1, 2]", [1, 2]),
        (msgpack.packb([1000.0, 12.5]), [1000.0, 12.5]),
        (b"\xff\xfe\x00", {"hex": "fffe00"}),
        (b"\xc4\x02\x01\x02", {"hex": "c4020102"}),
        (b"", {"hex": ""}),
    ],
)
def test_a_value_of_any_form_is_one_line_of_json(payload: bytes, value: object) -> None:
    place = free_endpoint()
    with open_router(place) as bus:
        publisher = bus.publisher(KEY)
        with started("watch", KEY, "--endpoint", place, "--count", "1") as watching:
            while watching.poll() is None:
                publisher.put(payload)
                try:
                    watching.wait(0.05)
                except subprocess.TimeoutExpired:
                    continue
            assert json.loads(watching.stdout.read()) == {"key": KEY, "value": value}
