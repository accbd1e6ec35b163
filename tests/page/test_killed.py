"""The page of a rig of real processes: its ground station is stopped, killed and starts again under a browser."""

import os
import re
import signal
import socket
from collections.abc import Callable
from pathlib import Path

import pytest
from page_client import free_port
from playwright.sync_api import Page, expect
from rigs import running_rig

pytestmark = pytest.mark.process
Open = Callable[..., Page]


def test_a_browser_sees_the_string_grow_and_outlives_its_ground_station(tmp_path: Path, watched: Open) -> None:
    port = free_port()
    with running_rig(tmp_path, "--speed", "20", "--page", f"127.0.0.1:{port}") as rig:
        ground = rig.pid_of("borechain ground")
        assert rig.process.stderr is not None
        told = rig.process.stderr.readline()
        assert re.fullmatch(rf"page http://127\.0\.0\.1:{port}; sign in as driller with the password \S+\n", told)
        rig.until(lambda: is_open(port))
        page = watched(f"http://127.0.0.1:{port}")
        for tubes in (1, 2):
            expect(page.locator("#tubes tr")).to_have_count(tubes)
        expect(page.locator("#word")).not_to_have_text("DON'T KNOW")
        os.kill(ground, signal.SIGSTOP)
        expect(page.locator("#word")).to_have_text("DON'T KNOW")
        expect(page.locator("#facts")).to_contain_text("NOT LIVE")
        os.kill(ground, signal.SIGKILL)
        expect(page.locator("#facts")).to_contain_text("live")
        assert rig.pid_of("borechain ground") != ground
        expect(page.locator("#tubes tr")).to_have_count(3)
        expect(page.locator("#plan svg")).to_have_attribute("aria-label", re.compile("ends .* cm off"))


def is_open(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
