"""One browser a module; whatever it opens is watched: it asks no other host, and nothing in it fails."""

from __future__ import annotations

import contextlib
import functools
import http.server
import threading
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from install_browser import find_browser
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright
from told_page import STREAM, Files, hear

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
PATIENCE_MS = 30_000.0
DESK = {"width": 1280, "height": 900}
expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Debian's chromium; no longer than a module, since its driver runs a loop beside which no other test has one."""
    path = find_browser()
    assert path is not None, "no browser: run make browser"
    with sync_playwright() as driver, driver.chromium.launch(executable_path=path, args=FLAGS) as browser:
        yield browser


@contextlib.contextmanager
def watching(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Opens pages that are watched."""
    wrong: list[str] = []
    hosts: set[str] = set()
    contexts: list[BrowserContext] = []

    def opened(url: str, **options: Any) -> Page:
        context = browser.new_context(**{"viewport": DESK} | options)
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(PATIENCE_MS)
        page.on("request", lambda request: hosts.add(request.url.split("/")[2]))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.on("console", lambda message: wrong.append(message.text) if "Security Policy" in message.text else None)
        page.goto(url)
        return page

    yield opened
    for context in contexts:
        context.close()
    assert wrong == []
    assert {host.partition(":")[0] for host in hosts} == {"127.0.0.1"}


@pytest.fixture
def watched(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Opens pages that are watched and end with the test."""
    with watching(browser) as opened:
        yield opened


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Files)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


@pytest.fixture
def page(address: str, watched: Callable[..., Page]) -> Page:
    """The page without a ground station, which is told by hand."""
    return tell_by_hand(watched("about:blank#127.0.0.1/127.0.0.1"), address)


@pytest.fixture(scope="module")
def kept_page(address: str, browser: Browser) -> Iterator[Page]:
    """One such page for tests of which each asks a part of its own."""
    with watching(browser) as opened:
        yield tell_by_hand(opened("about:blank#127.0.0.1/127.0.0.1"), address)


def tell_by_hand(page: Page, address: str) -> Page:
    """Open the page at an address so that what it hears is told by hand."""
    page.add_init_script(STREAM)
    page.route("**/api/session", lambda route: route.fulfill(json={"orders": False, "roles": [], "reads": True}))
    page.goto(address)
    page.wait_for_function("window.heard !== undefined")
    hear(page, "hello", {"build": "1", "start": "1", "hole": "H1"})
    return page
