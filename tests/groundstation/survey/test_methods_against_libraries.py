"""Trajectory methods against two published libraries."""

import math
from collections.abc import Iterator

import numpy as np
import pytest
import wellpathpy
from wells import import_welleng

from groundstation.survey.well.methods import Method, dogleg_severity, station_positions

WELLS = 200
Well = tuple[np.ndarray, np.ndarray, np.ndarray]


def random_well(rng: np.random.Generator) -> Well:
    """From vertical to horizontal with 3 to 500 stations, degrees; azimuths stay away from north."""
    count = int(np.exp(rng.uniform(math.log(3), math.log(501))))
    md = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 30.0, count - 1))])
    inclination = np.clip(np.linspace(0.0, rng.uniform(1.0, 90.0), count) + rng.normal(0.0, 0.5, count), 0.0, 95.0)
    azimuth = np.clip(rng.uniform(30.0, 330.0) + np.cumsum(rng.normal(0.0, 2.0, count)), 10.0, 350.0)
    return md, inclination, azimuth


def random_wells() -> Iterator[Well]:
    rng = np.random.default_rng(20)
    for _ in range(WELLS):
        yield random_well(rng)


@pytest.mark.parametrize(
    ("method", "choice"),
    [(Method.TANGENTIAL, "high"), (Method.BALANCED_TANGENTIAL, "bal"), (Method.AVERAGE_ANGLE, "avg")],
)
def test_tangential_methods_agree_with_wellpathpy(method: Method, choice: str) -> None:
    for md, inclination, azimuth in random_wells():
        # a vertical end has no azimuth to average with; theirs takes what it is given
        leaning = np.maximum(inclination, 0.01) if method is Method.AVERAGE_ANGLE else inclination
        theirs = wellpathpy.deviation(md, leaning, azimuth).tan_method(choice)
        ours = station_positions(method, md, np.radians(leaning), np.radians(azimuth))
        expected = np.stack([theirs.northing, theirs.easting, theirs.depth], axis=-1)
        np.testing.assert_allclose(ours, expected, rtol=0.0, atol=1e-9)


def test_tangential_takes_the_direction_at_the_lower_station() -> None:
    for md, inclination, azimuth in random_wells():
        low = wellpathpy.deviation(md, np.roll(inclination, -1), np.roll(azimuth, -1)).tan_method("low")
        ours = station_positions(Method.TANGENTIAL, md, np.radians(inclination), np.radians(azimuth))
        np.testing.assert_allclose(ours, np.stack([low.northing, low.easting, low.depth], axis=-1), rtol=0.0, atol=1e-9)


def test_radius_of_curvature_agrees_with_wellpathpy_where_that_divides_by_no_zero() -> None:
    for md, _, drawn in random_wells():
        inclination = np.linspace(1.0, 90.0, len(md))
        azimuth = drawn[0] + 0.03 * np.arange(len(md))
        theirs = wellpathpy.deviation(md, inclination, azimuth).radius_curvature()
        ours = station_positions(Method.RADIUS_OF_CURVATURE, md, np.radians(inclination), np.radians(azimuth))
        expected = np.stack([theirs.northing, theirs.easting, theirs.depth], axis=-1)
        np.testing.assert_allclose(ours, expected, rtol=0.0, atol=1e-9)


def test_minimum_curvature_agrees_with_wellpathpy() -> None:
    for md, inclination, azimuth in random_wells():
        theirs = wellpathpy.deviation(md, inclination, azimuth).minimum_curvature()
        ours = station_positions(Method.MINIMUM_CURVATURE, md, np.radians(inclination), np.radians(azimuth))
        expected = np.stack([theirs.northing, theirs.easting, theirs.depth], axis=-1)
        np.testing.assert_allclose(ours, expected, rtol=0.0, atol=1e-9)


def test_dogleg_severity_agrees_with_wellpathpy() -> None:
    for md, inclination, azimuth in random_wells():
        theirs = wellpathpy.deviation(md, inclination, azimuth).minimum_curvature(course_length=1.0).dls[1:]
        ours = np.degrees(dogleg_severity(md, np.radians(inclination), np.radians(azimuth)))
        np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-6)


def test_minimum_curvature_agrees_with_welleng_across_north_too() -> None:
    rng = np.random.default_rng(21)
    for md, inclination, azimuth in random_wells():
        across = np.mod(azimuth + rng.uniform(0.0, 360.0), 360.0)
        welleng = import_welleng()
        header = welleng.survey.SurveyHeader(b_total=50_000, dip=70, declination=0, convergence=0)
        theirs = welleng.survey.Survey(md, inclination, across, header=header)
        ours = station_positions(Method.MINIMUM_CURVATURE, md, np.radians(inclination), np.radians(across))
        np.testing.assert_allclose(ours, np.stack([theirs.n, theirs.e, theirs.tvd], axis=-1), rtol=0.0, atol=1e-9)
