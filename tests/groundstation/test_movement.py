"""Holes that moved between two stops, where stations are fused one by one and where the hole is adjusted in one."""

from collections.abc import Callable
from pathlib import Path

import pytest
from schemas import check_answers, shown_on
from string_passes import BETWEEN_STOPS, Placed, differing, inclination_deg, knowing, passes, result, survey

from groundstation.service.answers.model import RigModel


def fused(tmp_path: Path, measurements: list[Placed], tubes: int) -> RigModel:
    """A ground station that fuses the readings of each station by themselves."""
    return knowing(tmp_path, measurements, tubes, weighting="bayes")


def test_readings_of_a_hole_that_stays_all_count(tmp_path: Path) -> None:
    model = fused(tmp_path, passes(5, lambda _stop, _station: 1.0), 5)
    assert [(s.md, s.count, s.first) for s in model.hole.stations] == [
        (2.0, 5, 0), (4.0, 4, 0), (6.0, 3, 0), (8.0, 2, 0), (10.0, 1, 0),
    ]  # fmt: skip
    assert model.hole.moved == []
    assert [p.md for p in model.hole.trajectory] == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]


def moving(stops: int, at_stop: int) -> list[Placed]:
    """A hole of 1 deg that is at 2 deg from a stop on."""
    return passes(stops, lambda stop, _station: 2.0 if stop >= at_stop else 1.0)


@pytest.mark.parametrize("order", ["from the bit up", "from the top down", "odd tubes first", "even tubes first"])
@pytest.mark.parametrize("stops", [3, 4, 5, 6])
def test_a_hole_that_moved_drops_what_was_read_before(tmp_path: Path, order: str, stops: int) -> None:
    measurements = moving(stops, stops)
    place: dict[str, Callable[[int], tuple[int, int]]] = {
        "from the bit up": lambda tube: (0, tube),
        "from the top down": lambda tube: (0, -tube),
        "odd tubes first": lambda tube: ((tube + 1) % 2, tube),
        "even tubes first": lambda tube: (tube % 2, tube),
    }
    measurements.sort(key=lambda placed: (placed[0].sequence, place[order](placed[0].tube)))
    model = fused(tmp_path, measurements, stops)
    for station, known in enumerate(model.hole.stations):
        assert inclination_deg(model, station) == pytest.approx(2.0, abs=1e-6), known.md
        assert known.first == known.count - 1
    assert sorted(moved.md for moved in model.hole.moved) == [2.0 * n for n in range(1, stops)]
    assert sorted(moved.dropped for moved in model.hole.moved) == list(range(1, stops))


def test_the_evidence_of_a_movement_is_kept(tmp_path: Path) -> None:
    model = fused(tmp_path, moving(4, 4), 4)
    assert model.hole.moved
    for moved in model.hole.moved:
        assert moved.evidence.moved
        assert moved.evidence.own > 10.0
        assert 1 <= len(moved.evidence.neighbours) <= 2
        assert min(moved.evidence.neighbours) > 10.0
        assert moved.at == pytest.approx(4 * BETWEEN_STOPS, abs=5.0)


