"""The benchmark of a relay over zenoh: a real node between two ends, and a bare process beside it."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "benchmarks" / "relay.py"


def test_a_node_relays_every_aiding_of_the_benchmark(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = importlib.util.spec_from_file_location("benchmarks_relay", SOURCE)
    assert spec is not None
    assert spec.loader is not None
    relay = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(relay)
    monkeypatch.setattr(relay, "ROUNDS", 2)
    monkeypatch.setattr(relay, "EXCHANGES", 3)
    ratios = relay.run()["ratios"]
    assert list(ratios) == ["relay over zenoh", "handed to an asyncio loop"]
    for row in ratios.values():
        low, high = row["slower_interval"]
        assert 0.0 < low <= row["slower"] <= high
