"""Everything that a ground station answers, whole, while three holes are drilled by hand, ordered about and restarted.

Directions and places are calculated again from the angles at which the tubes were held; what a restarted and a replayed
ground station know must be what the first one knew, leaf by leaf.
"""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from full_stops import AZIMUTH_DEG, BUILD_DEG, LEAN_DEG, survey_stop
from hand_fed import Rig
from read_back import check as check_approved
from read_back import compare, leaves, write_anew
from tapes import write
from told_rig import drilled, started_again

from groundstation.errors import GroundError
from groundstation.recording.ground_replay import replay_summary
from groundstation.recording.recording_file import Recording
from groundstation.service.answers.answer_table import ANSWERS
from groundstation.service.answers.csv_tables import table_of
from telemetry.errors import BorechainError
from telemetry.messages import Event, NodeFlag, Severity

STAMP = re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+(?:\+00:00|Z)?")
DRAWN = re.compile(r"\b\d{13,}\b")
OWN = re.compile(r"(setup > items.* > age_s|orders, \d+ rows > order): .*")  # of this machine's clock, or drawn
WALL = """
name = "three holes"
radius_m = 0.60
radius_cv = 0.03
thickness_m = 0.80
length_m = 8.0
depth_step_m = 2
head_sigma_m = 0.005
serial = "R-1"
heads = "heads.csv"
stations = "stations.csv"
"""
PLAN = {
    "inclination_deg": 1.0, "azimuth_deg": 20.0, "tolerance": "30 mm + 1:200",
    "leg": [{"length_m": 3.0}, {"length_m": 5.0, "build_deg_per_m": 0.2, "turn_deg_per_m": 1.0}],
}  # fmt: skip
MORE = (
    ("stations", {"md": "4"}), ("stations", {"md": "2.5..6.5"}), ("trajectory", {"md": "3.25"}),
    ("trajectory", {"md": "1..5"}), ("uncertainty", {"confidence": "0.9"}), ("measurements", {"tube": "2"}),
    ("measurements", {"station": "2..3"}), ("measurements", {"since": "4", "limit": "3"}), ("events", {"tube": "2"}),
    ("events", {"since": "1"}), ("history", {"points": "2"}), ("column", {"moment": "2"}),
)  # fmt: skip
WRONG = (
    ("stations/99", {}), ("station", {}), ("nodes/77", {}), ("stations", {"md": "deep"}), ("stations", {"tube": "1"}),
    ("uncertainty", {"confidence": "1.5"}), ("measurements", {"limit": "0"}), ("measurements", {"station": "9..2"}),
    ("column", {"moment": "99"}), ("orders/99", {}), ("history", {"points": "0"}),
)  # fmt: skip


def full(folder: Path, stops: int = 6) -> Rig:
    """Stops at which every tube surveys; the accelerometer of the third steps at the fifth."""
    rig = Rig(
        folder, target=14.0, design_inclination_deg=1.2, design_azimuth_deg=244.0, tolerance="30 mm + 1:150",
        column_radius=0.55, depth_offset_std=0.004, tube_length_std=0.002, mount_tilt_std_deg=0.03, rig="rig-1",
    )  # fmt: skip
    rig.run(5.0)
    for stop in range(1, stops + 1):
        survey_stop(rig, stop, 0.03)
    rig.run(30.0)
    return rig


def walled(folder: Path) -> Rig:
    """The middle one of three columns; it leans towards the first."""
    (folder / "wall").mkdir()
    (folder / "wall" / "wall.toml").write_text(WALL)
    (folder / "wall" / "heads.csv").write_text("column,north_m,east_m\nH1,0,0\nH2,0.1,0.75\nH3,0.2,1.5\n")
    rows = [f"{name},{md},{lean * md},{azimuth}\n" for name, lean, azimuth in (("H1", 0.05, 80), ("H3", 0.1, 30))
            for md in (0, 4, 8)]  # fmt: skip
    (folder / "wall" / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + "".join(rows))
    rig = Rig(
        folder, target=8.0, wall=folder / "wall" / "wall.toml", hole="H2", curvature_std_deg_per_m=1.0,
        north_std_deg=0.2, collar_std_deg=0.3, rig="rig-1",
    )  # fmt: skip
    rig.run(5.0)
    rig.yaw = 0.4
    for stop in range(1, 4):
        rig.drill(stop, 0.8 + 0.2 * stop)
    return rig


