"""Pairs and triples of columns, and small rules of a survey, reckoned by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from test_wall_system import columns_of

from groundstation.errors import SurveyError
from groundstation.survey.fusion.force_biases import Look, solve_biases
from groundstation.survey.tools.formulas import ARRAY, VARIABLES, compile_formulas
from groundstation.survey.wall.column_joint import _directions
from groundstation.survey.wall.column_plans import Assumptions
from groundstation.survey.wall.void_chance import _barycentric
from groundstation.survey.wall.wall_file import read_wall_file
from groundstation.survey.wall.wall_joints import pair_covariance, pair_radii

HEADS = np.array([[0.0, 0.0], [0.0, 0.75]])
PAIR = np.array([[0, 1]])


def test_two_centres_err_against_each_other_by_the_difference_of_what_both_share() -> None:
    """Their shared errors point other ways, so that what crosses them is no symmetric matrix."""
    shared = np.array([[[0.03, 0.0], [0.01, 0.02]], [[0.0, 0.05], [0.04, -0.01]]])
    found = pair_covariance(columns_of(HEADS, 0.02, shared), PAIR)[0, -1]
    apart = shared[1] - shared[0]
    np.testing.assert_allclose(found, apart @ apart.T + 2.0 * 0.02**2 * np.eye(2), rtol=1e-12)


def test_radii_of_a_pair_go_together_as_far_as_is_stated() -> None:
    radii, cov = pair_radii(columns_of(HEADS, 0.02, cv=0.1, correlation=0.25), PAIR)
    assert radii[0, -1].tolist() == [0.6, 0.6]
    np.testing.assert_allclose(cov[0, -1], 0.06**2 * np.array([[1.0, 0.25], [0.25, 1.0]]))


def test_radii_that_hardly_reach_each_other_move_the_limit_a_thousand_times_as_much_as_themselves() -> None:
    """The limit's change is r / sqrt(r^2 - (t/2)^2), and at most a thousand, whatever the radius."""
    for radius in (0.3, 2.0):
        radii, cov = np.array([[radius, 2.0 * radius]]), np.diag([1e-4, 1e-4])[None]
        main, across = _directions(radii, cov, 2.0 * radius)  # as thick as the smaller column is
        steep = np.array([1000.0, 2.0 / math.sqrt(3.0)])
        np.testing.assert_allclose(main[0], 0.01 * steep / np.linalg.norm(steep), rtol=1e-9)
        assert np.linalg.norm(across[0]) == pytest.approx(0.01)
        assert float(across[0] @ main[0]) == pytest.approx(0.0, abs=1e-12)


def test_a_point_in_a_triangle_anywhere_is_the_mean_of_its_corners_by_its_weights() -> None:
    corners = np.array([[[3.0, 5.0], [7.0, 6.0], [4.0, 9.0]]])
    weights = np.array([0.2, 0.3, 0.5])
    np.testing.assert_allclose(_barycentric(weights @ corners[0], corners)[0], weights, rtol=1e-12)


def test_the_one_layer_that_is_not_told_reaches_over_everything() -> None:
    (layer,) = Assumptions().layers
    assert (layer.top, layer.radius, layer.radius_cv) == (-math.inf, None, 0.0)


def test_a_step_is_zero_at_its_edge() -> None:
    (found,) = compile_formulas(["step(Inc)"])(ARRAY, [np.array([-0.1, 0.0, 0.1])] * len(VARIABLES))
    assert np.asarray(found).tolist() == [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    ("key", "most"),
    [("latitude_deg", 90), ("dip_deg", 90), ("inclination_deg", 180), ("azimuth_deg", 360), ("declination_deg", 180)],
)
def test_an_angle_of_a_wall_beyond_its_circle_is_refused_by_name(tmp_path: Path, key: str, most: int) -> None:
    for value, is_taken in ((most, True), (most + 0.5, False)):
        (tmp_path / "wall.toml").write_text(
            'radius_m = 0.4\nthickness_m = 0.1\nlayout = "line"\nlength_m = 12\nheads = "heads.csv"\n'
            f'stations = "stations.csv"\ninstrument = "gyro-continuous"\n{key} = {value}\n'
        )
        if is_taken:
            read_wall_file(tmp_path / "wall.toml")
        else:
            with pytest.raises(SurveyError, match=key):
                read_wall_file(tmp_path / "wall.toml")


def test_biases_are_those_of_one_least_squares_problem_of_all_unknowns() -> None:
    """Joints and mounts of the highest places too: no unknown of a tube is another's."""
    rng = np.random.default_rng(7)
    bias_std, gravity_std = 0.01, 2e-3
    looks = []
    for station in range(3):
        for tube in (4, 9):
            unit = rng.normal(size=3)
            looks.append(
                Look(
                    station, tube, 0.02 * rng.normal(size=2), np.diag(rng.uniform(1e-7, 1e-6, 2)),
                    rng.normal(0.0, 0.1, (2, 3)), rng.normal(0.0, 1e-3, (2, 3)), np.array([0, 2, 5]),
                    unit / np.linalg.norm(unit), 0.01 * rng.normal(), 1e-6,
                )
            )  # fmt: skip
    found = solve_biases(looks, bias_std, gravity_std)
    # unknowns: six of joints and mounts, three of each tube, gravity, two of each station, unknown before
    size, places = 6 + 6 + 1 + 6, {4: slice(6, 9), 9: slice(9, 12)}
    rows, right = [np.eye(size)[:13]], [np.zeros(13)]
    for look in looks:
        of_lean, of_size = np.zeros((2, size)), np.zeros((1, size))
        of_lean[:, look.places], of_lean[:, places[look.tube]] = look.columns, bias_std * look.by_force
        of_lean[:, 13 + 2 * look.station : 15 + 2 * look.station] = np.eye(2)
        of_size[0, places[look.tube]], of_size[0, 12] = bias_std * look.unit, gravity_std
        stds = np.sqrt(np.diag(look.cov))
        rows += [of_lean / stds[:, None], of_size / math.sqrt(look.excess_var)]
        right += [look.lean / stds, np.array([look.excess]) / math.sqrt(look.excess_var)]
    whole = np.concatenate(rows)
    errors = np.linalg.lstsq(whole, np.concatenate(right), rcond=None)[0]
    cov = np.linalg.inv(whole.T @ whole)
    for tube, at in places.items():
        np.testing.assert_allclose(found[tube].bias, bias_std * errors[at], rtol=1e-6, atol=1e-12)
        np.testing.assert_allclose(found[tube].cov, bias_std**2 * cov[at, at], rtol=1e-6, atol=1e-14)
