"""A recorder on a real bus: what did not reach it is asked for, and what cannot be had is told."""

import threading
from pathlib import Path

import pytest
from hand_fed import Rig
from served import Served, serving

from groundstation.recording.ground_replay import replay_file
from groundstation.recording.recorder import Recorder
from groundstation.recording.recording_file import Recording
from groundstation.service.process.intake_tape import pack_intake, unpack_intake
from telemetry.media.zenoh_bus import open_client

pytestmark = pytest.mark.slow
INTAKE = "borechain/rig-1/intake"


class Deaf(Recorder):
    """A recorder that hears every third event only."""

    def _arrive(self, key: str, payload: bytes) -> None:
        if key != INTAKE or unpack_intake(payload).number % 3 == 0:
            super()._arrive(key, payload)


def drill(rig: Rig) -> None:
    for stop in (1, 2):
        rig.drill(stop, 0.3)


def recorded(served: Served, recorder: Recorder) -> None:
    """Drill while a recorder runs; a question on its own session is answered after what was published before."""
    thread = threading.Thread(target=recorder.run)
    thread.start()
    served.do(lambda rig: rig.run(2.0))
    served.do(drill)
    recorder.stop()
    thread.join(60.0)


def test_what_did_not_reach_the_recorder_is_asked_for(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "rig", target=20.0)
    with serving(rig) as served, open_client(served.endpoint, timeout=10.0) as bus:
        recorder = Deaf(bus, "rig-1", tmp_path / "run.mcap")
        bus.get("borechain/rig-1/ground/status", 10.0)  # the subscription has arrived by now
        recorded(served, recorder)
        newest, stations = rig.ground.tape.newest, rig.ask("stations")["stations"]
    assert recorder.course.newest == newest
    assert recorder.course.is_whole
    again = replay_file(Recording(tmp_path / "run.mcap"), tmp_path / "again")
    assert (again.missing, again.events) == (0, newest)
    assert again.ground.operator.ask("stations")["stations"] == stations
    again.ground.close()


def test_what_is_not_kept_any_more_is_missing_and_told(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "rig", target=20.0)
    rig.run(5.0)
    rig.ground.tape.events.popleft()
    with serving(rig) as served, open_client(served.endpoint, timeout=10.0) as bus:
        recorder = Recorder(bus, "rig-1", tmp_path / "run.mcap")
        bus.get("borechain/rig-1/ground/status", 10.0)
        events = list(rig.ground.tape.events)
        rig.ground.tape.events.clear()
        for event in (events[0], events[3]):
            recorder._arrive(INTAKE, pack_intake(event))
        recorder.stop()
        course = recorder.run()
    assert (course.first, course.missing, course.is_whole) == (2, 2, False)
    assert [sample.key for sample in Recording(tmp_path / "run.mcap").samples()].count(INTAKE) == 2


def test_the_ground_station_says_what_is_no_number(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "rig")
    with serving(rig) as served, open_client(served.endpoint, timeout=10.0) as bus:
        (reply,) = bus.get(f"{INTAKE}?since=x", 10.0)
    assert reply.error == "parameter since: expected a whole number, got 'x'"