def planned(folder: Path) -> Rig:
    """A hole that leaves its bent plan, whose nodes complain, whose depth jumps and whose crew gives orders."""
    rig = drilled(
        folder, 3, plan=PLAN, column_radius=0.45, rig="rig-1", north_deg=7.5, north_std_deg=0.2, stick_up_m=0.12,
        stick_up_std_m=0.02, collar_inclination_deg=1.1, collar_azimuth_deg=25.0, collar_std_deg=0.4,
        steering_deg_per_m=0.3,
    )  # fmt: skip
    for number, code in enumerate(("queue_full", "restart", "covariance_reset"), 1):
        rig.ground.on_message(Event(2, number, rig.now, Severity.WARNING, code, {"kept": number}), rig.now)
    rig.untold[1] = NodeFlag.LOWER_UNTOLD
    rig.drill(4, 5.0)
    rig.drill(5, 9.0)
    rig.now += 40.0
    rig.run(8.0)
    rig.depth(30.0)
    return rig


ORDERS: tuple[tuple[str, dict[str, object]], ...] = (
    ("north", {"action": "tell", "angle_deg": 11.0, "sigma_deg": 0.3}),
    ("north", {"action": "check", "angle_deg": 11.5, "sigma_deg": 0.25}),
    ("north", {"action": "check", "angle_deg": 17.0, "sigma_deg": 0.1}),
    ("collar", {"action": "tell", "inclination_deg": 1.5, "azimuth_deg": 30.0, "sigma_deg": 0.2}),
    ("collar", {"action": "tell", "inclination_deg": 9.0, "azimuth_deg": 210.0, "sigma_deg": 0.1}),
    ("setup", {"action": "undo"}),
    ("length", {"tube": 2, "length_m": 2.03, "sigma_m": 0.001}),
    ("length", {"tube": 9, "length_m": 2.0, "sigma_m": 0.001}),
    ("stick_up", {"action": "tell", "height_m": 0.25, "sigma_m": 0.01}),
    ("stick_up", {"action": "check", "height_m": 0.24, "sigma_m": 0.02}),
    ("joint", {"tube": 1, "angle_deg": 12.0, "sigma_deg": 0.1}),
    ("joint", {"tube": 1, "angle_deg": 12.0, "sigma_deg": 0.1, "used_deg": 10.0}),
    ("same_number", {"tube": 2, "which": "upper"}),
    ("accept_depth", {"action": "confirm"}),
    ("accept_joints", {"action": "confirm"}),
    ("alarm", {"action": "acknowledge", "number": 1}),
    ("alarm", {"action": "shelve", "number": 1, "minutes": 20}),
    ("alarm", {"action": "unshelve", "number": 99}),
    ("take_survey", {"tube": 1}),
    ("static_record", {"tube": 1, "seconds": 20}),
    ("recalibrate", {"action": "begin"}),
    ("upload_parameters", {"tube": 1, "gyroscope": "a.json", "accelerometer": "b.json"}),
    ("nonsense", {}),
    ("setup", {"action": "undo"}),
    ("setup", {"action": "undo"}),
)


def asked(rig: Rig, path: str, parameters: dict[str, str]) -> dict[str, Any]:
    try:
        return rig.ask(path, **parameters)
    except (GroundError, BorechainError) as error:
        return {"refused": str(error)}


def plain(lines: Iterable[str]) -> Iterator[str]:
    """Lines without times of this machine's clock and numbers that were drawn."""
    return (OWN.sub(r"\1: its own", DRAWN.sub("a number", STAMP.sub("a time", line))) for line in lines)


def paths(rig: Rig) -> Iterator[str]:
    for path in ANSWERS:
        if path == "schema":
            continue
        if "{tube}" in path:
            yield from (path.replace("{tube}", str(tube)) for tube in (1, 2))
        elif path.startswith("orders/"):
            yield from ("orders/1", "orders/4")
        elif "{n}" in path:
            yield from (path.replace("{n}", str(n)) for n in (1, len(rig.ask("stations")["stations"]) - 1))
        else:
            yield path


def answers(rig: Rig, more: bool = True) -> Iterator[str]:
    """Every answer, leaf by leaf; times of this machine's clock are not told."""
    for path in paths(rig):
        yield from plain(leaves(asked(rig, path, {}), path))
        try:
            told = json.loads(rig.ground.operator.ask_json(path))
        except (GroundError, BorechainError):
            continue
        compare(plain(leaves(told)), plain(leaves(json.loads(json.dumps(rig.ask(path))))))
    for path, parameters in (*MORE, *WRONG) if more else ():
        name = f"{path}?{';'.join(f'{key}={value}' for key, value in parameters.items())}"
        yield from plain(leaves(asked(rig, path, parameters), name))


def tables(rig: Rig) -> Iterator[str]:
    """Answers with rows as a spreadsheet has them."""
    for path in ("stations", "trajectory", "measurements", "history"):
        text = table_of(path, ANSWERS[path].fields, rig.ask(path))
        rows = text.splitlines()
        yield f"table {path}: {len(rows)} rows: {STAMP.sub('a time', rows[0])}"
        yield f"last row: {STAMP.sub('a time', rows[-1])}"


