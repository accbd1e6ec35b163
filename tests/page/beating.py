"""A ground station with a page that lives in real time while a browser looks at it."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hand_fed import Rig
from page_client import PASSWORD, free_port
from served import Served, serving

from groundstation.gateway.page.page_settings import PageSettings
from groundstation.gateway.page.passwords import hash_of

BEAT_S = 0.5  # s between two moments of the rig, in which every tube speaks
FROZEN_S = 120.0  # s, at most


@dataclass
class Beating:
    """A rig that lives on by itself while its page is looked at, unless it is told to freeze."""

    served: Served
    page: PageSettings
    _stopped: threading.Event = field(default_factory=threading.Event)
    _beats: threading.Event = field(default_factory=threading.Event)

    def __post_init__(self) -> None:
        """Begin to live."""
        self._beats.set()
        self._thread = threading.Thread(target=self._live)
        self._thread.start()

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://127.0.0.1:{self.page.port}"

    def do(self, act: Callable[[Rig], Any]) -> None:
        """Have something happen to the rig."""
        self.served.do(lambda rig: (act(rig), None)[1])

    @contextlib.contextmanager
    def frozen(self) -> Iterator[None]:
        """A ground station that does nothing at all: its process stands, its connections are open."""
        release = threading.Event()
        self._beats.clear()
        self.served.loop.call_soon_threadsafe(release.wait, FROZEN_S)
        try:
            yield
        finally:
            release.set()
            self._beats.set()

    def end(self) -> None:
        """End the life of the rig."""
        self._stopped.set()
        self._thread.join()

    def _live(self) -> None:
        while not self._stopped.wait(BEAT_S):
            if self._beats.is_set():
                self.do(lambda rig: rig.speak(len(rig.ground.model.string.tally.tubes)))  # a second of rig time


@contextlib.contextmanager
def beating(folder: Path, stops: tuple[float, ...] = (), host: str = "127.0.0.1", **settings: Any) -> Iterator[Beating]:
    """A hole of 20 m after stops with these inclinations (deg), whose page listens on ``host``."""
    page = PageSettings(host, free_port(), passwords={"driller": hash_of(PASSWORD)})
    rig = Rig(folder, target=20.0, **settings)
    rig.run(5.0)
    for stop, inclination_deg in enumerate(stops, 1):
        rig.drill(stop, inclination_deg)
    with serving(rig, page) as served:
        found = Beating(served, page)
        try:
            yield found
        finally:
            found.end()
