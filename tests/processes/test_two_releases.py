"""A string of two releases: tubes of 94c57f3 and of the present one, in turn, under a ground station of either.

Both rigs drill at the same time, every process on its own clock as at a rig; one is the other in a mirror. In mid-drill
the tube below the encoder is changed for one of the other release, in the folder that it has.
"""

from __future__ import annotations

import contextlib
import json
import math
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from earlier_release import HistoryError, extract_release, started_release
from forked_commands import Command
from rigs import PATIENCE, first_answer, free_endpoint, started

from sim.world.recording import record_sensors, yaw_error
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry import keys
from telemetry.application.depth_source import DepthSource
from telemetry.media.zenoh_bus import QueryReply, ZenohBus, open_router
from telemetry.presentation.msgpack_codec import encode_message

pytestmark = pytest.mark.process
RELEASE, PRESENT = "94c57f3", "present"
START, DEPTHS_EVERY = 25.0, 0.5  # s, in which all processes come up, and between two depths
INCLINATION, AZIMUTH = 3.0, 40.0  # deg, of the straight hole
DONE = "done"
LOSSES = ("survey_", "numbers_", "tube_silent", "same_number", "bad_input", "queue", "clock", "epoch")


@dataclass
class TwoReleases:
    """A rig of two tubes: who is of which release, and how to ask its ground station."""

    folder: Path
    world: World
    bus: ZenohBus
    endpoint: str
    rig: str
    sources: Path
    running: dict[str, Command | subprocess.Popen[str]] = field(default_factory=dict)

    def start(self, name: str, release: str, *words: str) -> None:
        place = ("--clock", "own", "--rig", self.rig, "--endpoint", self.endpoint, "--folder", str(self.folder / name))
        if release == PRESENT:
            self.running[name] = started(*words, *place)
        else:
            self.running[name] = started_release(self.sources, *words, *place)

    def start_surface(self, release: str) -> None:
        self.start("ground", release, "ground", "--tube-length-m", "1", "--target-m", "4")
        counter = ("--counter", f"timed:{self.folder.parent / 'encoder.npy'}")
        self.start("encoder", release, "encoder", *counter, "--above", "base", "--below", "2")

    def start_tube(self, tube: int, release: str) -> None:
        read = self.world.tube_settings(tube)
        angles = [f"--drive-joint-deg={math.degrees(read.drive_joint.angle)}"]
        angles += [f"--lower-joint-deg={math.degrees(read.lower_joint.angle)}"] if tube > 1 else []
        ends = ("--above", "encoder", "--below", "1") if tube > 1 else ("--above", "2")
        imu = ("--imu", f"timed:{self.folder.parent / f'tube-{tube}.npy'}")
        self.start(f"tube-{tube}", release, "node", "--tube", str(tube), *imu, *angles, *ends)

    def end(self, name: str) -> None:
        """Ask a process to end, and see that it does so in silence."""
        process = self.running.pop(name)
        process.terminate()
        assert process.communicate(timeout=PATIENCE) == ("", "")
        assert process.returncode == 0

    def first(self, path: str, fits: Callable[[Any], bool]) -> Any:
        """The first answer of the ground station that fits, while every process lives."""

        def fits_while_all_live(answer: Any) -> bool:
            for name, process in self.running.items():
                assert process.poll() is None, (name, process.communicate())
            return fits(answer)

        return first_answer(self.bus, self.rig, path, fits_while_all_live)

    def order(self, name: str, tube: int) -> QueryReply:
        (reply,) = self.bus.get(f"borechain/{self.rig}/cmd/{name}?tube={tube}", PATIENCE)
        return reply

    def done(self, name: str, tube: int) -> dict[str, Any]:
        """What a tube answers to an order that it obeys."""
        reply = self.order(name, tube)
        assert reply.error is None
        answer: dict[str, Any] = json.loads(reply.payload)
        assert answer["state"] == DONE, answer
        return answer

    def knows_its_yaw(self, tube: int) -> None:
        """Wait until the newest state of a tube has a yaw that it trusts, and compare that with the truth."""
        state = self.first(f"nodes/{tube}", lambda node: not node["stale"] and "yaw_untrusted" not in node["flags"])
        error = yaw_error(self.world, tube, math.radians(state["yaw_deg"]), state["at_s"])
        assert abs(error) < 0.02

    def surveys(self, fits: Callable[[list[dict[str, Any]]], bool]) -> list[dict[str, Any]]:
        """All that its ground station has, once they fit."""
        rows = self.first("measurements", lambda answer: fits(answer["measurements"]))["measurements"]
        return list(rows)

    def event(self, tube: int, code: str) -> dict[str, Any]:
        """The first event of a kind that a tube has told."""

        def told(answer: dict[str, Any]) -> list[dict[str, Any]]:
            return [row for row in answer["events"] if (row["tube"], row["code"]) == (tube, code)]

        return told(self.first("events", lambda answer: bool(told(answer))))[0]

    def losses(self) -> dict[str, str]:
        """Alarms of what did not come or could not be read; what a busy machine does to an encoder's edges is none."""
        rows = self.first("alarms", lambda _: True)["rig"]
        return {row["code"]: row["detail"] for row in rows if row["code"].startswith(LOSSES)}


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Packages of the earlier release."""
    try:
        return extract_release(RELEASE, tmp_path_factory.mktemp(RELEASE))
    except HistoryError as error:
        pytest.skip(f"this clone does not reach back to the release: {error}")


@pytest.fixture
def rigs(sources: Path, tmp_path: Path) -> Iterator[tuple[TwoReleases, TwoReleases]]:
    """One under the present ground station and one under the earlier; the tube of its own release is the lower one."""
    world = World(
        scenario_of(
            {
                "rig": {"tubes": 2, "tubes_at_start": 2, "tube_length_m": 1.0, "depth_at_start_m": 1.0},
                "path": {"straight": {"inclination_deg": INCLINATION, "azimuth_deg": AZIMUTH}},
                "schedule": {"begin_s": time.monotonic(), "add_s": START, "stop_s": 240.0, "blocks": 1},
                "rotation": {"turns": 1.5, "advance_m": 0.8},
                "clocks": {"offset_std_s": 0.0, "drift_std_ppm": 0.0},
            }
        ),
        seed=4,
    )
    record_sensors(world, tmp_path)
    made, over = [], threading.Event()
    with contextlib.ExitStack() as stack:
        for above in (PRESENT, RELEASE):
            endpoint, folder = free_endpoint(), tmp_path / above
            folder.mkdir()
            bus = stack.enter_context(open_router(endpoint))
            rig = TwoReleases(folder, world, bus, endpoint, f"under-{above}", sources)
            stack.callback(kill_all, rig)
            made.append(rig)
        for rig, own, other in ((made[0], PRESENT, RELEASE), (made[1], RELEASE, PRESENT)):
            rig.start_surface(own)
            rig.start_tube(2, other)
            rig.start_tube(1, own)
        source = threading.Thread(target=tell_depths, args=(made, world, over))
        source.start()
        stack.callback(source.join)
        stack.callback(over.set)
        yield made[0], made[1]


def kill_all(rig: TwoReleases) -> None:
    for process in rig.running.values():
        process.kill()
        process.communicate()


def tell_depths(rigs: list[TwoReleases], world: World, over: threading.Event) -> None:
    """The bit's depth, by a source of the present release."""
    publishers = [(DepthSource(), rig.bus.publisher(keys.DEPTH.format(rig=rig.rig))) for rig in rigs]
    while not over.wait(DEPTHS_EVERY):
        now = time.monotonic()
        for source, publisher in publishers:
            publisher.put(encode_message(source.measure(now, world.measured_depth(now))))


