"""The benchmark of a relay over zenoh: a real node between two ends, and a bare process beside it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.process

SOURCE = Path(__file__).parents[2] / "benchmarks" / "relay.py"
# in a process of its own: it forks, and a process in which sessions were open before cannot
FEW = f"""
import importlib.util, json
spec = importlib.util.spec_from_file_location("relay", {str(SOURCE)!r})
relay = importlib.util.module_from_spec(spec)
spec.loader.exec_module(relay)
relay.ROUNDS, relay.EXCHANGES = 2, 3
print(json.dumps(relay.run()))
"""


def test_a_node_relays_every_aiding_of_the_benchmark() -> None:
    done = subprocess.run([sys.executable, "-c", FEW], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    ratios = json.loads(done.stdout)["ratios"]
    assert list(ratios) == [
        "relay over zenoh",
        "handed to an asyncio loop",
        "relay over zenoh, in turn with the peer",
        "handed to an asyncio loop, in turn with the peer",
    ]
    for row in ratios.values():
        low, high = row["slower_interval"]
        assert 0.0 < low <= row["slower"] <= high
