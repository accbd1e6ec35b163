"""Small rooms of the ground station that no draw had met, by hand: each bound at its value, each way twice."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_signs_of_life import node_state

from groundstation.errors import SurveyError
from groundstation.service.alarms.crew_alarms import CrewAlarms, Times
from groundstation.service.alarms.rig_alarms import RigAlarms
from groundstation.service.disk.row_digest import add_digest, as_read, is_sound
from groundstation.service.hole.collar_doubt import collar_doubt
from groundstation.service.process.station_clock import CLOCK_BACK, StationClock
from groundstation.service.setup.setup_priors import uncertain_direction
from groundstation.service.string.idle_turning import IdleTurning
from groundstation.service.string.message_numbers import MessageNumbers
from groundstation.service.string.tally import Tally
from groundstation.survey.files.dip_columns import inclinations_of_dips
from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.wall.column_plans import Layer
from groundstation.survey.wall.wall_layers import layers_of
from telemetry.frozen import replace
from telemetry.messages import NodeMode, NodeState

DEG, FILE = math.pi / 180.0, Path("wall.toml")


# where tubes are


def test_what_a_string_reaches_and_where_its_tubes_are_is_counted_in_lengths() -> None:
    """Three tubes of 2 m; half a length may be off."""
    tally = Tally(2.0)
    assert (tally.deepest, tally.misfit(1e9, ()), tally.length_below(9)) == (math.inf, "", None)
    tally.restore([9, 8, 7])
    assert tally.deepest == 8.0
    assert [tally.length_below(tube) for tube in (9, 8, 7, 6)] == [4.0, 2.0, 0.0, None]
    assert [tally.below(tube) for tube in (9, 8, 7, 6)] == [[7, 8], [7], [], []]
    assert [tally.above(7, hops) for hops in (0, 1, 2, 3, 4)] == [None, [], [8], [8, 9], None]
    assert (tally.above(9, 1), tally.above(9, 2), tally.above(5, 1)) == ([], None, None)
    assert [tally.tubes_below(md, 5.0) for md in (0.999, 1.0, 2.999, 3.0, 5.0)] == [[9, 8, 7], [8, 7], [8, 7], [7], []]
    assert [tally.place_of(tube) for tube in (9, 8, 7, 6)] == [1, 2, 3, None]


def test_a_depth_fits_the_tubes_within_half_a_length_either_way() -> None:
    tally = Tally(2.0)
    tally.restore([9, 8, 7])
    everyone = {9, 8, 7, 55}
    assert tally.misfit(7.0, everyone) == ""
    assert tally.misfit(7.001, everyone) == "the bit is at 7.00 m, 3 tubes reach 6.00 m"
    assert tally.misfit(3.0, everyone) == ""
    assert tally.misfit(2.999, everyone) == "the bit is at 3.00 m, 3 tubes speak, 2 of them below the collar"
    assert tally.misfit(0.999, {9, 7}) == "the bit is at 1.00 m, 2 tubes speak, 1 of them below the collar"
    assert tally.misfit(1.0, {9, 7}) == tally.misfit(0.0, {9}) == tally.misfit(0.0, ()) == ""
    assert [tally.reaches(md, 2, 2.0) for md in (7.0, 7.001)] == [True, False]
    assert tally.reaches(1e9, 0, 0.0)  # of a tube whose place is not known


def test_tubes_that_change_names_or_are_taken_out_keep_the_places_of_the_others() -> None:
    tally = Tally(2.0)
    tally.restore([9, 8, 7])
    tally.exchange(9, 7)
    assert (tally.tubes, [tally.place_of(tube) for tube in (7, 8, 9)]) == ([7, 8, 9], [1, 2, 3])
    tally.remove(8)
    assert (tally.tubes, tally.place_of(8)) == ([7, 9], None)
    tally.on_hops(6, 0)
    assert (tally.tubes, tally.place_of(6)) == ([7, 9], None)
    for _ in range(2):
        tally.on_hops(6, 1)
        assert tally.tubes == [6, 7, 9]  # 1, 1 and 3 are not complete
    tally.on_hops(7, 2)
    tally.on_hops(5, 9)
    assert tally.tubes == [6, 7, 9, 5]
    tally.on_hops(9, 4)
    tally.on_hops(5, 3)
    assert tally.tubes == [6, 7, 5, 9]


def test_numbers_of_a_series_begin_with_the_shift_of_their_start() -> None:
    numbers = MessageNumbers()
    for number in ((5 << 24) + 1, (5 << 24) + 3):
        numbers.add_number(2, number)
    assert numbers.gap(2) == ((5 << 24) + 2, (5 << 24) + 2)
    assert (numbers.gap(3), numbers.newest(3), numbers.on_told(2, (5 << 24) + 3)) == (None, 0, False)
    numbers.add_number(2, (5 << 24) + 2)
    assert numbers.gap(2) is None
    assert not numbers.on_told(2, (5 << 24) + 5)
    assert numbers.gap(2) == ((5 << 24) + 4, (5 << 24) + 5)


# a string that turns


def turning(at: float, yaw_deg: float) -> NodeState:
    state: NodeState = node_state(1, at, int(at))
    return replace(state, mode=NodeMode.TRACKING, yaw=math.radians(yaw_deg))


def told_after(step_deg: float, apart: float, count: int, bit: float = 3.0) -> str:
    idle = IdleTurning()
    for k in range(count + 1):
        yaw = math.degrees(math.remainder(math.radians(step_deg * k), math.tau))
        idle.on_state(turning(1000.0 + apart * k, yaw), bit)
    return idle.told(bit)


@pytest.mark.parametrize(
    ("step_deg", "apart", "count", "is_told"),
    [
        (20.0, 10.0, 6, True), (20.0, 10.0, 5, False), (20.0, 10.5, 60, False), (5.01, 0.5, 120, True),
        (5.01, 0.5, 119, False), (-5.01, 0.5, 120, True), (4.99, 0.5, 600, False), (360.0, 1.0, 600, False),
        (355.5, 1.0, 600, False), (354.9, 1.0, 60, True),
    ],
)  # fmt: skip
def test_sixty_seconds_of_turning_by_five_degrees_within_ten_seconds_are_told(
    step_deg: float, apart: float, count: int, is_told: bool
) -> None:
    words = "the string turned for 60 s and more while the bit stood at 3.00 m; does the depth stick?"
    assert told_after(step_deg, apart, count) == (words if is_told else "")


def test_a_bit_that_moves_by_a_centimetre_begins_the_minute_anew() -> None:
    for way, is_told in ((0.0099, True), (-0.0099, True), (0.0101, False), (-0.0101, False)):
        idle = IdleTurning()
        for k in range(70):
            bit = 3.0 + (way if k >= 40 else 0.0)
            idle.on_state(turning(1000.0 + k, 30.0 * (k % 12) - 180.0), bit)
        assert (idle.told(bit) != "") == is_told
        assert idle.told(bit + 0.05) == ""


def test_the_minutes_of_two_tubes_are_not_added_and_one_at_rest_is_forgotten() -> None:
    idle = IdleTurning()
    for k in range(41):
        for tube in (1, 2):
            idle.on_state(replace(turning(1000.0 + k, 30.0 * (k % 12) - 180.0), tube=tube), 3.0)
    assert idle.told(3.0) == ""
    idle.on_state(replace(turning(1041.0, 0.0), tube=1, mode=NodeMode.SURVEY), 3.0)
    for k in range(41, 60):
        assert idle.told(3.0) == ""
        for tube in (1, 2):
            idle.on_state(replace(turning(1001.0 + k, 30.0 * (k % 12) - 180.0), tube=tube), 3.0)
    assert idle.told(3.0) != ""  # the other one has turned since 1000 s
    idle.on_state(replace(turning(1063.0, 0.0), tube=2), None)
    assert idle.told(3.0) == ""


# directions


def test_a_direction_is_uncertain_along_its_azimuth_as_the_cosine_and_across_in_full() -> None:
    """At 60 deg a lean changes along by half of what the inclination does."""
    made = uncertain_direction(60.0 * DEG, 90.0 * DEG, 0.02)
    np.testing.assert_allclose(made.lean, [0.0, math.sqrt(0.75)], atol=1e-12)
    assert made.down == pytest.approx(0.5)
    np.testing.assert_allclose(made.cov, [[4e-4, 0.0], [0.0, 1e-4]], atol=1e-12)
    askew = uncertain_direction(60.0 * DEG, 30.0 * DEG, 0.02).cov / 4e-4
    root = math.sqrt(3.0)
    np.testing.assert_allclose(askew, [[7 / 16, -3 * root / 16], [-3 * root / 16, 13 / 16]], atol=1e-12)


def leaning(north_deg: float, east_deg: float, north_std: float, east_std: float) -> Direction:
    lean = np.sin(np.radians([north_deg, east_deg]))
    cov = np.diag([north_std**2, east_std**2])
    return Direction(lean, math.sqrt(1.0 - float(lean @ lean)), cov, np.zeros((2, 0)))


def hole_of(collar: Direction, *stations: tuple[float, Direction]) -> Any:
    made = [SimpleNamespace(md=md, fused=lambda _weighting, one=one: one) for md, one in stations]
    return SimpleNamespace(collar=collar, stations=made)


@pytest.mark.parametrize(("sigmas", "is_told"), [(3.99, False), (4.01, True)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_first_station_contradicts_the_collar_from_four_sigmas_on(sigmas: float, is_told: bool, sign: float) -> None:
    """Variances of the two and of the bend between them add: 3, 4 and 12 mrad are 13 mrad."""
    north = math.degrees(math.asin(sign * sigmas * 0.013))
    collar = leaning(0.0, 0.0, 0.003, 0.003)
    above, first = (0.0, leaning(40.0, 0.0, 1e-4, 1e-4)), (6.0, leaning(north, 0.0, 0.004, 0.004))
    told = collar_doubt(hole_of(collar, above, first, (9.0, leaning(-30.0, 0.0, 1e-4, 1e-4))), 0.002)
    lean, way = abs(north), 0 if sign > 0 else 180
    words = f"the station at 6.0 m contradicts it by 4 sigma: it leans {lean:.2f} deg to {way} deg"
    assert told == (words if is_told else "")
    assert collar_doubt(hole_of(collar, above), 0.002) == ""


# rows, layers, dips


def test_a_row_is_sound_while_no_column_has_changed() -> None:
    row = add_digest({"at": 1.5, "tube": 3, "name": "a"})
    assert is_sound(row)
    assert is_sound({"digest": row["digest"], "name": "a", "tube": 3, "at": 1.5})
    for change in ({"at": 1.5000000000000002}, {"tube": 3.0}, {"name": "b"}, {"more": None}, {"digest": "0" * 16}):
        assert not is_sound(row | change)
    assert is_sound({"at": 1.5, "digest": None})
    assert is_sound({"at": 1.5})
    assert [repr(as_read(value)) for value in (-0.0, 0.0, np.float64(2.5), 3)] == ["0.0", "0.0", "2.5", "3.0"]


def test_layers_of_a_wall_go_down_each_with_its_radius_or_that_of_the_wall() -> None:
    tables = [{"from_m": -1.0, "radius_cv": 0.5}, {"from_m": 4, "radius_m": 0.75}, {"from_m": 4.5, "radius_cv": 0.0}]
    assert layers_of(FILE, tables, 0.1) == (
        Layer(-math.inf, None, 0.1), Layer(-1.0, None, 0.5), Layer(4.0, 0.75, 0.1), Layer(4.5, None, 0.0),
    )  # fmt: skip
    assert layers_of(FILE, [], 0.2) == (Layer(-math.inf, None, 0.2),)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"from_m": 1.0}, "layer: expected tables"), ([1.0], "layer: expected tables"),
        ([{"from_m": 1.0, "depth": 2.0}], "layer 1: depth: unknown key"), ([{"radius_m": 1.0}], "layer 1: from_m is"),
        ([{"from_m": 1.0}, {"from_m": 1.0}], "layer 2: expected from_m beyond 1 m, got 1 m"),
        ([{"from_m": 1.0, "radius_m": 0.0}], "layer 1: radius_m: expected a positive number, got 0.0"),
        ([{"from_m": 1.0, "radius_m": -0.1}], "layer 1: radius_m: expected a positive"),
        ([{"from_m": 1.0, "radius_cv": -0.1}], "layer 1: radius_cv: expected a positive"),
        ([{"from_m": 1.0, "radius_cv": 0.501}], "layer 1: radius_cv: expected at most 0.5, got 0.501"),
        ([{"from_m": True}], "layer 1: from_m: expected a positive number, got True"),
        ([{"from_m": math.inf}], "layer 1: from_m: expected"), ([{"from_m": "1"}], "layer 1: from_m: expected"),
    ],
)  # fmt: skip
def test_another_layer_is_refused_by_its_number_and_key(tables: Any, words: str) -> None:
    with pytest.raises(SurveyError) as caught:
        layers_of(FILE, tables, 0.1)
    assert str(caught.value).startswith(f"{FILE}: {words}")


def test_a_dip_is_what_lacks_to_a_right_angle_and_a_format_says_which_way_is_up() -> None:
    lines = [4, 5, 7]
    down = np.array([90.0, 30.0, 0.0])
    for dips in (down, -down):
        np.testing.assert_array_equal(inclinations_of_dips(FILE, "Dip", dips, lines, signed=False), [0.0, 60.0, 90.0])
    rises = inclinations_of_dips(FILE, "Dip", np.array([90.0, -90.0, -10.0]), lines, signed=True)
    np.testing.assert_array_equal(rises, [0.0, 180.0, 100.0])
    with pytest.raises(SurveyError, match=r"^wall\.toml: line 7: Dip: expected a dip of -90\.\.90 deg, got -90\.5$"):
        inclinations_of_dips(FILE, "Dip", np.array([90.0, 90.0, -90.5]), lines, signed=True)
    with pytest.raises(SurveyError, match=r"Dip: expected dips of one sign, got -2 and 30 deg$"):
        inclinations_of_dips(FILE, "Dip", np.array([30.0, -2.0, 0.0]), lines, signed=False)


# a clock that steps back


def test_a_clock_that_steps_back_is_told_once_for_each_step_by_all_of_it() -> None:
    alarms = RigAlarms()
    clock = StationClock(alarms, lambda: 1.7e9)
    assert clock.times_at(3.0, 4.0) == Times(3.0, 4.0, 1.7e9)
    told = []
    for shown, time in ((100.0, 100.0), (99.0, 99.0), (98.999, 100.0), (99.5, 100.501), (50.0, 100.501)):
        assert clock.follow(shown) == pytest.approx(time)
        for _ in range(2):
            clock.look()
        told.append([(one.kind.code, one.subject, one.detail, one.count) for one in alarms])
    first = (CLOCK_BACK, "clock", "it stepped back by 1.0 s; times go on from where they were", 1)
    second = (CLOCK_BACK, "clock", "it stepped back by 49.5 s; times go on from where they were", 2)
    assert told == [[], [], [first], [first], [second]]
    crew = CrewAlarms()
    crew.utc = 2000.0
    clock.look_at_date(crew, 2000.0)
    assert len(list(alarms)) == 1
    clock.look_at_date(crew, 1900.0)
    (dated,) = [one for one in alarms if one.subject == "date"]
    assert (dated.detail, crew.utc) == ("the date of its machine is 100 s before one that was", 1900.0)
