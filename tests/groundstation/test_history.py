"""The history of a hole: a moment a stop, the same after a restart, bounded, thinned without losing its peaks."""

import sqlite3
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hand_fed import Rig
from hypothesis import given
from hypothesis import strategies as st

from groundstation.errors import SelectorError
from groundstation.service.answers.thinning import largest_triangles
from groundstation.service.disk.moment_record import DamagedMomentError, moment_of_bytes, moment_to_bytes
from groundstation.service.hole.history import KEPT, History, Moment
from groundstation.service.hole.packed_end import PackedEnd, packed_end
from groundstation.survey.wall.column_deviation import Deviations

STOPS = (0.3, 0.3, 0.3, 1.0, 1.9)  # deg


def drilled(folder: Path) -> Rig:
    rig = Rig(folder, target=20.0)
    rig.run(5.0)
    for stop, inclination_deg in enumerate(STOPS, 1):
        rig.drill(stop, inclination_deg)
    return rig


def test_each_stop_leaves_what_was_known_at_its_end_also_after_a_restart(tmp_path: Path) -> None:
    rig = drilled(tmp_path)
    moments = rig.ask("history")["moments"]
    assert [moment["md_m"] for moment in moments] == [2.0, 4.0, 6.0, 8.0]
    before = rig.ask("column", moment="3")
    assert [row["md_m"] for row in before["stations"]] == [0.0, 2.0, 4.0, 6.0]
    assert before["projection"]["used_percent"] == pytest.approx(22.1, abs=0.1)
    assert moments[2]["used_percent"] == before["projection"]["used_percent"]
    rig.ground.close()
    again = Rig(tmp_path, target=20.0)
    assert again.ask("history")["moments"] == moments
    assert again.ask("column", moment="3")["stations"] == before["stations"]
    for wrong in ("0", "99", "x"):
        with pytest.raises(SelectorError, match=r"parameter moment: expected one of the history.*1, 2, 3, 4"):
            again.ask("column", moment=wrong)
    with pytest.raises(SelectorError, match=r"parameter points: expected a whole number 3..1000"):
        again.ask("history", points="2")
    assert [m["moment"] for m in again.ask("history", points="3")["moments"]][0::2] == [1, 4]
    again.ground.close()


ADJUSTED = {"target": 20.0, "weighting": "adjusted"}


def drilled_with(folder: Path, stops: int, **settings: Any) -> Rig:
    rig = Rig(folder, **settings)
    rig.run(5.0)
    for stop in range(1, stops + 1):
        rig.drill(stop, 0.3 + 0.1 * stop)
    rig.run(2.0)
    return rig


def shown_moments(rig: Rig) -> list[Any]:
    moments = rig.ask("history")["moments"]
    numbers = [str(moment["moment"]) for moment in moments]
    columns = [rig.ask("column", moment=number) for number in numbers]
    return [moments, *([column["stations"], column["ahead"], column["projection"]] for column in columns)]


def standing_levels(rig: Rig) -> list[Any]:
    return [(row["kind"], row["level_percent"]) for row in rig.ask("alarms")["active"]]


def changed_database(folder: Path, *statements: str) -> None:
    with closing(sqlite3.connect(folder / "ground.sqlite")) as database, database:
        for statement in statements:
            database.execute(statement)


def test_what_was_known_of_an_adjusted_hole_is_kept_and_not_worked_out_again(tmp_path: Path) -> None:
    """A moment whose kept bytes say something else says it after a restart too: it comes from the disk."""
    rig = drilled_with(tmp_path, 5, **ADJUSTED)
    before, levels = shown_moments(rig), standing_levels(rig)
    assert [moment["moment"] for moment in before[0]] == [1, 2, 3, 4]
    rig.ground.close()
    again = Rig(tmp_path, **ADJUSTED)
    assert shown_moments(again) == before
    assert standing_levels(again) == levels
    again.ground.close()
    with closing(sqlite3.connect(tmp_path / "ground.sqlite")) as database, database:
        (content,) = database.execute("select content from moments where number = 3").fetchone()
        kept = moment_of_bytes(3, content)
        moved = moment_to_bytes(replace(kept, found=2.0 * kept.found))
        database.execute("update moments set content = ? where number = 3", (moved,))
    other = Rig(tmp_path, **ADJUSTED)
    now, then = (shown[3][0][2]["deviation_cm"] for shown in (shown_moments(other), before))
    assert now == pytest.approx(2.0 * then, rel=1e-6)
    assert shown_moments(other)[4] == before[4]
    other.ground.close()


