"""A hole that leans to north, drilled by hand, and what its crew tells and asks of the setup."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hand_fed import Rig

from groundstation.service.process.ground_process import GroundProcess


def drilled(folder: Path, stops: int = 2, **more: Any) -> Rig:
    """A hole that leans 2 deg to north, as the tube at the bit surveyed it."""
    rig = Rig(folder, target=20.0, **more)
    rig.run(5.0)
    for stop in range(1, stops + 1):
        rig.drill(stop, 2.0)
    return rig


def order(rig: Rig, name: str, **parameters: object) -> str:
    """What became of an order of anna's."""
    texts = {key: str(value) for key, value in parameters.items()}
    return rig.ground.operator.order(name, texts, "anna").detail


def azimuths(rig: Rig) -> list[float]:
    return [row["azimuth_deg"] for row in rig.ask("stations")["stations"]]


def item(rig: Rig, name: str) -> dict[str, Any]:
    return next(row for row in rig.ask("setup")["items"] if row["item"] == name)


def started_again(rig: Rig) -> Rig:
    """The same rig after its ground station was killed: nothing of it is left but its database."""
    settings_ = rig.ground.config
    rig.ground.store.close()
    rig.ground = GroundProcess(settings_)
    rig.run(5.0)
    rig.speak(len(rig.hops))
    return rig
