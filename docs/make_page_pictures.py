"""Take the pictures of the page, ``page-*.png``: ``python docs/make_page_pictures.py``, a minute; needs chromium.

They show the demonstration at its fourth stop, at which the hole has left half its tolerance behind it.
"""

from __future__ import annotations

import asyncio
import sys
import tempfile
import threading
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent), str(DOCS.parent / "tests" / "tools")]

from install_browser import find_browser  # noqa: E402
from playwright.sync_api import expect, sync_playwright  # noqa: E402

from borechain.drilling.inline import InlineRig  # noqa: E402
from groundstation.gateway.page.page_settings import PageSettings, open_page_socket  # noqa: E402
from groundstation.gateway.page.passwords import hash_of  # noqa: E402
from groundstation.gateway.page.server import serving_page  # noqa: E402
from sim.rig.ground_settings import ground_settings  # noqa: E402
from sim.rig.scheduler import Scheduler  # noqa: E402
from sim.world.scenario import load_scenario  # noqa: E402
from sim.world.world import World  # noqa: E402

BEAT_S = 0.2  # s between two moments of the rig
PASSWORD = "for a picture"
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking"]
PICTURES: dict[str, dict[str, Any]] = {
    "dark": {"viewport": {"width": 1280, "height": 1520}, "color_scheme": "dark"},
    "sunlight": {"viewport": {"width": 1280, "height": 1520}, "color_scheme": "light"},
    "telephone": {"viewport": {"width": 360, "height": 900}, "color_scheme": "dark"},
}


def scenario(folder: Path) -> Path:
    """The demonstration without what comes after its fourth stop, at which the string stands as long as it takes."""
    for path in (DOCS.parent / "scenarios").glob("demo*"):
        text = path.read_text().replace("tubes = 15", "tubes = 13").replace("stop_s =", "finish_s = 900.0\nstop_s =")
        (folder / path.name).write_text(text)
    return folder / "demo.toml"


def drilled(folder: Path) -> tuple[InlineRig, Scheduler]:
    """The rig, while its string stands after the last survey."""
    world = World(load_scenario(scenario(folder), ()), 1)
    rig = InlineRig(world, ground_settings(world), "K021", folder)
    scheduler = Scheduler(world, rig.stepper, rig.stepper.follow)
    scheduler.begin()
    scheduler.advance(world.phases[-1].start)
    return rig, scheduler


async def live(
    rig: InlineRig, scheduler: Scheduler, page: PageSettings, ready: threading.Event, end: asyncio.Event
) -> None:
    """Serve the page while the rig goes on."""
    async with serving_page(rig.ground, page, open_page_socket(page)):
        at = rig.world.phases[-1].start
        while not end.is_set():
            at += BEAT_S
            scheduler.advance(at)
            ready.set()
            await asyncio.sleep(BEAT_S)


def take_pictures(url: str) -> None:
    """Take one picture after the other; on the first, the alarms are acknowledged and a tube surveys again."""
    with sync_playwright() as driver, driver.chromium.launch(executable_path=find_browser(), args=FLAGS) as browser:
        for name, options in PICTURES.items():
            page = browser.new_page(**options)
            page.goto(url)
            expect(page.locator("#word")).to_have_text("STEER", timeout=60_000)
            expect(page.locator("#tubes tr")).to_have_count(13, timeout=60_000)
            expect(page.locator("#course path, #course polyline").first).to_be_attached(timeout=60_000)
            if name == "dark":
                page.click("#alarm-list .acknowledge >> nth=0")
                page.fill("#who", "anna")
                page.fill("#password", PASSWORD)
                page.click("#sign-now")
                page.click("#survey")
                expect(page.locator("#orders li")).to_have_count(2, timeout=60_000)
            page.evaluate("scrollTo(0, 0)")
            page.screenshot(path=DOCS / f"page-{name}.png", full_page=True)
            page.close()


def main() -> None:
    """Drill, serve and look."""
    with tempfile.TemporaryDirectory() as place:
        rig, scheduler = drilled(Path(place))
        page = PageSettings("127.0.0.1", 18_099, passwords={"driller": hash_of(PASSWORD)})
        loop, ready, end = asyncio.new_event_loop(), threading.Event(), asyncio.Event()
        thread = threading.Thread(target=loop.run_until_complete, args=(live(rig, scheduler, page, ready, end),))
        thread.start()
        try:
            ready.wait()
            take_pictures(page.url)
        finally:
            loop.call_soon_threadsafe(end.set)
            thread.join()
            rig.close()


if __name__ == "__main__":
    main()
