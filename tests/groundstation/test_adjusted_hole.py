"""A ground station that adjusts the whole hole: what its tubes say about each other, live."""

import math
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hand_fed import Rig
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from schemas import check_answers, shown_on
from string_passes import Placed, inclination_deg, knowing, passes, survey
from test_surveyed_biases import MILLI_G, STOPS, Drilled

from groundstation.config import GroundConfig
from groundstation.service.alarms.verdict import judge_hole
from groundstation.service.alarms.verdict_doubts import known_of
from groundstation.service.alarms.verdict_words import VerdictDoubt, Word
from groundstation.service.answers.adjustment_views import budget_of_toe
from groundstation.service.answers.model import RigModel
from groundstation.service.hole.examined_hole import UNSOLVED
from groundstation.service.hole.hole_adjustment import number_values
from groundstation.survey.adjustment import normal_equations
from groundstation.survey.adjustment.looks import OF_TUBE
from groundstation.survey.adjustment.normal_equations import WIDE
from groundstation.survey.adjustment.tube_biases import bias_of_tube
from groundstation.survey.fusion.fusion import Weighting

ADJUSTED = {"weighting": Weighting.ADJUSTED}
ALIGNED = ADJUSTED | {"mount_tilt_std_deg": 0.01, "accelerometer_bias_std_deg": 0.002}


def blamed(model: RigModel) -> dict[str, list[str]]:
    """What is said to be wrong, by what it is of."""
    assert model.hole.examined is not None
    return model.hole.examined.by_subject


def test_an_honest_hole_has_nothing_wrong(tmp_path: Path) -> None:
    model = knowing(tmp_path, passes(5, lambda _stop, station: 1.0 + 0.1 * station), 5, **ALIGNED)
    assert blamed(model) == {}
    for station in range(5):
        assert inclination_deg(model, station) == pytest.approx(1.1 + 0.1 * station, abs=0.02)


@pytest.mark.parametrize("order", ["from the bit up", "from the top down", "odd tubes first"])
@pytest.mark.parametrize("stops", [6, 7])
def test_a_hole_that_moved_is_said_to_have(tmp_path: Path, order: str, stops: int) -> None:
    """Two stations move before the last stop; whatever order the tubes answer in, it is the same."""
    measurements = passes(stops, lambda stop, station: 2.0 if stop == stops and station in (1, 2) else 1.0)
    place: dict[str, Callable[[int], tuple[int, int]]] = {
        "from the bit up": lambda tube: (0, tube),
        "from the top down": lambda tube: (0, -tube),
        "odd tubes first": lambda tube: ((tube + 1) % 2, tube),
    }
    measurements.sort(key=lambda placed: (placed[0].sequence, place[order](placed[0].tube)))
    model = knowing(tmp_path, measurements, stops, **ALIGNED)
    assert list(blamed(model)) == ["hole"]
    for station in range(stops):
        assert inclination_deg(model, station) == pytest.approx(2.0 if station < 2 else 1.0, abs=0.05), station


@pytest.mark.parametrize("outlier", [1, 2, 3])
def test_an_outlier_at_one_station_moves_no_hole(tmp_path: Path, outlier: int) -> None:
    measurements = passes(5, lambda stop, station: 2.0 if (stop, station) == (5, outlier) else 1.0)
    model = knowing(tmp_path, measurements, 5, **ALIGNED)
    assert blamed(model)
    assert "hole" not in blamed(model)
    assert inclination_deg(model, outlier - 1) == pytest.approx(1.0, abs=0.05)


@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(shuffler=st.randoms(use_true_random=False))
def test_the_same_hole_comes_of_any_order_bit_for_bit(tmp_path: Path, shuffler: random.Random) -> None:
    measurements = passes(4, lambda _stop, station: 1.0 + 0.1 * station)
    shuffled = measurements[:]
    shuffler.shuffle(shuffled)
    one, other = (numbers_of(knowing(tmp_path, m, 4, **ADJUSTED)) for m in (measurements, shuffled))
    assert one == other