def told_full(folder: Path, stops: int = 6) -> Iterator[str]:
    rig = full(folder, stops)
    yield from answers(rig)
    yield from tables(rig)
    rig.ground.close()


def told_walled(folder: Path) -> Iterator[str]:
    rig = walled(folder)
    yield from (line.replace(str(folder), "FOLDER") for line in answers(rig, more=False))
    rig.ground.close()


def told_planned(folder: Path) -> Iterator[str]:
    """Answers, what became of each order, and what the orders changed."""
    rig = planned(folder)
    yield from answers(rig, more=False)
    for name, given in ORDERS:
        texts = {key: str(value) for key, value in given.items()}
        try:
            order = rig.ground.operator.order(name, texts, "anna")
            yield f"order {name} {texts}: {order.state.value}: {order.detail}"
        except (GroundError, BorechainError) as error:
            yield f"order {name} {texts}: refused: {error}".replace(str(folder), "FOLDER")
    rig.run(3.0)
    for path in ("setup", "verdict", "alarms", "orders", "string", "stations", "trajectory", "recalibration", "status"):
        yield from plain(leaves(rig.ask(path), f"then {path}"))
    rig.ground.close()


MADE: dict[str, Callable[[Path], Iterable[str]]] = {
    "station-few": lambda folder: told_full(folder, 3), "station-walled": told_walled, "station-full": told_full,
    "station-planned": told_planned,
}  # fmt: skip
SLOW = ("station-full", "station-planned")


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in MADE])
def test_what_a_ground_station_answers_is_as_approved(tmp_path: Path, name: str) -> None:
    check_approved(name, MADE[name](tmp_path))


@pytest.mark.slow
def test_places_are_those_of_the_angles_at_which_the_tubes_were_held(tmp_path: Path) -> None:
    """Each station leans by its own build to one azimuth; the reading of the tube that stepped is not believed."""
    rig = full(tmp_path)
    rows = rig.ask("stations")["stations"]
    for row in rows:
        station = round(row["md_m"] / 2.0)
        assert row["inclination_deg"] == pytest.approx(LEAN_DEG + BUILD_DEG * station, abs=0.04)
        assert (row["azimuth_deg"] - AZIMUTH_DEG + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=2.0)
    leans = np.radians([0.0, *(LEAN_DEG + BUILD_DEG * k for k in range(1, len(rows) + 1))])  # plumb at the collar
    out = sum(2.0 * math.sin(0.5 * (a + b)) for a, b in itertools.pairwise(leans))
    end = rig.ask("trajectory")["points"][-1]
    assert math.hypot(end["north_m"], end["east_m"]) == pytest.approx(out, abs=0.01)
    rig.ground.close()


KEPT = ("stations", "trajectory", "measurements", "events", "column", "history", "adjustment")
PASSING = re.compile(r"^(utc|revision|rig_time|now|newest)|age_s|> seq")  # of the moment at which it is asked


def lasting(answer: Any) -> Iterator[str]:
    """Lines of what does not depend on when it is asked."""
    return (line for line in plain(leaves(answer)) if not PASSING.search(line))


@pytest.mark.parametrize("make", [walled, pytest.param(planned, marks=pytest.mark.slow)])
def test_a_ground_station_that_is_started_again_answers_what_the_first_one_did(
    tmp_path: Path, make: Callable[[Path], Rig]
) -> None:
    rig = make(tmp_path)
    rig.ground.operator.order("north", {"action": "tell", "angle_deg": "11", "sigma_deg": "0.3"}, "anna")
    rig.run(3.0)
    before = {path: list(lasting(rig.ask(path))) for path in KEPT}
    again = started_again(rig)
    for path in KEPT:
        compare(lasting(again.ask(path)), before[path])
    again.ground.close()


def test_a_recording_replayed_gives_the_stations_verdict_and_alarms(tmp_path: Path) -> None:
    rig = full(tmp_path, 3)
    path = tmp_path / "tape.mcap"
    write(path, rig.ground)
    (tmp_path / "again").mkdir()
    found = replay_summary(Recording(path), tmp_path / "again")
    assert (found["rig"], found["missing"], found["damage"]) == ("rig-1", 0, [])
    compare(leaves(found["stations"]), leaves(rig.ask("stations")["stations"]))
    compare(lasting(found["verdict"]), lasting(rig.ask("verdict")))
    compare(lasting(found["alarms"]), lasting(rig.ask("alarms")["open"]))
    rig.ground.close()


if __name__ == "__main__":
    write_anew(MADE)
