"""The gauntlet's own judges from plain values: each finds what it is to find at its bound, says it, and nothing else.

An oracle that says nothing finds nothing; a run of it alone does not tell that from a rig without a fault.
"""

import math
from types import SimpleNamespace
from typing import Any

import pytest

from borechain.gauntlet import oracles
from borechain.gauntlet.oracles import find_violations, is_at_place, overlong_queues
from sim.gauntlet.faulty_world import TUBE_LENGTH
from telemetry.application.outbox import LIMIT
from telemetry.messages import NodeFlag
from telemetry.transport.hop import BEST_EFFORT_LIMIT, QUEUE_LIMIT, WINDOW

UNTRUSTED = NodeFlag.YAW_UNTRUSTED


def process(outbox: int, waiting: int) -> Any:
    return SimpleNamespace(endpoint=SimpleNamespace(mail=SimpleNamespace(outbox_size=outbox), waiting=waiting))


def test_a_queue_is_overlong_from_one_beyond_its_limit_on() -> None:
    links = 2 * (QUEUE_LIMIT + WINDOW + BEST_EFFORT_LIMIT)
    processes = {3: process(LIMIT, links), 4: process(LIMIT + 1, links + 1), 5: process(0, links + 2)}
    rig: Any = SimpleNamespace(stepper=SimpleNamespace(processes=processes))
    assert list(overlong_queues(rig)) == [
        f"process 4: {LIMIT + 1} messages wait", f"process 4: {links + 1} payloads wait in its links",
        f"process 5: {links + 2} payloads wait in its links",
    ]  # fmt: skip


def row(tube: int, sequence: int, md: float = 1.0, at: float = 9.0, station: int = 1) -> dict[str, Any]:
    return {"tube": tube, "sequence": sequence, "md_m": md, "station_at_s": at, "station": station}


def test_a_survey_counts_once_by_tube_number_and_time() -> None:
    rows = [row(1, 5), row(2, 5), row(1, 6), row(1, 5, at=9.5)]
    assert list(oracles._each_once(rows)) == []
    assert list(oracles._each_once([*rows, row(2, 5, md=7.0), row(1, 5, at=9.5)])) == [
        "tube 2: survey 5 counts twice", "tube 1: survey 5 counts twice",
    ]  # fmt: skip


def test_a_place_is_of_its_tube_and_within_five_centimetres() -> None:
    assert is_at_place((2, 3.05), [(1, 3.05), (2, 3.0)])
    assert is_at_place((2, 2.95), [(2, 3.0)])
    for other in ((1, 3.0), (2, 3.051), (2, 2.949)):
        assert not is_at_place(other, [(2, 3.0)])
    assert not is_at_place((2, 3.0), [])


def test_every_tube_of_a_rest_is_a_tube_length_above_the_next() -> None:
    assert oracles._nodes([(3, 7.5), (1, 2.0)]) == [
        (1, 7.5), (2, 7.5 - TUBE_LENGTH), (3, 7.5 - 2.0 * TUBE_LENGTH), (1, 2.0),
    ]  # fmt: skip


def phase(kind: str, tube: int, start: float, end: float) -> Any:
    return SimpleNamespace(kind=kind, tube=tube, start=start, end=end)


def world(**more: Any) -> Any:
    """Bit at a tenth of the time: a rest with two tubes at 5 m, a drill, a stop from 6 to 6.1 m."""
    phases = [phase("add", 2, 50.0, 51.0), phase("drill", 2, 51.0, 60.0), phase("stop", 2, 60.0, 61.0)]
    truth = {"inclination_deg": 30.0, "azimuth_deg": 359.0}
    return SimpleNamespace(
        **{
            "phases": phases, "bit_depth": lambda at: 0.1 * at, "end": 70.0, "misled": False, "spoiled": False,
            "deceptions": (), "truth_station": lambda md: truth, **more,
        }
    )  # fmt: skip


