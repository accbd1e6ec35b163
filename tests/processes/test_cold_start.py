"""A process on a machine that has compiled nothing yet: it says that it lives when it can work at once."""

import contextlib
import os
import queue
import subprocess
from pathlib import Path

import pytest
from rigs import PATIENCE, REPOSITORY, command, free_endpoint

from telemetry import keys
from telemetry.media.zenoh_bus import open_router

COMPILING = 600.0  # s, that a node's kernels may take on a busy machine


@pytest.mark.parametrize(
    ("name", "words", "kernel"),
    [
        ("encoder", ["encoder"], "node.kernels.string.encoder_step"),
        pytest.param(
            "1",
            ["node", "--tube", "1", "--drive-joint-deg", "0"],
            "node.kernels.step.node_step",
            marks=[pytest.mark.statistical, pytest.mark.timeout(PATIENCE + COMPILING)],
        ),
    ],
)
def test_a_process_has_compiled_its_kernels_when_it_says_that_it_lives(
    tmp_path: Path, name: str, words: list[str], kernel: str
) -> None:
    """A stepper takes a process that does not answer a step for 20 s for dead; a cold node compiles for longer."""
    cache, endpoint = tmp_path / "compiled", free_endpoint()
    lives: queue.SimpleQueue[bool] = queue.SimpleQueue()
    with open_router(endpoint) as bus, contextlib.ExitStack() as stack:
        bus.liveliness_subscribe(keys.LIVELINESS.format(rig="cold", process=name), lambda _key, alive: lives.put(alive))
        arguments = command(*words, "--endpoint", endpoint, "--rig", "cold", "--folder", str(tmp_path / "state"))
        process = subprocess.Popen(arguments, cwd=REPOSITORY, env=os.environ | {"NUMBA_CACHE_DIR": str(cache)})
        stack.callback(process.wait)
        stack.callback(process.kill)
        assert lives.get(timeout=COMPILING)
        assert list((cache / kernel).glob("*.nbc"))