def drill(rig: TwoReleases) -> list[dict[str, Any]]:
    """See that both tubes are heard and obey while the string is drilled in; their surveys of the stop."""
    rig.first("status", lambda status: status["tubes"] == 2)
    for tube in (2, 1):
        assert rig.done("timing", tube)["values"]["cycles"] > 0
        rig.knows_its_yaw(tube)
    return rig.surveys(lambda rows: {row["tube"] for row in rows} == {1, 2})


def check_surveys(rig: TwoReleases, rows: list[dict[str, Any]]) -> None:
    """Each tube has surveyed the stop at its own depth, in the hole's direction, believed in full."""
    bit = rig.world.bit_depth(rig.world.end)
    for row in rows:
        assert row["trust"] == "full"
        assert row["md_m"] == pytest.approx(bit - (row["tube"] - 1.0), abs=0.01)
        assert abs(row["inclination_deg"] - INCLINATION) < 4.0 * row["sigma_inclination_deg"]
        assert abs(row["azimuth_deg"] - AZIMUTH) < 4.0 * row["sigma_azimuth_deg"]


def test_tubes_of_two_releases_drill_in_one_string_under_a_ground_station_of_either(
    rigs: tuple[TwoReleases, TwoReleases],
) -> None:
    present, earlier = rigs
    with ThreadPoolExecutor(2) as at_once:
        for rig, rows in zip(rigs, at_once.map(drill, rigs), strict=True):
            check_surveys(rig, rows)
            assert rig.losses() == {}

    # an order that the earlier release does not have is told and costs nothing
    refused = json.loads(present.order("check_board", 2).payload)
    assert (refused["state"], refused["done"]) == ("failed", False)
    assert refused["detail"].endswith("timing, got 'check_board'")
    assert present.done("check_board", 1)["values"]["good"]
    for tube in (1, 2):
        error = earlier.order("check_board", tube).error
        assert error is not None
        assert error.endswith("got 'check_board'")
        assert earlier.done("timing", tube)["values"]["cycles"] > 0

    # the upper tube becomes one of the ground station's own release, in its folder
    newest = {row["tube"]: row["sequence"] for row in present.surveys(lambda _: True)}
    for rig, own in ((present, PRESENT), (earlier, RELEASE)):
        rig.end("tube-2")
        rig.start_tube(2, own)
    assert present.event(2, "saved_state_carried")["arguments"]["layout"].startswith("12-")
    assert "expected layout 12-" in earlier.event(2, "saved_state_lost")["arguments"]["detail"]
    for rig in rigs:
        rig.knows_its_yaw(2)
        rig.done("take_survey", 2)
    # what it had learnt is carried over, so that it surveys at once; the earlier release has to learn it again
    rows = present.surveys(lambda rows: any(row["tube"] == 2 and row["sequence"] > newest[2] for row in rows))
    check_surveys(present, rows)
    for rig in rigs:
        for name in list(rig.running):
            rig.end(name)