def test_a_survey_is_placed_where_its_tube_rested() -> None:
    rests = [(1, 5.0), (2, 5.0 - TUBE_LENGTH), (1, 6.0), (2, 6.0 - TUBE_LENGTH)]
    assert [(tube, round(md, 9)) for tube, md in oracles._rests(world())] == rests
    rows = [row(1, 1, 5.05), row(2, 2, 6.0 - TUBE_LENGTH), row(1, 3, 5.5), row(2, 4, 6.0)]
    assert list(oracles._depths(rows, world())) == [
        "tube 1: survey 3 is placed at 5.500 m", "tube 2: survey 4 is placed at 6.000 m",
    ]  # fmt: skip


def asked(**answers: Any) -> Any:
    return SimpleNamespace(ask=answers.__getitem__)


def station(inclination: float, azimuth: float, along: float, across: float, number: int = 1) -> dict[str, Any]:
    return {
        "md_m": 4.256, "inclination_deg": inclination, "azimuth_deg": azimuth, "sigma_inclination_deg": along,
        "sigma_azimuth_deg": across, "station": number,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("one", "sigmas"),
    [
        (station(30.0, 359.0, 0.1, 0.2), 0.0),
        (station(30.49, 359.0, 0.1, 0.2), 4.9),
        (station(30.51, 359.0, 0.1, 0.2), 5.1),
        (station(29.401, 1.0, 0.2, 0.5), 4.997),  # 3 along and, across north, 4 across
        (station(29.398, 1.0, 0.2, 0.5), 5.01),
        (station(30.0, 357.0, 0.1, 0.39), 5.128),
    ],
)
def test_a_direction_is_counted_in_its_own_sigmas(one: dict[str, Any], sigmas: float) -> None:
    rig: Any = SimpleNamespace(inline=asked(stations={"stations": [one]}), world=world())
    beyond = sigmas > 5.0 + 1e-9
    found = list(oracles._directions(rig))
    assert found == ([f"station at 4.26 m is {sigmas:.1f} sigmas from the truth"] if beyond else [])


def test_an_angle_between_directions_and_which_stations_are_compared() -> None:
    one, other = ({"inclination_deg": i, "azimuth_deg": a} for i, a in ((30.0, 10.0), (60.0, 100.0)))
    # a quarter apart in azimuth: the cosine is the product of those of the inclinations
    cosine = math.cos(math.radians(30.0)) * math.cos(math.radians(60.0))
    assert oracles._angle_off(one, other) == pytest.approx(math.acos(cosine))
    assert oracles._angle_off(one, one | {"inclination_deg": 31.5}) == pytest.approx(math.radians(1.5), rel=1e-6)
    assert oracles._angle_off(one, one) == pytest.approx(0.0, abs=1e-7)
    rows = [
        row(1, 1, station=1),
        row(2, 1, station=1),
        row(1, 2, station=2),
        row(1, 3, station=2),
        row(3, 1, station=3),
    ]
    assert oracles._compared(rows, 3) == {1, 3}
    assert oracles._compared(rows, 4) == {1}
    assert oracles._compared([*rows, row(3, 2, station=3)], 3) == {1}


def test_a_deception_beyond_what_is_stated_is_found_unless_it_is_said() -> None:
    def told(off_deg: float, **change: Any) -> list[str]:
        answers = {
            "adjustment": {"blunders": [], "tubes": [{"smallest_step_mg": 3.0}, {"smallest_step_mg": 10.0}]},
            "verdict": {"doubts": ["setup"]}, "measurements": {"measurements": [row(1, 1), row(2, 1)]},
            "stations": {"stations": [station(30.0 + off_deg, 359.0, 0.1, 0.1)]},
        }  # fmt: skip
        return list(oracles._beyond_reliability(SimpleNamespace(inline=asked(**(answers | change)), world=world())))  # type: ignore[arg-type]

    edge = math.degrees(math.asin(20e-3))
    assert told(0.999 * edge) == []
    assert told(1.1 * edge) == ["station at 4.26 m is off by 22 mg, 10 are said to be found"]
    assert told(5.0, verdict={"doubts": ["setup", "clock"]}) == []
    assert told(5.0, adjustment={"blunders": ["x"], "tubes": [{"smallest_step_mg": 3.0}]}) == []
    assert (
        told(5.0, adjustment={"blunders": [], "tubes": [{"smallest_step_mg": 3.0}, {"smallest_step_mg": None}]}) == []
    )
    assert told(5.0, adjustment={"blunders": [], "tubes": []}) == []
    assert told(5.0, measurements={"measurements": [row(1, 1), row(1, 2)]}) == []
    assert len(told(5.0, verdict={"doubts": []})) == 1


