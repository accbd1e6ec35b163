"""The study of where holes end: its holes are of the kinds they are called, and its committed results hold."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.survey.path.curvature_prior import STATED
from sim.studies.projection import drilled_holes
from sim.studies.projection.drilled_holes import KINDS, LENGTH, DrilledGround, DrilledHole, drill_holes
from sim.studies.projection.foreseen_ends import SPACING, STATIONS, foresee_ends
from sim.studies.projection.run import run_study
from sim.studies.published import wellbore_1

RESULTS = Path(__file__).parents[2] / "docs" / "results"
GROUND = DrilledGround()


def hole_of(kind: str, turn: int = 0, ground: DrilledGround = GROUND) -> DrilledHole:
    """A hole of a kind, its axis and its course."""
    return drill_holes(1, [list(KINDS).index(kind) + turn * len(KINDS)], ground)[0]


def doglegs_of(hole: DrilledHole) -> np.ndarray:
    """Degrees a metre along a hole."""
    sines = np.linalg.norm(np.cross(hole.tangents[:-1], hole.tangents[1:]), axis=1)
    return np.degrees(np.arcsin(sines)) / np.diff(hole.md)


@pytest.mark.parametrize("kind", list(KINDS))
def test_a_hole_is_a_line_of_its_own_length(kind: str) -> None:
    hole = hole_of(kind)
    assert hole.kind == kind
    assert np.linalg.norm(hole.tangents, axis=1) == pytest.approx(np.ones(len(hole.md)))
    steps = np.linalg.norm(np.diff(hole.positions, axis=0), axis=1)
    assert steps == pytest.approx(np.diff(hole.md), rel=1e-5)
    axis = np.array([
        math.sin(hole.inclination) * math.cos(hole.azimuth),
        math.sin(hole.inclination) * math.sin(hole.azimuth),
        math.cos(hole.inclination),
    ])  # fmt: skip
    assert hole.end(axis) @ axis == pytest.approx(LENGTH)


def test_straight_holes_are_and_others_are_not() -> None:
    assert doglegs_of(hole_of("straight")).max() < 1e-6
    for kind in KINDS:
        if kind != "straight":
            assert max(doglegs_of(hole_of(kind, turn)).max() for turn in range(5)) > 0.05


def test_a_constant_build_is_one() -> None:
    doglegs = doglegs_of(hole_of("constant build"))
    assert doglegs == pytest.approx(np.full(len(doglegs), doglegs[0]), rel=1e-4)


def test_a_soft_layer_begins_at_a_depth() -> None:
    for turn in range(8):
        hole = hole_of("soft layer", turn)
        bent = doglegs_of(hole) > 1e-6
        begins = hole.md[:-1][bent].min()
        assert GROUND.layer_m[0] < begins < GROUND.layer_m[1]
        assert bent[hole.md[:-1] > begins].all()


def test_a_walk_to_the_right_bends_one_way_for_good() -> None:
    """Looked at along its path a walk keeps its bend on one side of where it builds."""
    bends = [doglegs_of(hole_of("walk to the right", turn)).mean() for turn in range(6)]
    assert min(bends) > 0.0
    assert max(bends) < 5.0 * GROUND.walk_deg


def test_the_published_bore_has_the_shape_of_its_record() -> None:
    """Stretched, turned and of another size: at one stretch what it has turned is the record times a constant."""
    record, hole = wellbore_1(), hole_of("wellbore 1")
    spreads = []
    for stretch in np.linspace(*GROUND.stretch, 161):
        known = record.md[1:] * stretch < hole.md[-1]
        places = (0.0, *(record.md[1:][known] * stretch))
        tangents = np.stack([np.interp(places, hole.md, column) for column in hole.tangents.T], axis=1)
        turned = np.degrees(np.arccos(np.clip(tangents[1:] @ tangents[0], -1.0, 1.0)))
        ratio = turned[1:] / np.degrees(record.inclination[2:][known[1:]])
        spreads.append(ratio.std() / ratio.mean())
    assert min(spreads) < 0.01


def test_its_constants_are_not_those_of_the_prior() -> None:
    typical = math.degrees(math.sqrt(float(STATED.weights.sum(axis=1) @ STATED.sizes**2)))
    for constant in (GROUND.build_deg, GROUND.walk_deg, GROUND.bend_deg):
        assert constant not in (typical, *np.degrees(STATED.jumps), *np.degrees(STATED.sizes))


def test_one_seed_is_one_result() -> None:
    first, again = (foresee_ends(drill_holes(3, [2, 5], GROUND)[1], 3, 5) for _ in range(2))
    for name in ("inside", "radius", "off", "score", "chances", "within"):
        assert np.array_equal(getattr(first, name), getattr(again, name))
    other = foresee_ends(drill_holes(4, [5], GROUND)[0], 4, 5)
    assert not np.array_equal(first.radius, other.radius)


@pytest.mark.slow
def test_a_seventh_of_the_holes_lie_in_the_cone_as_it_says() -> None:
    """Of 140 holes from all depths together: 95 % but for what so few holes scatter by."""
    result = run_study(140, 7, lambda: None)
    inside = [row["inside_percent"] for row in result["cases"]]
    assert len(inside) == STATIONS
    assert np.mean(inside) == pytest.approx(95.0, abs=2.5)
    assert min(inside) > 88.0
    for row in result["cases"]:
        assert row["score_cm"] < row["score_straight_cm"]
        assert row["score_cm"] < 1.05 * row["score_constant_cm"]


def committed(name: str) -> list[dict[str, str]]:
    with (RESULTS / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def test_the_committed_cone_holds_93_to_97_percent_from_every_depth_and_beats_both_guesses() -> None:
    rows = committed("projection")
    assert [row["case"] for row in rows] == [f"{SPACING * k:g} m" for k in range(1, STATIONS + 1)]
    for row in rows:
        assert 93.0 <= float(row["inside_percent"]) <= 97.0
        assert float(row["score_cm"]) < float(row["score_straight_cm"])
        assert float(row["score_cm"]) < float(row["score_constant_cm"])


def chances_from(stretch: str) -> list[tuple[float, float]]:
    """Chances stated and observed (%) in the bins of a stretch."""
    rows = [row for row in committed("projection-reliability") if row["from"] == stretch]
    return [(float(row["stated_percent"]), float(row["observed_percent"])) for row in rows]


def test_the_committed_chances_are_as_often_true_as_they_say() -> None:
    """Within 3.5 points from 60 % on and near 0, within ten between, and on the mean of all bins within two."""
    pairs = chances_from("every depth")
    assert len(pairs) == 10
    for stated, observed in pairs:
        assert abs(observed - stated) < (3.5 if stated > 60.0 or stated < 10.0 else 10.0)
    assert np.mean([observed - stated for stated, observed in pairs]) == pytest.approx(0.0, abs=2.0)


def test_from_the_second_station_on_the_committed_chances_are_within_six_points() -> None:
    """What is off by more is the first station's, where nothing but the prior says how the hole bends."""
    pairs = chances_from("4 m on")
    assert len(pairs) == 10
    assert all(abs(observed - stated) < 6.0 for stated, observed in pairs)
    assert np.mean([observed - stated for stated, observed in pairs]) == pytest.approx(0.0, abs=2.5)