def numbers_of(model: RigModel) -> list[Any]:
    assert model.hole.examined is not None
    found = model.hole.examined.adjusted
    return [found.now.tangents.tolist(), found.now.tubes.tolist(), found.covs.tolist()]


def test_raw_sensors_calibrate_themselves_while_they_drill(tmp_path: Path) -> None:
    """Biases of 1 mg at any tool face, mounts of any tilt: the lower tubes are known to some hundredths of a mg."""
    squares = []
    for seed in range(12):
        hole = Drilled(seed)
        config = GroundConfig(folder=tmp_path, mount_std_deg=0.0, play_std_deg=0.001, **ADJUSTED)
        examined = hole.tell(RigModel.begin(config)).hole.examined
        assert examined is not None
        for place, tube in enumerate(examined.tubes):
            one = bias_of_tube(examined.adjusted, place)
            error = (one.bias - hole.biases[int(tube)])[:2]
            squares.append(float(error @ np.linalg.solve(one.cov[:2, :2], error)) / 2.0)
            assert int(tube) > STOPS - 2 or math.sqrt(one.cov[0, 0]) < 0.25 * MILLI_G
    assert np.mean(squares) < 1.3


def test_the_answer_says_what_the_tubes_say_about_each_other(tmp_path: Path) -> None:
    hole = Drilled(3)
    model = hole.tell(RigModel.begin(GroundConfig(folder=tmp_path, mount_std_deg=0.0, **ADJUSTED)))
    shown = shown_on(model, "adjustment")
    assert "adjustment" in check_answers(model)
    assert shown["surveys"] == len(hole.surveys)
    assert [row["tube"] for row in shown["tubes"]] == [1, 2, 3, 4, 5, 6]
    total = math.sqrt(sum(row["sigma_cm"] ** 2 for row in shown["toe"]))
    assert total == pytest.approx(shown["sigma_toe_cm"], rel=0.2)  # the larger of two axes, source by source
    assert [row["sigma_cm"] for row in shown["toe"]] == sorted((row["sigma_cm"] for row in shown["toe"]), reverse=True)
    assert shown["next_stop"]["sigma_cm"] <= shown["next_stop"]["same_face_cm"]
    assert shown["blunders"] == []


def test_an_answer_of_nothing_is_empty(tmp_path: Path) -> None:
    model = RigModel.begin(GroundConfig(folder=tmp_path))
    assert "adjustment" in check_answers(model)
    shown = shown_on(model, "adjustment")
    assert (shown["surveys"], shown["misfit"], shown["tubes"], shown["next_stop"]) == (0, None, [], None)


def test_stations_that_are_fused_one_by_one_are_adjusted_beside(tmp_path: Path) -> None:
    """Where stations are fused one by one, what the tubes say about each other can be asked for all the same."""
    measurements: list[Placed] = passes(4, lambda _stop, _station: 1.0)
    model = knowing(tmp_path, measurements, 4, weighting="bayes")
    assert not model.hole.is_adjusted
    assert shown_on(model, "adjustment")["surveys"] == len(measurements)


def test_what_may_be_one_thing_or_another_makes_the_verdict_unknown(tmp_path: Path) -> None:
    """A tube that is off from its one stop before the last: its accelerometer stepped, or its mount slipped."""
    measurements = passes(5, lambda stop, station: 3.0 if stop == 5 and station == 3 else 1.0)
    model = knowing(tmp_path, measurements, 5, **ADJUSTED, mount_std_deg=0.01)
    assert model.hole.examined is not None
    doubts = [
        doubt for doubt, _ in known_of(model.config, model.string, model.setup, model.hole, model.rig_alarms).doubts
    ]
    assert (VerdictDoubt.CONTRADICTION in doubts) == bool(model.hole.examined.doubts)
    assert blamed(model)


