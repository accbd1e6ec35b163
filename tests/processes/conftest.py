"""Fixtures of the tests with real processes."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from rigs import PATIENCE, Rig

from telemetry.media.zenoh_bus import ZenohBus, open_client


@pytest.fixture
def ask() -> Iterator[Callable[[Rig, str], Any]]:
    """Ask a rig's ground station as an operator; None while it does not answer yet."""
    with contextlib.ExitStack() as stack:
        buses: dict[str, ZenohBus] = {}

        def get(rig: Rig, selector: str) -> Any:
            if rig.endpoint not in buses:
                buses[rig.endpoint] = stack.enter_context(open_client(rig.endpoint, timeout=PATIENCE))
            replies = [r for r in buses[rig.endpoint].get(selector, 10.0) if r.error is None]
            return json.loads(replies[0].payload) if replies else None

        yield get
