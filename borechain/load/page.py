"""A ground station under the load of a shift: tubes that speak, browsers and terminals that look, questions."""

from __future__ import annotations

import contextlib
import itertools
import json
import math
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from borechain.client import Ground, NoAnswerError
from borechain.load.crowd import DRILLING_S, ROUND_S, TUBE_LENGTH, Crowd, crowd_in_thread
from borechain.load.patience import wait_for
from borechain.load.readers import BARE, CONNECT_S, answer_nothing, follow_keys, follow_page
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.ground_host import run_ground
from sim.rig.processes import ProcessTable, Spec
from sim.rig.realtime_run import cpu_seconds, memory_footprint, running_pids
from telemetry.media.zenoh_bus import ZenohBus, open_router
from telemetry.runtime.hosting import Place

RIG = "load"
GROUND = "base"
ASKED = ("verdict", "string", "stations", "trajectory", "column", "alarms", "nodes/1", "uncertainty")
ASK_EVERY_S = 0.05
JOINING_S = 5.0  # that readers are given on top of what is measured
HEARD_WITHIN_S = 60.0
LEFT_WITHIN_S = 30.0
DRILLED_M = 8.0  # at most in a run, however long
READERS = "*-*.json"  # what each of them writes
WEIGH_EVERY_S = 30.0
SPARE_M = 20.0  # of the design below all tubes
ROUNDING = 2


@dataclass(frozen=True, slots=True)
class Load:
    """Load of the ground station."""

    tubes: int = 50
    browsers: int = 3
    terminals: int = 2
    seconds: float = 150.0


def measure_load(load: Load, endpoint: str, page: PageSettings, folder: Path) -> dict[str, Any]:
    """Bear a load, and say what the ground station needed for it and how late news and answers were.

    Raises
    ------
    RigError
        When the ground station does not hear the string, or does not last.
    """
    settings = {"tube_length": TUBE_LENGTH, "target": TUBE_LENGTH * load.tubes + SPARE_M}
    serve = partial(run_ground, own_clock=True, page=page)
    specs = {GROUND: Spec(serve, (Place(RIG, endpoint, folder / "ground"), settings))}
    table = ProcessTable(specs, ["borechain.drilling.preload"])
    try:
        table.warm()
        with open_router(endpoint) as bus:
            crowd = Crowd(load.tubes, bus, RIG, speed_of(load.seconds))
            with crowd_in_thread(crowd, bus, RIG):
                table.start(GROUND)
                ground = Ground(bus, RIG)
                wait_for_all(ground, load.tubes)
                until = time.monotonic() + JOINING_S + load.seconds
                readers = readers_of(load, endpoint, page, until, folder)
                specs |= readers
                for name in readers:
                    table.start(name)
                wait_for_readers(bus, folder, load.browsers + load.terminals)
                cost = ask_until(ground, bus, table, until)
                for name in readers:
                    table.running[name].join(LEFT_WITHIN_S)
                return cost | {
                    "browser_late_ms": latency_quantiles(read_lateness(folder, "browser")),
                    "terminal_late_ms": latency_quantiles(read_lateness(folder, "terminal")),
                    "surveys": crowd.surveys,
                }
    finally:
        table.stop()


def speed_of(seconds: float) -> float:
    """Speed of the bit (m/s) at which every round drills the same whole part of a tube.

    So the nodes of later rounds pass the stations of earlier ones, as in a real hole, and the stations stay as many as
    the depth has room for.
    """
    rounds = math.ceil(seconds / ROUND_S)
    return TUBE_LENGTH / math.ceil(rounds * TUBE_LENGTH / DRILLED_M) / DRILLING_S


def wait_for_all(ground: Ground, tubes: int) -> None:
    """Wait until the ground station knows every tube."""

    def look() -> bool | None:
        with contextlib.suppress(NoAnswerError):
            return len(ground.ask("string")["tubes"]) == tubes or None
        return None

    wait_for(look, f"the ground station has not heard {tubes} tubes", HEARD_WITHIN_S, ASK_EVERY_S)


def wait_for_readers(bus: ZenohBus, folder: Path, count: int) -> None:
    """Wait until each of ``count`` readers has had its first news, and the process that does nothing else answers."""

    def look() -> bool | None:
        have_heard = len(list(folder.glob(READERS))) == count
        return True if have_heard and bus.get(BARE, ASK_EVERY_S) else None

    wait_for(look, "browsers and terminals have not heard the ground station", HEARD_WITHIN_S, ASK_EVERY_S)


def readers_of(load: Load, endpoint: str, page: PageSettings, until: float, folder: Path) -> dict[str, Spec]:
    """Processes of the readers."""
    browsers = {
        f"browser {n}": Spec(follow_page, (page.host, page.port, until, folder / f"browser-{n}.json"))
        for n in range(load.browsers)
    }
    terminals = {
        f"terminal {n}": Spec(follow_keys, (endpoint, RIG, until, folder / f"terminal-{n}.json"))
        for n in range(load.terminals)
    }
    return browsers | terminals | {"bare": Spec(answer_nothing, (endpoint, until))}


def ask_until(ground: Ground, bus: ZenohBus, table: ProcessTable, until: float) -> dict[str, Any]:
    """Ask until a time (s, monotonic): how long answers took, and what the ground station needed meanwhile.

    In turn with it a process is asked that does nothing else: where the machine lets that one wait too, the ground
    station is not to blame.
    """
    pid = running_pids(table)[GROUND]
    begun, cpu = time.monotonic(), cpu_seconds(pid)
    taken: list[float] = []
    bare: list[float] = []
    weighed: list[tuple[float, float]] = []  # s, MB
    stations = unanswered = 0
    for path in itertools.cycle(ASKED):
        asked = time.monotonic()
        if asked >= begun + WEIGH_EVERY_S * len(weighed) or asked >= until:
            weighed.append((round(asked - begun, ROUNDING), round(memory_footprint(pid)["private_mb"], ROUNDING)))
        if asked >= until:
            break
        asked = time.monotonic()
        try:
            answer = ground.ask(path)
        except NoAnswerError:
            unanswered += 1
        else:
            stations = len(answer["stations"]) if path == "stations" else stations
        taken.append(time.monotonic() - asked)
        time.sleep(ASK_EVERY_S)
        asked = time.monotonic()
        if bus.get(BARE, CONNECT_S):
            bare.append(time.monotonic() - asked)
    cpu_percent = 100.0 * (cpu_seconds(pid) - cpu) / (time.monotonic() - begun)
    return {
        "answer_ms": latency_quantiles(taken),
        "unanswered": unanswered,
        "bare_ms": latency_quantiles(bare),
        "stations": stations,
        "cpu_percent": round(cpu_percent, ROUNDING),
        "memory_s_mb": weighed,
    }


def read_lateness(folder: Path, who: str) -> list[float]:
    """Lateness (s) that every reader of a kind has written."""
    found: list[float] = []
    for path in sorted(folder.glob(f"{who}-*.json")):
        found += json.loads(path.read_text())
    return found


def latency_quantiles(seconds: list[float]) -> dict[str, float | None]:
    """Count of the latencies, and their median, 99th percentile and largest in ms."""
    if not seconds:
        return {"count": 0, "p50": None, "p99": None, "max": None}
    p50, p99 = (round(1e3 * float(value), ROUNDING) for value in np.percentile(seconds, (50.0, 99.0)))
    return {"count": len(seconds), "p50": p50, "p99": p99, "max": round(1e3 * max(seconds), ROUNDING)}
