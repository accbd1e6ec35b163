"""Figures of rigs under every fault of the gauntlet, a few in each rig: what was sent, and all that the crew is shown.

Firmware, links, disks and ground station run as they do in a rig of processes; every frame is made of bytes.
"""

from __future__ import annotations

import datetime
import json
import random
import re
import tempfile
import zlib
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from sealed_string import make_folder
from seeded_nodes import weighed

from borechain.drilling.inline import InlineRig
from borechain.gauntlet.gauntlet_rig import PLANS, WORLDS, make_ready, new_rig
from borechain.gauntlet.gauntlet_run import ALL, ANSWERED_AFTER
from groundstation.service.answers.answer_table import ANSWERS
from sim.gauntlet.fault_kinds import SEALED
from sim.gauntlet.plan import steps_of
from sim.rig.in_process import InProcessStepper
from sim.rig.stepper import Answer, FrameEvent
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.errors import BorechainError

FIGURES = Path(__file__).parents[1] / "data" / "seeded_rigs.json"
PLAN, TOGETHER, FIRST = "calmed", 6, 3  # kinds of faults of one rig; seed of the first, all in the same world
PLAIN = [kind for kind in ALL if kind not in SEALED]  # the others need a rig with keys
COUNT = -(-len(PLAIN) // TOGETHER)
RIGS = {FIRST + WORLDS * k: PLAIN[k::COUNT] for k in range(COUNT)}
# of these a last digit changes the whole, or the time of day, or the lot by which a node without memory is numbered
LEFT_OUT = "sha256", "hash", "digest", "seal", "key", "utc", "age_s", "sequence", "numbered", "detail"
NUMBER = re.compile(r"\d+(\.\d+)?")
NOT_ASKED = "column", "setup"  # a second of drawing; ages by the time of day


class Traffic:
    """Counts what the processes of a rig send: frames, their bytes, and when."""

    def __init__(self, stepper: InProcessStepper) -> None:
        self.sent: dict[str, list[tuple[float, int]]] = defaultdict(list)
        self._round: Callable[..., dict[int, Answer]] = stepper.round
        stepper.round = self.round  # type: ignore[method-assign]

    def round(self, steps: Mapping[int, list[FrameEvent]]) -> dict[int, Answer]:
        """A round of the rig, whose frames are noted."""
        answers = self._round(steps)
        for address, answer in answers.items():
            for sent, frame in answer.frames:
                self.sent[f"{address} {sent.side.name.lower()}"].append((sent.at, len(bytes(frame))))
        return answers


def leaves_of(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Every word and number of an answer with its path."""
    if isinstance(value, dict):
        for name, inner in value.items():
            if not any(word in name for word in LEFT_OUT):
                yield from leaves_of(inner, f"{path}.{name}")
    elif isinstance(value, list | tuple):
        for k, inner in enumerate(value):
            yield from leaves_of(inner, f"{path}[{k}]")
    else:
        yield path, value


def figures_of(seed: int) -> dict[str, Any]:
    """What the rig of a seed sent and what its ground station shows at the end."""
    chosen = PLANS[PLAN]
    make_ready(PLAN, [seed])
    with tempfile.TemporaryDirectory(prefix="seeded-") as folder:
        rig = new_rig(PLAN, seed, Path(folder))
        traffic = Traffic(rig.stepper)
        begin, until = rig.world.begin + chosen.rested, rig.world.end - chosen.calm
        steps = steps_of(seed, RIGS[seed], begin + chosen.after_begin, until, recovers=not chosen.calm)
        rig.drill([step for _, step in steps], until=until)
        rig.repair()
        for after in ANSWERED_AFTER:
            rig.advance(until + after)
            rig.answer_alarms()
        rig.advance(rig.world.end)
        found = shown_by(rig.inline, traffic, begin)
        rig.close()
    return found


def sealed_figures() -> dict[str, Any]:
    """The same of a rig under keys, whose joints round what is cyclic, without a fault."""
    world = World(scenario_of(dict(PLANS["minute"].tables)), FIRST)
    lots = random.Random(FIRST)
    with tempfile.TemporaryDirectory(prefix="seeded-") as place:
        keys = make_folder(Path(place) / "keys", now=datetime.datetime.now(datetime.UTC))
        settings = PLANS["minute"].settings
        rig = InlineRig(world, settings, "rig-1", Path(place), lots.randrange, native=True, keys=keys)
        traffic = Traffic(rig.stepper)
        rig.run()
        found = shown_by(rig, traffic, world.begin)
        rig.close()
    return found


def shown_by(rig: InlineRig, traffic: Traffic, begin: float) -> dict[str, Any]:
    """Figures of a rig that has drilled since ``begin`` (s)."""
    shown = {path: answer_of(rig, path) for path in paths()}
    events = [[e["tube"], e["code"], e["severity"], round(e["at_s"] - begin, 2)] for e in shown["events"]["events"]]
    sent = {end: [len(frames), *weighed(frames)] for end, frames in sorted(traffic.sent.items())}
    return {"events": events, "sent": sent, "shown": {name: sums_of(answer) for name, answer in shown.items()}}


def paths() -> Iterator[str]:
    """Every path that the ground station answers, with numbers that there are and one that there is not."""
    for pattern in ANSWERS:
        if "{" not in pattern and pattern not in NOT_ASKED:
            yield pattern
        for number in (1, 2, 9) if "{" in pattern else ():
            yield pattern.replace("{tube}", str(number)).replace("{n}", str(number))


def answer_of(rig: InlineRig, path: str) -> dict[str, Any]:
    """What the ground station answers, or why it does not."""
    try:
        return rig.ask(path)
    except BorechainError as error:
        return {"refused": str(error)}


def sums_of(answer: Mapping[str, Any]) -> list[float]:
    """Figures of the numbers of an answer, and a checksum of its names and words, without the numbers in these."""
    numbers, words = [], []
    for path, value in leaves_of(answer):
        is_number = isinstance(value, int | float)
        numbers += [float(value)] if is_number else []
        words.append(path if is_number else NUMBER.sub("#", f"{path} {value}"))
    return [*weighed(numbers), zlib.crc32("\n".join(words).encode())]


def everything() -> dict[str, Any]:
    """Figures of all rigs."""
    return {str(seed): figures_of(seed) for seed in RIGS} | {"sealed": sealed_figures()}


if __name__ == "__main__":
    lines = (f" {json.dumps(name)}: {json.dumps(found)}" for name, found in everything().items())
    FIGURES.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