@pytest.mark.parametrize("curvature", [1e-200, 1e-100])
@pytest.mark.parametrize("asked_before", [False, True])
def test_surveys_without_a_solution_stand_for_themselves_and_it_is_said(
    tmp_path: Path, curvature: float, *, asked_before: bool
) -> None:
    """No curvature at all is allowed, so the path has no equations: directions are those of each station alone."""
    measurements = passes(5, lambda _stop, station: 1.0 + 0.1 * station)
    stiff = {"curvature_std_deg_per_m": curvature}
    alone = knowing(tmp_path, measurements, 5, weighting=Weighting.BAYES)
    stuck = knowing(tmp_path, measurements, 5, **ADJUSTED, **stiff)
    if asked_before:
        assert "adjustment" in check_answers(stuck)
    for station in range(5):
        assert inclination_deg(stuck, station) == inclination_deg(alone, station)
    assert shown_on(stuck, "adjustment")["surveys"] == 0
    known = known_of(stuck.config, stuck.string, stuck.setup, stuck.hole, stuck.rig_alarms)
    assert (VerdictDoubt.CONTRADICTION, UNSOLVED) in known.doubts
    assert judge_hole(known).word is Word.DONT_KNOW


def test_it_is_an_alarm_that_surveys_have_no_solution_until_they_have(tmp_path: Path) -> None:
    rig = Rig(tmp_path, curvature_std_deg_per_m=1e-200, **ADJUSTED)
    rig.run(5.0)
    rig.drill(1, 0.3)
    rig.drill(2, 0.3)
    said = [row["detail"] for row in rig.ask("alarms")["rig"] if row["code"] == "blunder"]
    assert len(said) == 1
    assert UNSOLVED in said[0]
    assert UNSOLVED in rig.ask("verdict")["why"]
    assert rig.ask("verdict")["verdict"] == "dont_know"
    rig.ground.close()


def test_a_north_that_was_not_told_is_in_every_azimuth_and_in_no_inclination(tmp_path: Path) -> None:
    measurements = passes(5, lambda _stop, station: 1.0 + 0.1 * station)
    told, untold = (
        shown_on(knowing(tmp_path, measurements, 5, **(ALIGNED | north)), "stations")["stations"]
        for north in ({}, {"north_std_deg": None})
    )
    for one, other in zip(told, untold, strict=True):
        assert one["sigma_azimuth_deg"] < 5.0
        assert other["sigma_azimuth_deg"] > 60.0
        assert other["inclination_deg"] == pytest.approx(one["inclination_deg"], abs=0.01)
        assert other["sigma_inclination_deg"] == pytest.approx(one["sigma_inclination_deg"], rel=0.1)


def test_the_setup_of_an_adjusted_hole_has_the_costs_of_the_adjustment(tmp_path: Path) -> None:
    hole = Drilled(3)
    model = hole.tell(RigModel.begin(GroundConfig(folder=tmp_path, mount_std_deg=0.0, **ADJUSTED)))
    items = {row["item"]: row["toe_cm"] for row in shown_on(model, "setup")["items"]}
    toe = {(row["source"], row["subject"]): row["sigma_cm"] for row in shown_on(model, "adjustment")["toe"]}
    for tube in (1, 2, 3):
        assert items[f"mount.{tube}"] == pytest.approx(toe["tilt", f"tube {tube}"], rel=0.01)
    assert items["play"] == pytest.approx(toe["play", ""], rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("stops", [15, 17])
def test_many_looks_of_few_or_more_stops_are_adjusted_the_same_in_any_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stops: int
) -> None:
    """Many looks are adjusted from where one of the first 16 stops ended, if there were so many.

    So many are many here already that the unknowns are (``WIDE``): a third of the tubes takes a twentieth of the time.
    """
    tubes, many = 34, 500
    monkeypatch.setattr(normal_equations, "MANY", many)
    placed = [
        (survey(tube, stop, tubes - tube + 1, 1.0 + 0.01 * (stop + tubes - tube)), 2.0 * (stop + tubes - tube))
        for stop in range(1, stops + 1)
        for tube in range(1, tubes + 1)
    ]
    assert len(placed) > many
    assert OF_TUBE * tubes > WIDE
    one, other = (numbers_of(knowing(tmp_path, each, tubes)) for each in (placed, placed[::-1]))
    assert one == other