def stop(flags: NodeFlag, sigma_deg: float, tube: int = 3) -> Any:
    return SimpleNamespace(flags=flags, tube=tube, fused_yaw_var=math.radians(sigma_deg) ** 2)


def test_flags_have_their_effect() -> None:
    def told(*stops: Any, counting: list[int] | None = None) -> list[str]:
        places = list(range(len(stops))) if counting is None else counting
        one = SimpleNamespace(stops=list(stops), counting=places, md=4.256)
        return list(oracles._flags(SimpleNamespace(stations=[one])))  # type: ignore[arg-type]

    plain, doubted = stop(NodeFlag.NONE, 0.1), stop(UNTRUSTED, 20.0)
    assert told(plain, plain) == []
    assert told(doubted, doubted) == []
    assert told(plain, stop(NodeFlag.SENSOR_FAULT, 0.1, 7)) == ["tube 7: a survey of a faulty sensor is fused"]
    assert told(stop(UNTRUSTED, 19.9), doubted) == ["station at 4.26 m: untrusted yaws have a sigma of 0.3473 rad"]
    assert told(plain, doubted) == ["station at 4.26 m: an untrusted survey counts beside a trusted one"]
    assert told(plain, doubted, counting=[0]) == []
    assert told() == []


def test_health_is_not_good_while_something_is_told() -> None:
    assert list(oracles._health("good", {"disk", "numbers_lost", "tube_silent"})) == [
        "health is good while ['disk', 'numbers_lost'] stand"
    ]
    assert list(oracles._health("degraded", {"disk"})) == list(oracles._health("good", {"tube_silent"})) == []


def lacking_rig(waits: list[Any] | None = None, waiting: list[Any] | None = None, heard: float = 61.0) -> Any:
    """A stop at 6.1 m with two tubes, of epoch 4; a stand of the bit ended at a rig time."""
    config = SimpleNamespace(survey_after=60.0)
    string = SimpleNamespace(
        time=SimpleNamespace(epoch=4, rig_now=100.0), stops=waits or [],
        depths=SimpleNamespace(stands=[SimpleNamespace(ended_at=at, epoch=k) for at, k in ((heard, 4), (99.0, 3))]),
    )  # fmt: skip
    model = SimpleNamespace(string=string, placement=SimpleNamespace(waiting=waiting or []))
    return SimpleNamespace(world=world(), inline=SimpleNamespace(ground=SimpleNamespace(config=config, model=model)))


def waits(judged: bool, age: float) -> Any:
    return SimpleNamespace(stand=SimpleNamespace(md=6.1), judged=judged, age=lambda epoch, now: age)


def test_what_a_stop_owes_is_missing_unless_it_is_not_due_or_on_its_way() -> None:
    upper = 6.1 - TUBE_LENGTH
    told = f"no survey of tube 2 at {upper:.2f} m, and no alarm of it stands"
    rows = [row(1, 1, 6.1)]
    assert list(oracles._missing(rows, lacking_rig(), set())) == [told]
    assert list(oracles._missing([*rows, row(2, 1, upper)], lacking_rig(), set())) == []
    assert list(oracles._missing(rows, lacking_rig(), {"survey_missing"})) == []
    assert list(oracles._missing(rows, lacking_rig(), {"tube_silent"})) == [told]
    assert list(oracles._missing([], lacking_rig(), set())) == [
        f"no survey of tube 1 at 6.10 m, tube 2 at {upper:.2f} m, and no alarm of it stands"
    ]
    assert list(oracles._missing(rows, lacking_rig([waits(False, 61.9)]), set())) == []
    assert list(oracles._missing(rows, lacking_rig([waits(False, 62.0)]), set())) == [told]
    assert list(oracles._missing(rows, lacking_rig([waits(True, 10.0)]), set())) == [told]