def forgotten_over(length: float) -> drilled_holes.Bend:
    """Curvatures of 0.14 deg/m that wander, and are forgotten over a length (m)."""

    def bend(random: np.random.Generator, _ground: DrilledGround, places: np.ndarray) -> np.ndarray:
        kept = math.exp(-(places[1] - places[0]) / length)
        news = 0.14 * random.normal(size=(len(places), 2))
        found = news.copy()
        for place in range(1, len(places)):
            found[place] = kept * found[place - 1] + math.sqrt(1.0 - kept * kept) * news[place]
        return found

    return bend


@pytest.mark.statistical
@pytest.mark.parametrize("length", [10.0, 20.0, 40.0])
def test_the_cone_holds_whatever_length_a_curvature_is_forgotten_over(
    monkeypatch: pytest.MonkeyPatch, length: float
) -> None:
    """The ends of 200 holes, from every depth; the prior has 4, 12, 40 and 400 m."""
    monkeypatch.setattr(drilled_holes, "KINDS", {"wanders": forgotten_over(length)})
    holes = drill_holes(5, range(200), GROUND)
    inside = np.array([foresee_ends(hole, 5, number).inside for number, hole in enumerate(holes)])
    assert inside.mean() > 0.95
    assert (inside.mean(axis=0) > 0.90).all()