def test_north_is_in_every_position_as_it_turns_the_hole_about_the_vertical(tmp_path: Path) -> None:
    """A hole to the north is moved to the east by the angle times how far north it is, on an arc, and not down.

    Of an angle with a standard deviation s the way back south, 1 - cos, has the root mean square 0.87 s^2.
    """
    measurements = passes(5, lambda _stop, _station: 5.0)
    collar = {"collar_inclination_deg": 5.0, "collar_azimuth_deg": 0.0}  # sums along legs are exact without a kink
    model = knowing(tmp_path, measurements, 5, north_std_deg=1.0, **collar)
    by_north, drawn = model.hole.variances["north"], model.hole.trajectory
    np.testing.assert_allclose(np.sqrt(by_north[:, 1]), math.radians(1.0) * drawn.positions[:, 0], rtol=1e-9)
    inward = np.sqrt(by_north[1:, 0]) / (math.radians(1.0) ** 2 * drawn.positions[1:, 0])
    assert (inward > 0.87).all()
    assert (inward < 1.2).all()
    assert float(np.max(by_north[:, 2])) < 1e-20
    exact = knowing(tmp_path / "exact", measurements, 5, **collar)
    more = drawn.covs[:, 1, 1] - exact.hole.trajectory.covs[:, 1, 1]
    np.testing.assert_allclose(more[1:], by_north[1:, 1], rtol=1e-3)


def test_what_a_covariance_is_made_of_adds_up_to_it_at_every_station(tmp_path: Path) -> None:
    """What the collar's direction and the first legs undo of each other is taken off both; none is below zero."""
    known = ALIGNED | {"play_std_deg": 1e-4, "collar_inclination_deg": 1.0, "collar_std_deg": 0.5}
    model = knowing(tmp_path, passes(6, lambda _stop, station: 1.0 + 0.3 * station), 6, **known)
    drawn, examined = model.hole.trajectory, model.hole.examined
    assert examined is not None
    across = np.diagonal(drawn.covs, axis1=1, axis2=2)[1:, :2]
    undone = -np.diagonal(drawn.tied_covs, axis1=1, axis2=2)[1:, :2]
    assert (undone > 0.03 * across).all()
    by_source = {name: variances[1:, :2] for name, variances in model.hole.variances.items()}
    assert all((variances >= 0.0).all() for variances in by_source.values())
    np.testing.assert_allclose(np.sum([*by_source.values()], axis=0), across, rtol=1e-6)
    assert (by_source["random"] < 0.5 * across).all()
    budget = budget_of_toe(model, examined)
    at_toe = np.sum([one.variances for one in budget], axis=0)
    np.testing.assert_allclose(at_toe[:2], across[-1], rtol=0.02)
    legs = np.diagonal(drawn.path_covs[-1])[:2]
    of_path = np.sum([one.variances[:2] for one in budget if one.source in ("path", "legs")], axis=0)
    assert (of_path > legs - undone[-1]).all()
    items = {row["item"]: row["toe_cm"] for row in shown_on(model, "setup")["items"]}
    assert items["path"] == pytest.approx(100.0 * math.sqrt(of_path.max()), rel=1e-3)


@given(values=st.lists(st.integers(0, 40), max_size=60))
def test_chains_are_numbered_as_they_come(values: list[int]) -> None:
    different, places = number_values(np.array(values, np.uint32))
    assert different == list(dict.fromkeys(values))
    assert [different[place] for place in places.tolist()] == values
