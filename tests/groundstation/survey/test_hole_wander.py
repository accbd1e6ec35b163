"""How far paths leave their arcs between stations, and what clearance makes of it, against drawn paths."""

import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from straight_holes import straight_hole

from groundstation.survey.path.leg_wander import LegWander
from groundstation.survey.requests.clearance_answer import answer_clearance
from groundstation.survey.requests.clearance_request import ClearanceRequest
from groundstation.survey.requests.survey_request import SiteFigures
from groundstation.survey.well.clearance import HolePair, Rule
from groundstation.survey.well.error_sources import Site
from groundstation.survey.well.hole_wander import HoleWander

DEG = math.pi / 180.0
SITE = Site(9.80665, 50_000.0, 70.0 * DEG, 0.0, 60.0 * DEG)


def drawn_departures(md: np.ndarray, std: float, length: float, share: float, draws: int) -> np.ndarray:
    """How far holes (draws,) are off their arcs at a share of the last leg: curvatures drawn and summed twice."""
    rng, step = np.random.default_rng(5), 0.05
    count = round(float(md[-1]) / step)
    kept = math.exp(-step / length)
    curvature, direction, place = std * rng.standard_normal(draws), np.zeros(draws), np.zeros(draws)
    directions, places = [direction], [place]
    for _ in range(count):
        place = place + step * direction + 0.5 * step**2 * curvature
        direction = direction + step * curvature
        curvature = kept * curvature + std * math.sqrt(1.0 - kept**2) * rng.standard_normal(draws)
        directions.append(direction)
        places.append(place)
    at = np.round(md / step).astype(int)
    drawn = np.zeros(draws)
    for k, (a, b) in enumerate(pairwise(at.tolist())):
        f, leg = (share if k == len(md) - 2 else 1.0), float(md[k + 1] - md[k])
        # a direction that turns evenly from the one station's to the next one's
        drawn += f * leg * directions[a] + 0.5 * f * f * leg * (directions[b] - directions[a])
    return np.asarray(places[at[-2] + round(share * (at[-1] - at[-2]))] - drawn)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("stations", [(0.0, 10.0, 16.0, 36.0), (0.0, 30.0), (0.0, 30.0, 60.0, 90.0)])
def test_a_path_between_stations_wanders_as_drawn_ones_do(share: float, stations: tuple[float, ...]) -> None:
    md, wander = np.array(stations), LegWander(0.3 * DEG, 20.0)
    claimed = HoleWander(md, wander).variances(np.array([len(md) - 2]), np.array([share]))[0]
    drawn = drawn_departures(md, wander.std, wander.length, share, 4000)
    assert np.mean(drawn**2) == pytest.approx(claimed, rel=0.12)


def test_a_surveyed_hole_wanders_by_what_lies_between_its_stations_alone() -> None:
    """A curvature of the variance s^2 is forgotten over l: legs L, shorter, gather s^2 L^5 / (360 l) each.

    That is what the rule of trapezoids errs by for directions whose curvature is driven by a noise 2 s^2 / l. Stations
    half as far apart tell 2^4 as much a metre, and a leg much longer than l errs by s^2 l L^3 / 6.
    """
    wander = LegWander(0.3 * DEG, 20.0)
    ends = []
    for leg in (2.0, 4.0):
        md = np.arange(0.0, 600.1, leg)
        at_stations = HoleWander(md, wander).variances(np.arange(len(md) - 1), np.ones(len(md) - 1))
        settled = at_stations[round(200.0 / leg) :]  # ten l below the collar, the first leg is forgotten
        np.testing.assert_allclose(np.diff(settled), wander.std**2 * leg**5 / (360.0 * wander.length), rtol=0.01)
        ends.append(float(settled[-1] - settled[0]))
    assert ends[1] / ends[0] == pytest.approx(16.0, rel=0.03)
    unsurveyed = HoleWander(np.array([0.0, 2000.0]), wander).variances(np.array([0]), np.ones(1))
    assert unsurveyed[0] == pytest.approx(wander.std**2 * wander.length * 2000.0**3 / 6.0, rel=0.05)


def test_the_wander_of_both_paths_is_in_the_sigma_of_their_distance() -> None:
    wander, rule = LegWander(0.3 * DEG, 20.0), Rule(margin=0.0)
    one, other = straight_hole(0.0), straight_hole(5.0)
    still = HolePair(one, other, SITE, rule)
    moved = HolePair(replace(one, wander=wander), replace(other, wander=wander), SITE, rule)
    places = np.array([0.0, 0.5, 3.0, 7.4, 10.0])
    added = moved.separations(places).sigma ** 2 - still.separations(places).sigma ** 2
    legs, fractions = np.minimum(places.astype(int), 9), places - np.minimum(places.astype(int), 9)
    expected = 2.0 * HoleWander(one.survey.md, wander).variances(legs, fractions)
    np.testing.assert_allclose(added, expected, rtol=1e-9, atol=1e-15)
    assert added[0] == 0.0
    assert np.all(np.diff(added) > 0.0)
    # along both it is nothing: they end tip to tip
    below = straight_hole(0.0)
    below = replace(below, positions=below.positions + np.array([0.0, 0.0, 103.0]), wander=wander)
    tip = HolePair(replace(one, wander=wander), below, SITE, rule).separations(np.array([10.0]))
    assert float(tip.sigma[0]) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("forgotten_m", [5.0, 20.0])
def test_each_path_wanders_as_its_own_instrument_leaves_it(tmp_path: Path, forgotten_m: float) -> None:
    """Of ``relay`` it is counted and of the industry's models not, whichever of the two holes they surveyed."""
    record = tmp_path / "hole.csv"
    record.write_text("md_m,inclination_deg,azimuth_deg\n" + "".join(f"{md},2,30\n" for md in range(0, 121, 10)))
    own = HoleWander(10.0 * np.arange(13.0), LegWander(0.3 * DEG, forgotten_m)).variances(np.array([11]), np.ones(1))[0]
    for mine, theirs, times in (("relay", "mwd-rev4", 1), ("mwd-rev4", "relay", 1), ("relay", "relay", 2)):
        request = ClearanceRequest(
            record, record, instrument=mine, offset_instrument=theirs, offset_head=(0.0, 9.0, 0.0),
            curvature_length_m=forgotten_m, site=SiteFigures(field_nt=49_000.0, dip_deg=66.0, declination_deg=2.5),
        )  # fmt: skip
        moved, still = (
            answer_clearance(one)["stations"][-1]["sigma_m"] ** 2
            for one in (request, replace(request, curvature_sigma_deg_per_m=0.0))
        )
        assert moved - still == pytest.approx(times * own, rel=0.01)