def test_a_survey_after_the_newest_depth_is_on_its_way() -> None:
    """The bit is at 7 m at the end: what a tube says after the last stand is placed there, not at the stop."""
    rig = lacking_rig(waiting=[SimpleNamespace(message=SimpleNamespace(tube=2, station_at=61.5))])
    rig.world.bit_depth = lambda at: 6.1
    assert list(oracles._missing([row(1, 1, 6.1)], rig, set())) == []
    rig = lacking_rig(waiting=[SimpleNamespace(message=SimpleNamespace(tube=2, station_at=61.0))])
    rig.world.bit_depth = lambda at: 6.1
    assert len(list(oracles._missing([row(1, 1, 6.1)], rig, set()))) == 1


@pytest.mark.parametrize(
    ("warned", "misled", "spoiled", "is_told"),
    [
        ({"reference"}, True, False, True),
        ({"joint"}, True, False, True),
        ({"joint"}, False, True, True),
        ({"reference"}, False, True, False),
        ({"joint"}, False, False, False),
        ({"clock"}, True, True, False),
        (set(), True, True, False),
    ],
)
def test_an_alarm_excuses_a_yaw_that_may_be_wrong(warned: set[str], misled: bool, spoiled: bool, is_told: bool) -> None:
    assert oracles._is_told(world(misled=misled, spoiled=spoiled), warned) is is_told


def violations(seen: tuple[str, ...] = (), handled: bool = False, **change: Any) -> list[str]:
    """A rig whose only station is 6 sigmas off, whose only survey is placed nowhere, and twice."""
    survey = row(2, 1, 3.3)
    answers = {
        "alarms": {"rig": [], "rig_cleared": []}, "measurements": {"measurements": [survey, survey]},
        "stations": {"stations": [station(30.6, 359.0, 0.1, 0.1)]}, "status": {"health": "good"},
    } | {key: value for key, value in change.items() if key in ("alarms", "status")}  # fmt: skip
    rig = lacking_rig()
    rig.inline = SimpleNamespace(ask=answers.__getitem__, ground=rig.inline.ground)
    rig.inline.ground.model.hole = SimpleNamespace(stations=[])
    rig.world = world(**{key: value for key, value in change.items() if key in ("misled", "spoiled")})
    rig.disk, rig.repaired = lambda _: SimpleNamespace(handled=handled), False
    rig.stepper = SimpleNamespace(processes={})
    options = {key: value for key, value in change.items() if key.endswith("judged")}
    return find_violations(rig, seen, **options)


def test_all_is_judged_but_what_is_known_to_be_wrong() -> None:
    def kinds(found: list[str]) -> list[str]:
        words = {"twice": "once", "placed": "depth", "sigmas": "direction", "no survey": "missing", "health": "health"}
        return [next(kind for word, kind in words.items() if word in one) for one in found]

    alarms = {"rig": [{"code": "depth_refused"}], "rig_cleared": []}
    cleared = {"rig": [], "rig_cleared": [{"code": "depth_refused"}, {"code": "reference"}]}
    everything = ["once", "depth", "depth", "direction", "missing"]
    assert kinds(violations()) == everything
    assert kinds(violations(depth_can_be_judged=False)) == ["once", "direction"]
    assert kinds(violations(encoder_can_be_judged=False)) == ["once", "depth", "depth", "missing"]
    assert kinds(violations(alarms=alarms)) == ["once", "direction", "health"]
    assert kinds(violations(alarms=cleared)) == ["once", "depth", "depth", "direction"]
    standing = {"rig": [{"code": "reference"}], "rig_cleared": []}
    assert kinds(violations(alarms=standing, misled=True)) == ["once", "depth", "depth", "missing"]
    assert kinds(violations(alarms=standing)) == everything
    # what the crew has seen counts where the database was taken away
    assert kinds(violations(("reference",), handled=True, misled=True)) == ["once", "depth", "depth", "missing"]
    assert kinds(violations(("reference",), handled=False, misled=True)) == everything