def test_readings_after_a_movement_count_together(tmp_path: Path) -> None:
    model = fused(tmp_path, moving(6, 5), 6)
    first = model.hole.stations[0]
    assert (first.count, first.first) == (6, 4)
    assert len(first.counting) == 2
    assert inclination_deg(model, 0) == pytest.approx(2.0, abs=1e-6)
    assert {moved.at // BETWEEN_STOPS for moved in model.hole.moved} == {5}


@pytest.mark.parametrize("outlier", [1, 2, 3, 4])
def test_an_outlier_at_one_station_drops_nothing(tmp_path: Path, outlier: int) -> None:
    measurements = passes(5, lambda stop, station: 2.0 if (stop, station) == (5, outlier) else 1.0)
    model = fused(tmp_path, measurements, 5)
    assert model.hole.moved == []
    assert all(known.first == 0 for known in model.hole.stations)
    assert 1.0 < inclination_deg(model, outlier - 1) < 2.0


def test_stations_that_changed_to_different_sides_did_not_move(tmp_path: Path) -> None:
    measurements = passes(5, lambda stop, station: 1.0 if stop < 5 else (2.0 if station % 2 else 0.2))
    assert fused(tmp_path, measurements, 5).hole.moved == []


def test_a_neighbour_that_changed_at_another_stop_is_no_evidence(tmp_path: Path) -> None:
    placed = [(1, 1, 2.0, 1.0), (2, 1, 4.0, 1.0), (2, 2, 4.0, 2.0), (1, 3, 2.0, 2.0)]
    measurements = [(survey(tube, stop, 3 - tube, inclination), md) for tube, stop, md, inclination in placed]
    assert fused(tmp_path, measurements, 2).hole.moved == []
    measurements.append((survey(2, 3, 1, 2.0), 4.0))
    measurements[2] = (survey(2, 2, 1, 1.0), 4.0)
    assert sorted(moved.md for moved in fused(tmp_path, measurements, 2).hole.moved) == [2.0, 4.0]


def halves(moved_from: int) -> list[Placed]:
    """Stops at half and at whole tubes: each reads every second station."""
    return [
        (survey(tube, stop, 4 - tube, 2.0 if stop >= moved_from else 1.0), 2.0 * (4 - tube) + 1.0 * (stop % 2))
        for stop in range(1, 7)
        for tube in (1, 2, 3)
    ]


def test_stations_between_others_do_not_hide_that_the_hole_moved(tmp_path: Path) -> None:
    model = fused(tmp_path, halves(moved_from=5), 3)
    assert sorted(moved.md for moved in model.hole.moved) == [2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    assert [inclination_deg(model, n) for n in range(6)] == pytest.approx([2.0] * 6, abs=1e-6)


def test_a_station_that_was_met_later_changes_no_earlier_decision(tmp_path: Path) -> None:
    between = (survey(1, 9, 1, 1.0), 3.0)
    in_order, early = (fused(tmp_path, m, 4) for m in ([*moving(4, 4), between], [between, *moving(4, 4)]))
    assert sorted(moved.md for moved in in_order.hole.moved) == [2.0, 4.0, 6.0]
    assert differing(result(early), result(in_order)) == []


def test_the_alarms_tell_of_stations_that_moved(tmp_path: Path) -> None:
    model = fused(tmp_path, moving(4, 4), 4)
    check_answers(model)
    view = shown_on(model, "alarms")["moved"]
    assert len(view) == len(model.hole.moved) > 0
    for row, moved in zip(view, model.hole.moved, strict=True):
        assert row == {
            "md_m": moved.md,
            "at_s": moved.at,
            "dropped_measurements": moved.dropped,
            "departure_sigma": moved.evidence.own,
            "neighbours_sigma": list(moved.evidence.neighbours),
        }


def settling(first: int, last: int, by_deg: float) -> list[Placed]:
    """Eight stops of a hole of 1 deg, of which some stations are elsewhere from the seventh on."""
    return passes(8, lambda stop, station: 1.0 + (by_deg if stop >= 7 and first <= station <= last else 0.0))


@pytest.mark.parametrize("by_deg", [-0.3, 0.1, 0.5])
@pytest.mark.parametrize(("first", "last"), [(2, 3), (3, 5), (1, 4)])
def test_an_adjusted_hole_that_moved_is_where_it_is_now(tmp_path: Path, first: int, last: int, by_deg: float) -> None:
    model = knowing(tmp_path, settling(first, last, by_deg), 8)
    bottom = inclination_deg(model, 7)
    for station, known in enumerate(model.hole.stations, 1):
        moved = by_deg if first <= station <= last else 0.0
        assert inclination_deg(model, station - 1) - bottom == pytest.approx(moved, abs=0.02), known.md
    assert [(one.md, one.dropped) for one in model.hole.moved] == [
        (2.0 * station, 7 - station) for station in range(first, last + 1)
    ]
    for one in model.hole.moved:
        assert one.at == pytest.approx(7 * BETWEEN_STOPS, abs=5.0)
        assert one.evidence.own > 10.0
    check_answers(model)
    shown = shown_on(model, "alarms")["moved"]
    assert [row["neighbours_sigma"] for row in shown] == [[]] * (last - first + 1)
    assert len(model.hole.stations[first - 1].counting) == 9 - first - (7 - first)


def test_an_adjusted_hole_that_moved_altogether_is_where_it_is_now(tmp_path: Path) -> None:
    model = knowing(tmp_path, moving(8, 8), 8)
    assert [one.md for one in model.hole.moved] == [2.0 * station for station in range(1, 8)]
    found = [inclination_deg(model, station) for station in range(8)]
    assert found == pytest.approx([2.0] * 8, abs=0.05)


@pytest.mark.parametrize("outlier", [1, 2, 3, 4])
def test_a_single_reading_that_is_off_moves_no_adjusted_hole(tmp_path: Path, outlier: int) -> None:
    """It is the reading that is named, and the station stays where the others see it."""
    model = knowing(tmp_path, passes(5, lambda stop, station: 2.0 if (stop, station) == (5, outlier) else 1.0), 5)
    assert model.hole.moved == []
    assert inclination_deg(model, outlier - 1) == pytest.approx(1.0, abs=0.05)
    examined = model.hole.examined
    assert examined is not None
    assert all(f"tube {6 - outlier}" in one for told in examined.by_subject.values() for one in told)
    assert len(examined.by_subject) == 1
