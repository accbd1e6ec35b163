"""What the ground station makes of a setup, orders and stations seen twice: each sum of unequal parts, each bound."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_resolved_stops import stops_of

from groundstation.config import GroundConfig
from groundstation.service.hole.history import SAME_STOP, History
from groundstation.service.hole.movement import Movement
from groundstation.service.hole.resolved_stops import ResolvedStops
from groundstation.service.hole.station import SurveyStation
from groundstation.service.orders import surveyed_biases as biases_room
from groundstation.service.orders.order_book import OrderBook, OrderState, SentOrder
from groundstation.service.orders.recalibration.solution import propose_bias
from groundstation.service.orders.uploads import Uploads
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_correction import corrected_yaw, depth_shift
from groundstation.service.setup.setup_items import JOINT_STD
from groundstation.service.setup.setup_priors import uncertain_direction
from groundstation.service.setup.told_value import DRIVE, SetupKind, ToldValue
from groundstation.survey.fusion.force_biases import ForceBias
from groundstation.survey.fusion.fusion import DEPARTED, Departure, judge_departure
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR
from groundstation.survey.fusion.trust_level import Trust
from groundstation.survey.wall.column_deviation import Deviations
from telemetry.application.commands import find_command
from telemetry.messages import BlockStatus, NodeFlag, UploadPhase
from telemetry.parameters import ParameterBlock, SensorParameters


def joint(pair: str, correction: float, sigma: float, used: float | None = None) -> ToldValue:
    values = (correction,) if used is None else (correction + used,)
    return ToldValue(1, SetupKind.JOINT, pair, values, sigma, "anna", "", used=used)


def test_a_joint_that_was_not_told_once_was_not_told_whatever_comes_after(tmp_path: Path) -> None:
    book = SetupBook(GroundConfig(folder=tmp_path))
    for tube in (4, 3, 2):
        book.on_flags(tube, 5 - tube, NodeFlag.LOWER_UNTOLD)
    for tube in (4, 3, 2):
        book.on_flags(tube, 5 - tube, NodeFlag.NONE)
    assert [book.was_untold(pair) for pair in ((4, 3), (3, 2), (2, 1), (1, 9))] == [True, True, True, True]
    book.on_flags(1, 4, NodeFlag.NONE)
    assert not book.was_untold((1, 9))


def test_the_second_look_at_north_and_stick_up_keeps_its_own_value_and_sigma(tmp_path: Path) -> None:
    book = SetupBook(
        GroundConfig(
            folder=tmp_path, north_deg=10.0, north_std_deg=0.5, north_check_deg=10.3, north_check_std_deg=0.8,
            stick_up_m=0.4, stick_up_std_m=0.01, stick_up_check_m=0.42, stick_up_check_std_m=0.03,
        )
    )  # fmt: skip
    told = [book.standing(kind) for kind in (SetupKind.NORTH, SetupKind.STICK_UP)]
    again = [book.check_of(kind) for kind in (SetupKind.NORTH, SetupKind.STICK_UP)]
    numbers = [(one.values[0], one.sigma) for one in (*told, *again) if one is not None]
    rad = math.radians
    expected = [(rad(10.0), rad(0.5)), (0.4, 0.01), (rad(10.3), rad(0.8)), (0.42, 0.03)]
    assert numbers == [pytest.approx(pair) for pair in expected]


def test_each_joint_of_a_chain_adds_its_own_error_to_a_yaw(tmp_path: Path) -> None:
    """Tube 1 under 2, 3, 4 and 5: one joint told here, one told to the node and corrected, one nowhere, two marked."""
    book = SetupBook(GroundConfig(folder=tmp_path))
    book.joints = {(2, 1): joint("2-1", 0.3, 0.02), (3, 2): joint("3-2", 0.1, 0.05, used=0.04)}
    for tube, hops in ((5, 1), (4, 2), (3, 3), (2, 4), (1, 5)):
        book.on_flags(tube, hops, NodeFlag.LOWER_UNTOLD if tube in (4, 2) else NodeFlag.NONE)
    chain = [(2, 1), (3, 2), (4, 3), (5, 4), (DRIVE, 5)]
    turn, var = corrected_yaw(UNKNOWN_YAW_VAR + 1e-4, chain, book)
    assert turn == pytest.approx(book.joints[(2, 1)].correction + book.joints[(3, 2)].correction)
    assert var == pytest.approx(0.05**2 + 1e-4 + 3 * JOINT_STD**2 + UNKNOWN_YAW_VAR + 0.02**2)


def length(tube: int, metres: float) -> ToldValue:
    return ToldValue(1, SetupKind.LENGTH, str(tube), (metres,), 0.001, "anna", "")


def test_a_tube_hangs_higher_by_the_stick_up_and_by_what_tubes_below_it_are_longer(tmp_path: Path) -> None:
    book = SetupBook(GroundConfig(folder=tmp_path))
    book.stick_up = 0.25
    assert depth_shift(2, [3, 2, 1], 2.0, book) == -0.25
    book.lengths = {3: length(3, 2.4), 2: length(2, 2.2), 1: length(1, 2.1)}
    shifts = [depth_shift(tube, [3, 2, 1], 2.0, book) for tube in (3, 2, 1, 9)]
    assert shifts == [pytest.approx(shift) for shift in (-0.2 - 0.1 - 0.25, -0.1 - 0.25, -0.25, -0.25)]


@pytest.mark.parametrize("inclination_deg", [0.0, 20.0, 60.0])
@pytest.mark.parametrize("azimuth_deg", [0.0, 70.0])
def test_a_direction_known_each_way_alike_is_known_less_along_its_lean(
    inclination_deg: float, azimuth_deg: float
) -> None:
    """A lean is the sine of the inclination: it changes by its cosine."""
    inclination, azimuth = math.radians(inclination_deg), math.radians(azimuth_deg)
    cov = uncertain_direction(inclination, azimuth, 0.01).cov
    along = np.array([math.cos(azimuth), math.sin(azimuth)])
    across = np.array([-along[1], along[0]])
    assert along @ cov @ along == pytest.approx((0.01 * math.cos(inclination)) ** 2)
    assert across @ cov @ across == pytest.approx(0.01**2)
    assert along @ cov @ across == pytest.approx(0.0, abs=1e-12)


def test_a_status_of_another_tube_says_nothing_of_an_order() -> None:
    book = OrderBook()
    spec = find_command("upload_parameters")
    book.add(SentOrder(5, spec, 1, {}, "anna", 10.0, "2026-05-04T06:00:00Z"))

    def status(tube: int, phase: UploadPhase) -> BlockStatus:
        return BlockStatus(tube, 5, b"\x01" * 32, phase, 1, 3, b"\x02" * 32, "")

    for ended in (False, True):
        book.on_block_status(status(2, UploadPhase.APPLIED), ended=ended)
        kept = book.get(5)
        assert kept is not None
        assert kept.state is OrderState.SENT
    for _ in range(2):
        book.on_block_status(status(1, UploadPhase.APPLIED), ended=True)
        assert kept.state is OrderState.DONE


def test_the_last_word_on_an_upload_is_said_once() -> None:
    uploads = Uploads(lambda _tube: b"k" * 32)
    block = ParameterBlock(1, 4)
    assert uploads.start(block, 9, 0.0) is None
    assert uploads.due_segments(0.0)
    applied = BlockStatus(1, 9, block.sha256(), UploadPhase.APPLIED, 1, 4, block.sha256(), "")
    assert [uploads.on_status(applied) for _ in range(2)] == [True, False]
    assert (uploads.next_due(), uploads.due_segments(1e6), uploads.cancel(1)) == (math.inf, [], None)


def test_a_bias_is_told_with_its_sigmas_as_the_block_turns_them() -> None:
    matrix = ((2.0, 0.0, 0.0), (0.0, 3.0, 0.0), (0.0, 0.0, 5.0))
    before = ParameterBlock(1, 4, accelerometer=SensorParameters(matrix=matrix, bias=(0.1, 0.2, 0.3)))
    cov = np.diag([0.01**2, 0.02**2, 0.03**2])
    found = ForceBias(np.array([0.003, 0.004, 0.012]), cov, 7, 0.001, "0" * 64)
    shown = propose_bias(found, before, 10.0, "2026-05-04").found
    assert shown.bias_std == pytest.approx((0.02, 0.06, 0.15))
    assert shown.condition == pytest.approx(3.0)
    assert shown.inclination_before == pytest.approx(0.005 / math.sqrt(2.0) / 10.0)
    assert shown.inclination_after == pytest.approx(math.sqrt(0.01**2 + 0.02**2) / math.sqrt(2.0) / 10.0)


def test_a_moment_gives_back_what_was_known_with_every_entry_in_its_place() -> None:
    history = History()
    offsets = np.array([[0.01, -0.02], [0.03, -0.04]])
    covs = np.array([[[4e-6, 1e-6], [1e-6, 9e-6]], [[16e-6, -2e-6], [-2e-6, 25e-6]]])
    history.add(Deviations(np.array([2.0, 4.0]), np.array([1.9, 3.8]), offsets, covs, np.array([0.1, 0.2])), None)
    rows = history.moments[-1].rows
    assert [(row.md, row.limit) for row in rows] == [(2.0, 0.1), (4.0, 0.2)]
    assert [row.along for row in rows] == pytest.approx([1.9, 3.8], rel=1e-6)
    assert np.allclose([row.offset for row in rows], offsets, rtol=1e-6)
    assert np.allclose([row.cov for row in rows], covs, rtol=1e-6)


def departure(north: float, size: float) -> Departure:
    return np.array([north, 0.0]), size


@pytest.mark.parametrize(
    ("own", "seen", "moved"),
    [
        (departure(1.0, 9.0), [], False),
        (departure(1.0, 9.0), [departure(2.0, 9.0)], True),
        (departure(1.0, 9.0), [departure(2.0, 9.0), departure(2.0, 8.0)], True),
        (departure(1.0, 9.0), [departure(2.0, 9.0), departure(-2.0, 9.0)], False),
        (departure(1.0, 9.0), [departure(2.0, 9.0), departure(2.0, DEPARTED)], False),
        (departure(1.0, DEPARTED), [departure(2.0, 9.0)], False),
        (departure(1.0, DEPARTED + 1e-9), [departure(2.0, DEPARTED + 1e-9)], True),
    ],
)
def test_a_hole_moved_where_every_neighbour_that_can_say_so_does(
    own: Departure, seen: list[Departure], moved: bool
) -> None:
    assert judge_departure(own, seen).moved == moved


def test_a_station_tells_the_mean_of_the_variances_of_the_stops_that_count() -> None:
    station, told = SurveyStation(2.0, ResolvedStops()), (1e-6, 2e-6, 6e-6)
    for number, var in enumerate(told):
        one = stops_of(1, 2 * number, 10.0 * number)
        one.rows["trust"] = Trust.FULL
        one.rows["yaw_var"], one.rows["systematic_var"], one.rows["force_var"] = var, 2.0 * var, 3.0 * var
        station.add_stop(one, 0)
    assert station.mean_variances() == pytest.approx((3e-6, 6e-6, 9e-6))
    station.drops = [1]
    assert station.mean_variances() == pytest.approx((4e-6, 8e-6, 12e-6))
    assert [station.first_before(place) for place in (0, 1, 2, 3)] == [0, 0, 1, 1]


@pytest.mark.parametrize(("later", "counts"), [(-1, False), (0, False), (1, True)])
def test_a_stop_is_revised_by_a_later_message_alone(later: int, counts: bool) -> None:
    station = SurveyStation(2.0, ResolvedStops())
    first, again = stops_of(1, 2, 10.0), stops_of(1, 2, 10.0)
    station.add_stop(first, 0)
    again.rows["sequence"], again.rows["yaw"] = first.rows["sequence"] + later, 2.0
    for _ in range(2):
        assert station.revise_stop(0, again, 0) == counts
        assert (station.stops[0].yaw == 2.0) == counts
        again.rows["sequence"] += int(counts)


def test_what_tubes_say_of_a_station_before_and_after_it_moved_is_of_two_stations() -> None:
    collar, station = SurveyStation(0.0, ResolvedStops()), SurveyStation(2.0, ResolvedStops())
    for number in range(4):
        one = stops_of(1, 2 * number, 10.0 * number)
        one.rows["trust"] = Trust.FULL if number != 2 else Trust.UNKNOWN_YAW
        collar.add_stop(one, 0)
        station.add_stop(one, 0)
    station.drops = [1]
    hole: Any = SimpleNamespace(stations=[collar, station])
    assert [look.station for look in biases_room._looks_of_hole(hole, 9.81)] == [(2.0, 0), (2.0, 1), (2.0, 1)]


@pytest.mark.parametrize("since", [100.0, 104.0, 120.0, 130.0])
def test_stops_of_the_string_are_parted_where_nothing_was_read_for_exactly_so_long(since: float) -> None:
    table = ResolvedStops()
    station = SurveyStation(2.0, table)
    for number, at in enumerate((100.0, 105.0, 105.0 + SAME_STOP, 119.0 + SAME_STOP, 190.0)):
        station.add_stop(stops_of(1, number, at), 0)
    found = Movement(table, [station] * 5)._stops_since(since)
    parts = [[100.0, 105.0], [120.0, 134.0], [190.0]]
    assert [[one.at for one in stop] for stop in found] == parts[0 if since < 120.0 else 1 :]
