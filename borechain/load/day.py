"""A ground station that starts upon what a string has told it in hours of drilling, and is asked for all of it."""

from __future__ import annotations

import contextlib
import json
import socket
import time
import urllib.request
from functools import partial
from pathlib import Path
from typing import Any

from borechain.client import Ground, NoAnswerError
from borechain.load.crowd import DRILLING_S, ROUND_S, SURVEYED_AFTER_S, TUBE_LENGTH, survey_of
from borechain.load.page import ASK_EVERY_S, GROUND, HEARD_WITHIN_S, RIG, ROUNDING, latency_quantiles
from borechain.load.patience import wait_for
from borechain.load.readers import CONNECT_S, read_lines
from groundstation.config import checked_config
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.ground_host import run_ground
from groundstation.service.disk.ground_store import Store
from groundstation.service.string.stored import Stored
from sim.errors import RigError
from sim.rig.processes import ProcessTable, Spec
from sim.rig.realtime_run import cpu_seconds, memory_footprint, running_pids
from telemetry.frozen import replace
from telemetry.media.zenoh_bus import open_router
from telemetry.messages import Stand, SurveyMeasurement
from telemetry.runtime.hosting import Place

EPOCH = 1
BEGUN_AT = 1000.0  # s, of rig time
ADVANCES = 32  # of the bit in all; between two of them the string is surveyed again where it stands
ADVANCE = 0.25  # m, so that tubes pass the stations of those below them
MOMENTS = 100  # that are looked at


def measure_day(hours: float, tubes: int, endpoint: str, page: PageSettings, folder: Path) -> dict[str, Any]:
    """Start a ground station on hours of surveys; return the seconds of its start and of the first answers of its page.

    Raises
    ------
    RigError
        When the ground station does not answer within a minute.
    """
    place = Place(RIG, endpoint, folder)
    settings: dict[str, Any] = {"tube_length": TUBE_LENGTH, "target": TUBE_LENGTH * (tubes + ADVANCES * ADVANCE)}
    stops = max(int(3600.0 * hours / ROUND_S), 1)
    surveys = write_day(checked_config(rig=RIG, folder=place.folder, **settings).url, stops, tubes)
    table = ProcessTable({GROUND: Spec(partial(run_ground, own_clock=True, page=page), (place, settings))}, [])
    try:
        table.warm()
        with open_router(endpoint) as bus:
            begun = time.monotonic()
            table.start(GROUND)
            ground = Ground(bus, RIG)
            moments = wait_for_history(ground)
            started_s, started_cpu_s = time.monotonic() - begun, cpu_seconds(running_pids(table)[GROUND])
            picture_s = first_picture(page)
            looked = [
                answer_seconds(page, f"column?moment={number}")
                for number in moments[:: max(len(moments) // MOMENTS, 1)]
            ]
            return {
                "surveys": surveys,
                "stations": len(ground.stations()),
                "moments": len(moments),
                "started_s": round(started_s, ROUNDING),
                "started_cpu_s": round(started_cpu_s, ROUNDING),
                "picture_ms": round(1e3 * picture_s, ROUNDING),
                "history_ms": round(1e3 * answer_seconds(page, "history"), ROUNDING),
                "moment_ms": latency_quantiles(looked),
                "private_mb": round(memory_footprint(running_pids(table)[GROUND])["private_mb"], ROUNDING),
            }
    finally:
        table.stop()


def write_day(url: str, stops: int, tubes: int) -> int:
    """Fill a database with a survey of every tube in the hole at every stop; returns how many there are."""
    surveys = 0
    with contextlib.closing(Store(url)) as store:
        store.keep_epoch(EPOCH)
        store.keep_tally(list(range(tubes, 0, -1)))
        for stop in range(stops):
            md = depth_of(tubes, stop * ADVANCES // stops)
            stands_at = BEGUN_AT + ROUND_S * stop + DRILLING_S
            store.keep_stand(Stand(EPOCH, stands_at, stands_at + ROUND_S - DRILLING_S, md))
            taken = surveys_at(tubes, md, stop + 1, stands_at + SURVEYED_AFTER_S)
            below = [TUBE_LENGTH * (survey.tube - 1) for survey in taken]
            store.add_messages([Stored(one, md - own, own) for one, own in zip(taken, below, strict=True)])
            surveys += len(taken)
    return surveys


def depth_of(tubes: int, advances: int) -> float:
    """Depth (m) of the bit after some advances; after all of them the last tube has gone down."""
    return max(TUBE_LENGTH * tubes - ADVANCES * ADVANCE, TUBE_LENGTH) + ADVANCE * advances


def surveys_at(tubes: int, md: float, number: int, at: float) -> list[SurveyMeasurement]:
    """Surveys of the tubes that hang in the hole at one stop, at ``at`` (s, rig time)."""
    inside = [tube for tube in up_to(tubes) if TUBE_LENGTH * (tube - 1) < md]
    return [replace(survey_of(tube, number, at, tubes - tube + 1), epoch=EPOCH) for tube in inside]


def up_to(tubes: int) -> range:
    """Numbers of the tubes, the lowest first."""
    return range(1, tubes + 1)


def wait_for_history(ground: Ground) -> list[int]:
    """Numbers of the moments, as soon as the ground station answers."""

    def look() -> list[int] | None:
        with contextlib.suppress(NoAnswerError):
            return [int(moment["moment"]) for moment in ground.ask("history", points=1000)["moments"]]
        return None

    return wait_for(look, "the ground station has not answered", HEARD_WITHIN_S, ASK_EVERY_S)


def first_picture(page: PageSettings) -> float:
    """Seconds from the connection of a browser until the history has come."""
    begun = time.monotonic()
    with contextlib.closing(socket.create_connection((page.host, page.port), CONNECT_S)) as connection:
        connection.sendall(f"GET /api/stream HTTP/1.1\r\nHost: {page.host}\r\n\r\n".encode())
        for line in read_lines(connection, begun + CONNECT_S):
            if line.startswith(b"data: ") and json.loads(line[6:]).get("path") == "history":
                return time.monotonic() - begun
    raise RigError(f"the page has not shown its history within {CONNECT_S:.0f} s")


def answer_seconds(page: PageSettings, path: str) -> float:
    """Return the time (s) that the page takes to answer a request for ``path``."""
    begun = time.monotonic()
    with urllib.request.urlopen(f"{page.url}/api/{path}", timeout=CONNECT_S) as answer:
        answer.read()
    return time.monotonic() - begun
