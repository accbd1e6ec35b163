"""A plugin of pytest: every node of the tests runs in integers and its calls are written to ``$BORECHAIN_CALLS``."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from recorded_calls import recording


@pytest.fixture(autouse=True, scope="session")
def recorded_calls() -> Iterator[None]:
    with recording(Path(os.environ["BORECHAIN_CALLS"])):
        yield
