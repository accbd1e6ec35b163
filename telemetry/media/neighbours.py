"""Ports of a process, one for each of its ends, each on the medium that was chosen for it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager

from telemetry.media.media_table import open_medium
from telemetry.media.port import STEPPER, Medium, Port, TubeEnd
from telemetry.messages import Side


def neighbour_ports(medium: Medium, rig: str, address: int, neighbours: Mapping[Side, int]) -> dict[Side, Port]:
    """Ends of the process ``address`` that have a neighbour; what leaves its lower end arrives there at the upper."""
    return {side: medium.open_port(TubeEnd(rig, address, side, other)) for side, other in neighbours.items()}


@contextmanager
def own_ports(
    rig: str, address: int, neighbours: Mapping[Side, int | None], media: Mapping[Side, str]
) -> Iterator[dict[Side, Port]]:
    """Ends of a process with a clock of its own, open inside the context; ends on one medium share it.

    ``neighbours`` holds None where the medium finds the neighbour; ``media`` names the medium of each end.

    Raises
    ------
    MediumError
        When a medium or a port cannot be opened.
    """
    with ExitStack() as stack:
        opened = {text: stack.enter_context(open_medium(text)) for text in dict.fromkeys(media[s] for s in neighbours)}
        yield {
            side: opened[media[side]].open_port(TubeEnd(rig, address, side, other))
            for side, other in neighbours.items()
        }


def stepped_ports(medium: Medium, rig: str, address: int, sides: Iterable[Side]) -> dict[Side, Port]:
    """Ends of the process ``address`` that a stepper joins with others as the schedule wants."""
    return {side: medium.open_port(TubeEnd(rig, address, side)) for side in sides}


@contextmanager
def stepped_ports_on(rig: str, address: int, media: Mapping[Side, str]) -> Iterator[dict[Side, Port]]:
    """Ends of a stepped process on media of their own, open inside the context; the stepper is their neighbour."""
    with own_ports(rig, address, dict.fromkeys(media, STEPPER), media) as ports:
        yield ports
