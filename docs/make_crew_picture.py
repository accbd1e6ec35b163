"""Draw the crew's screen into ``crew.svg``: ``python docs/make_crew_picture.py``, a minute.

It shows wellbore 1 at its sixth stop. Fonts of other hosts are taken out.
"""

from __future__ import annotations

import asyncio
import re
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent)]

from borechain.crew.app import CrewApp  # noqa: E402
from borechain.drilling.inline import InlineRig  # noqa: E402
from sim.rig.ground_settings import ground_settings  # noqa: E402
from sim.rig.scheduler import Scheduler  # noqa: E402
from sim.world.scenario import load_scenario  # noqa: E402
from sim.world.world import World  # noqa: E402

STOPS, SETTLED = 6, 24.0  # s


class InlineSource:
    """A rig in this process as the source of a screen."""

    def __init__(self, rig: InlineRig) -> None:
        self._rig = rig

    def ask(self, path: str, **parameters: object) -> dict[str, Any]:
        """Answer of a path."""
        return self._rig.ask(path, {name: str(value) for name, value in parameters.items()})

    def follow(self, path: str, call: Callable[[str, dict[str, Any]], object]) -> None:
        """Nothing happens any more in this rig."""

    def order(self, name: str, by: str, **parameters: object) -> Any:
        """Order something of the ground station itself."""
        return self._rig.ground.operator.order(name, {key: str(value) for key, value in parameters.items()}, by)


async def draw(rig: InlineRig) -> str:
    """The screen as a picture."""
    app = CrewApp(InlineSource(rig), "rig-1", "anna")
    app.title = "borechain crew"
    async with app.run_test(size=(80, 24)) as pilot:
        await app.workers.wait_for_complete()
        app.paint()
        await pilot.press("a")
        await app.workers.wait_for_complete()
        app.picture.on_answer("alarms", rig.ask("alarms"), app.picture.heard_at)
        app.paint()
        return app.export_screenshot(title="borechain crew")


def self_contained(picture: str) -> str:
    """A picture that loads nothing, and keeps its spaces in every viewer."""
    bare = re.sub(r"@font-face \{.*?\}", "", picture, flags=re.DOTALL)
    bare = bare.replace("&#160;", " ").replace("<svg ", '<svg xml:space="preserve" ', 1)
    bare = re.sub(r"<!-- .*? -->", "", bare)
    return "\n".join(line.rstrip() for line in bare.splitlines() if line.strip()) + "\n"


def drilled(folder: Path) -> InlineRig:
    """The rig, stopped while its string stands."""
    world = World(load_scenario(DOCS.parent / "scenarios" / "wellbore-1.toml", ()), 1)
    rig = InlineRig(world, ground_settings(world), "rig-1", folder)
    scheduler = Scheduler(world, rig.stepper, rig.stepper.follow)
    scheduler.begin()
    stops = [phase.start for phase in world.phases if phase.kind == "stop"]
    scheduler.advance(stops[STOPS - 1] + SETTLED)
    return rig


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as place:
        picture = asyncio.run(draw(drilled(Path(place))))
    (DOCS / "crew.svg").write_text(self_contained(picture))