@pytest.mark.parametrize(
    "statements",
    [
        ["drop table moments", "update meta set value = '4' where name = 'schema'"],
        ["update moments set content = x'00'"],
        ["update moments set content = x''"],
        ["update moments set content = cast(content || x'00' as blob)"],
        ["delete from moments where number > 2"],
    ],
)
def test_a_database_without_moments_or_with_damaged_ones_makes_them_anew(tmp_path: Path, statements: list[str]) -> None:
    rig = drilled_with(tmp_path, 5, **ADJUSTED)
    before = shown_moments(rig)
    rig.ground.close()
    changed_database(tmp_path, *statements)
    for _ in range(2):
        again = Rig(tmp_path, **ADJUSTED)
        assert shown_moments(again) == before
        assert "database" not in again.alarms()
        again.ground.close()


def test_what_rests_on_another_setup_is_made_anew(tmp_path: Path) -> None:
    rig = drilled_with(tmp_path, 5, **ADJUSTED)
    before = shown_moments(rig)
    rig.ground.close()
    other = Rig(tmp_path, **ADJUSTED, collar_inclination_deg=2.0, collar_std_deg=0.01)
    told = shown_moments(other)
    other.ground.close()
    assert [moment["moment"] for moment in told[0]] == [moment["moment"] for moment in before[0]]
    assert told[0][0]["deviation_cm"] > 1.5 * before[0][0]["deviation_cm"]
    again = Rig(tmp_path, **ADJUSTED)
    assert shown_moments(again) == before
    again.ground.close()


def test_of_a_long_hole_that_is_made_anew_fewer_and_fewer_stops_are_worked_out() -> None:
    history, worked_out = History(), []
    for stop in range(1, 1001):
        if history.is_worth(10 * stop):
            worked_out.append(stop)
        history.pass_over()
    assert worked_out[:31] == list(range(1, 32))
    assert 31 < len(worked_out) < 45
    assert worked_out[-1] > 660
    assert 10 * sum(worked_out) < 40_000


@given(st.integers(1, 40), st.integers(-1, 6), st.floats(-1e9, 1e9), st.integers(0, 2**32 - 1), st.data())
def test_a_moment_comes_back_from_its_bytes_and_from_no_others(
    stations: int, parts: int, at: float, seed: int, data: st.DataObject
) -> None:
    lot = np.random.default_rng(seed)
    end = None
    if parts >= 0:
        end = PackedEnd(lot.normal(size=13), lot.normal(size=(parts, 6)).astype(np.float32))
    moment = Moment(7, at, lot.normal(size=(stations, 2)), lot.normal(size=(stations, 6)).astype(np.float32), end)
    content = moment_to_bytes(moment)
    again = moment_of_bytes(7, content)
    assert (again.number, again.at) == (7, at)
    assert np.array_equal(again.where, moment.where)
    assert np.array_equal(again.found, moment.found)
    assert (again.end is None) == (end is None)
    if end is not None and again.end is not None:
        assert np.array_equal(again.end.numbers, end.numbers)
        assert np.array_equal(again.end.parts, end.parts)
    cut = data.draw(st.integers(0, len(content) - 1))
    with pytest.raises(DamagedMomentError):
        moment_of_bytes(7, content[:cut])


def test_the_worst_station_of_a_moment_is_that_of_all_its_rows() -> None:
    lot = np.random.default_rng(5)
    for _ in range(100):
        count = int(lot.integers(1, 9))
        where = np.stack([np.arange(count), lot.uniform(0.01, 0.1, count)], axis=1)
        moment = Moment(1, 0.0, where, lot.normal(size=(count, 6)).astype(np.float32), None)
        assert moment.worst().md == max(moment.rows, key=lambda row: row.ratio).md
        if count > 1:
            assert moment.worst(first=1).md == max(moment.rows[1:], key=lambda row: row.ratio).md


