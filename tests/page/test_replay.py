"""A recording on the page: what was known then, told as such, with its history and its tables."""

import re
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from hand_fed import Rig
from page_client import PageClient, free_port
from playwright.sync_api import Page, expect
from rigs import started
from tapes import write

pytestmark = pytest.mark.process
Open = Callable[..., Page]


def test_a_recording_is_shown_as_what_was_known_then(tmp_path: Path, watched: Open) -> None:
    rig = Rig(tmp_path / "rig", target=20.0)
    rig.run(5.0)
    for stop, inclination_deg in enumerate((0.3, 0.3, 0.3, 1.0, 1.9), 1):
        rig.drill(stop, inclination_deg)
    write(tmp_path / "shift.mcap", rig.ground)
    stations = rig.ask("stations")["stations"]
    rig.ground.close()
    port = free_port()
    words = ("replay", str(tmp_path / "shift.mcap"), "--page", f"127.0.0.1:{port}", "--speed", "max")
    with started(*words) as replay:
        assert replay.stderr.readline() == f"borechain ground: page http://127.0.0.1:{port}\n"
        page = watched(f"http://127.0.0.1:{port}")
        told = "REPLAY of shift.mcap: what was known then; no rig is shown live"
        expect(page.locator("#replay")).to_have_text(told)
        expect(page.locator("#word")).to_have_text("Then: STEER")
        expect(page.locator("#verdict")).to_have_class("dont_know")  # no colour to count on
        expect(page.locator("#facts")).to_contain_text("REPLAY")
        expect(page.locator("#course svg")).to_have_attribute("aria-label", re.compile("after each of 4 stops"))
        with page.expect_download() as download:
            page.click("text=Stations CSV")
        assert download.value.suggested_filename == "rig-1-stations.csv"
        rows = Path(download.value.path()).read_text().splitlines()
        assert rows[0].startswith("station,md_m,inclination_deg,azimuth_deg,")
        assert [float(row.split(",")[1]) for row in rows[1:]] == [2.0, 4.0, 6.0, 8.0, 10.0]
        client = PageClient(port)
        assert client.get("/api/stations").content["stations"] == stations
        assert client.sign_in().status == 403
        replay.send_signal(signal.SIGINT)
        assert replay.wait(60.0) == 0, replay.stderr.read()
