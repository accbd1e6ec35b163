"""The history of a hole: a moment a stop, the same after a restart, bounded, thinned without losing its peaks."""

from pathlib import Path

import numpy as np
import pytest
from hand_fed import Rig
from hypothesis import given
from hypothesis import strategies as st

from groundstation.errors import SelectorError
from groundstation.service.answers.thinning import largest_triangles
from groundstation.service.hole.history import KEPT, History
from groundstation.service.hole.packed_end import packed_end
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