def test_what_follows_from_a_survey_is_published_at_the_next_look(tmp_path: Path) -> None:
    """An alarm of the deviation with the survey that reaches it, a moment with the first survey of the next stop."""
    rig = Rig(tmp_path, target=20.0)
    published: list[str] = []
    rig.ground.listeners.append(published.extend)
    rig.run(5.0)
    seen = []
    for stop, inclination_deg in enumerate(STOPS, 1):
        published.clear()
        rig.drill(stop, inclination_deg)
        seen.append((published.count("history"), len(rig.ground.model.hole.alarms.alarms), "alarms" in published))
        assert {"measurements", "trajectory", "column"} <= set(published)
    assert [moments for moments, _, _ in seen] == [0, 1, 1, 1, 1]
    raised = np.diff([count for _, count, _ in seen], prepend=0) > 0
    assert raised.any()
    assert all(told for (_, _, told), is_new in zip(seen, raised, strict=True) if is_new)
    rig.ground.close()


def straight_down(depths: list[float]) -> Deviations:
    """Deviations of a hole that is where it should be."""
    md, none = np.array(depths), np.zeros((len(depths), 2))
    return Deviations(md, md, none, np.broadcast_to(np.eye(2), (len(depths), 2, 2)), 0.05 + 0.01 * md)


def test_it_never_grows_without_bound_and_keeps_the_newest() -> None:
    history = History()
    row = straight_down([1.0])
    for stop in range(5 * KEPT):
        at = 100.0 * stop
        assert history.begins_stop(1, at) == (stop > 0)
        if stop:
            history.add(row, None)
        history.on_survey(1, at)
        assert not history.begins_stop(1, at + 10.0)
    assert history.begins_stop(2, 0.0)  # rig time began anew
    assert not history.begins_stop(1, 7.0)
    numbers = [moment.number for moment in history.moments]
    assert len(numbers) <= KEPT
    assert numbers == sorted(numbers)
    assert numbers[0] == 1
    assert numbers[-KEPT // 2 :] == list(range(5 * KEPT - KEPT // 2, 5 * KEPT))


@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=300), st.integers(3, 60))
def test_a_thinned_line_keeps_its_ends_and_never_more_than_asked_for(values: list[float], count: int) -> None:
    y = np.array(values)
    kept = largest_triangles(np.arange(len(y), dtype=float), y, count)
    assert kept == sorted(set(kept))
    assert (kept[0], kept[-1]) == (0, len(y) - 1)
    assert len(kept) == min(count, len(y))


@given(st.integers(4, 299), st.integers(5, 60))
def test_a_lonely_peak_stays(place: int, count: int) -> None:
    y = np.zeros(301)
    y[place] = 1.0
    assert place in largest_triangles(np.arange(301.0), y, count)


def test_fewer_than_three_points_are_refused() -> None:
    with pytest.raises(ValueError, match="at least 3 points"):
        largest_triangles(np.zeros(5), np.zeros(5), 2)


def test_moments_keep_their_depths_whatever_stations_come_later() -> None:
    """Depths that a moment has in common with the one before are kept once, below them or between them come more."""
    history, told = History(), []
    for depths in (
        [0.0, 2.0],
        [0.0, 2.0],
        [0.0, 2.0, 4.0],
        [0.0, 2.0, 4.0, 6.0],
        [0.0, 1.0, 2.0, 4.0, 6.0],
        [0.0, 1.0],
    ):
        history.add(straight_down(depths), None)
        told.append([(md, 0.05 + 0.01 * md) for md in depths])
    assert [list(map(tuple, moment.where.tolist())) for moment in history.moments] == told
    same, more = history.moments[0].where, history.moments[1].where
    assert np.shares_memory(same, more)


def test_an_end_that_is_kept_packed_is_the_end_as_it_was(tmp_path: Path) -> None:
    end = drilled(tmp_path).ground.model.hole.projection
    assert end is not None
    kept = packed_end(end).unpacked()
    assert kept.within == pytest.approx(end.within, abs=2e-3)
    assert kept.half_width == pytest.approx(end.half_width, rel=2e-3)
    assert (kept.ends.md, kept.ends.along, kept.limit) == (end.ends.md, end.ends.along, end.limit)
    np.testing.assert_allclose(kept.ends.cov, end.ends.cov)
    np.testing.assert_allclose(kept.measured, end.measured)
