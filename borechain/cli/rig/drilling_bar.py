"""The bar of a run that is drilled without the crew's screen."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sim.rig.launcher import Tick
    from sim.rig.rig_progress import RigProgress
    from sim.world.world import World


class DrillingBar:
    """Progress bar on stderr."""

    def __init__(self, world: World) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        self._bar = Progress(
            TextColumn("{task.description:<16}"),
            BarColumn(),
            TextColumn("{task.completed:.0f}/{task.total:.0f} s of rig time"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
        self._task = self._bar.add_task("starting", total=world.end - world.begin)

    def __enter__(self) -> Callable[[Tick | RigProgress], None]:
        self._bar.start()
        return self._show

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def _show(self, tick: Tick | RigProgress) -> None:
        self._bar.update(self._task, completed=tick.rig_time - tick.begin, description=tick.phase)
