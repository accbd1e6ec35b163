"""Fused directions against drawn stops: every inclination, yaws that are hardly known, one reading and many.

The oracle turns tubes by rotations and knows neither leans nor weights; errors are those of inclination and azimuth.
"""

import math

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from groundstation.survey.bearings import planes_across
from groundstation.survey.fusion.fusion import departure_from, fuse_by_bayes, newest_departure
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import direction_angles, resolve_all
from groundstation.survey.fusion.sphere_direction import SphereDirection, bare_direction, bows_of, stds_of_directions
from groundstation.survey.fusion.sphere_fusion import fuse_on_sphere

Array = npt.NDArray[np.float64]
DEG = math.pi / 180.0
G, NOISE = 9.8, 2e-3  # m/s^2
AZIMUTH = 1.1
NOTHING = Packed(np.zeros((3, 0)))


def drawn(seed: int, inclination: float, yaw_stds: Array, runs: int) -> tuple[Array, Array]:
    """Readings (runs, n, 3) with covariances (runs, n, 3, 3) of one direction, of yaws as well known as told (n,)."""
    random, count = np.random.default_rng(seed), len(yaw_stds)
    yaws = random.uniform(0.0, math.tau, (runs * count, 1))
    to_lean, leaned = Rotation.from_euler("z", AZIMUTH), Rotation.from_euler("y", inclination)
    body = to_lean * leaned * to_lean.inv() * Rotation.from_euler("z", yaws)  # the shortest way from the vertical
    forces = body.inv().apply([0.0, 0.0, -G]) + NOISE * random.standard_normal((runs * count, 3))
    known = np.repeat(NOISE**2 * np.eye(3)[None], runs * count, axis=0)
    told = yaws[:, 0] + np.tile(yaw_stds, runs) * random.standard_normal(runs * count)
    found = resolve_all(forces, known, told.tolist(), np.tile(yaw_stds**2, runs))
    return found.tangent.reshape(runs, count, 3), found.cov.reshape(runs, count, 3, 3)


def errors_of(found: list[SphereDirection], inclination: float) -> tuple[Array, Array]:
    """Errors (runs, 2) along and across, and covariances (runs, 2, 2); regular at the vertical too.

    The square of a distance of two leans is that of their sizes and, across, of the chord between their azimuths.
    """
    tangents = np.array([one.tangent for one in found])
    size, azimuth = np.hypot(tangents[:, 0], tangents[:, 1]), np.arctan2(tangents[:, 1], tangents[:, 0])
    mine = np.arctan2(size, tangents[:, 2])
    c, s = np.cos(azimuth), np.sin(azimuth)
    axes = np.stack([np.stack([np.cos(mine) * c, np.cos(mine) * s, -size], 1), np.stack([-s, c, 0.0 * c], 1)], 1)
    covs = axes @ np.array([one.tangent_cov for one in found]) @ np.swapaxes(axes, 1, 2)
    across = 2.0 * np.sin(0.5 * (AZIMUTH - azimuth)) * np.sqrt(size * math.sin(inclination))
    return np.stack([inclination - mine, across], axis=1), covs


def figures(seed: int, inclination_deg: float, yaw_stds_deg: list[float], runs: int) -> tuple[float, float, float]:
    """NEES by its two numbers, rms of the fused inclination, and of that of the best reading alone."""
    inclination = inclination_deg * DEG
    tangents, covs = drawn(seed, inclination, DEG * np.array(yaw_stds_deg), runs)
    count = len(yaw_stds_deg)
    begin = np.arange(0, runs * count + 1, count)
    yaws = np.stack([np.tile((DEG * np.array(yaw_stds_deg)) ** 2, runs), np.zeros(runs * count)], axis=1)
    found = fuse_on_sphere(tangents.reshape(-1, 3), covs.reshape(-1, 3, 3), [NOTHING] * (runs * count), yaws, begin)
    errors, claimed = errors_of(found, inclination)
    nees = float(np.mean(np.einsum("ni,nij,nj->n", errors, np.linalg.inv(claimed), errors))) / 2.0
    best = int(np.argmin(yaw_stds_deg))
    alone = errors_of([bare_direction(*one) for one in zip(tangents[:, best], covs[:, best], strict=True)], inclination)
    return nees, float(np.sqrt(np.mean(errors[:, 0] ** 2))), float(np.sqrt(np.mean(alone[0][:, 0] ** 2)))


FEW = [(i, y, n) for i in (0.0, 30.0, 90.0, 120.0, 180.0) for y in (1.0, 20.0) for n in (2, 10)]
MANY = [
    (i, y, n)
    for i in (0.0, 0.01, 0.02, 0.1, 1.0, 10.0, 30.0, 60.0, 89.0, 90.0, 91.0, 120.0, 150.0, 179.0, 179.9, 179.99, 180.0)
    for y in (0.05, 1.0, 5.0, 20.0)
    for n in (1, 2, 5, 10)
]


@pytest.mark.slow
@pytest.mark.parametrize(("inclination_deg", "yaw_deg", "count"), FEW)
def test_a_fused_direction_errs_as_it_says(inclination_deg: float, yaw_deg: float, count: int) -> None:
    nees, fused, alone = figures(7, inclination_deg, [yaw_deg] * count, 1000)
    assert 0.88 < nees < 1.12
    assert fused <= 1.05 * alone


@pytest.mark.statistical
@pytest.mark.parametrize(("inclination_deg", "yaw_deg", "count"), MANY)
def test_a_fused_direction_errs_as_it_says_at_every_inclination(
    inclination_deg: float, yaw_deg: float, count: int
) -> None:
    nees, fused, alone = figures(8, inclination_deg, [yaw_deg] * count, 4000)
    assert 0.9 < nees < 1.1
    assert fused <= 1.05 * alone


@pytest.mark.parametrize("lean", [0.0, 1e-160, 1e-9, 1e-7, 1e-6, 1e-3, 0.5, 1.0])
@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_axes_across_any_direction_are_at_right_angles_to_it_and_each_other(lean: float, sense: float) -> None:
    for azimuth in np.linspace(0.0, math.tau, 9):
        tangent = np.array([lean * math.cos(azimuth), lean * math.sin(azimuth), sense * math.sqrt(1.0 - lean**2)])
        frame = np.vstack([planes_across(tangent), tangent])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("inclination_deg", [2.0, 30.0, 60.0, 90.0, 140.0])
def test_poor_yaws_beside_a_good_one_do_not_spoil_the_inclination(inclination_deg: float) -> None:
    nees, fused, alone = figures(9, inclination_deg, [0.05, 3.0, 20.0, 20.0], 1000)
    assert 0.88 < nees < 1.12
    assert fused <= 0.56 * alone  # half, but for what chance makes of 1000


@pytest.mark.parametrize("inclination_deg", [0.3, 45.0, 90.0, 135.0])
def test_a_joint_that_readings_share_stays_whole_in_the_azimuth_and_out_of_the_inclination(
    inclination_deg: float,
) -> None:
    tangents, covs = drawn(3, inclination_deg * DEG, np.full(4, 1e-4), 1)
    turned = 3.0 * DEG * np.array([[-t[1], t[0], 0.0] for t in tangents[0]])
    readings = [
        SphereDirection(t, c, Packed(s[:, None]), (1e-8, (3.0 * DEG) ** 2))
        for t, c, s in zip(tangents[0], covs[0], turned, strict=True)
    ]
    fused = fuse_by_bayes(readings)
    ((inclination_std, azimuth_std),) = stds_of_directions([fused])
    noise = 0.5 * NOISE / G
    assert inclination_std == pytest.approx(noise, rel=0.02)
    assert azimuth_std == pytest.approx(math.hypot(3.0 * DEG, noise / math.sin(inclination_deg * DEG)), rel=0.02)


@pytest.mark.parametrize("inclination_deg", [0.1, 179.9])
def test_yaws_that_are_hardly_known_make_a_small_lean_neither_longer_nor_shorter(inclination_deg: float) -> None:
    """Ten readings of yaws known to 20 deg: the mean of 3000 leans is the true one to 0.06 of the sigma of one."""
    inclination, count, runs = inclination_deg * DEG, 10, 3000
    tangents, covs = drawn(11, inclination, np.full(count, 20.0 * DEG), runs)
    yaws = np.tile([(20.0 * DEG) ** 2, 0.0], (runs * count, 1))
    begin = np.arange(0, runs * count + 1, count)
    found = fuse_on_sphere(tangents.reshape(-1, 3), covs.reshape(-1, 3, 3), [NOTHING] * (runs * count), yaws, begin)
    leans = np.array([math.hypot(*one.tangent[:2]) for one in found])
    std = NOISE / G / math.sqrt(count)
    longer = std**2 / (2.0 * math.sin(inclination))  # what noise across the lean adds
    assert abs(float(leans.mean()) - math.sin(inclination) - longer) < 0.06 * std


@pytest.mark.parametrize("inclination_deg", [10.0, 60.0, 90.0])
def test_a_yaw_that_readings_share_bows_what_they_come_to_as_a_drawn_one_does(inclination_deg: float) -> None:
    """The joint above four tubes is known to 25 deg: what a turn on the circle leaves the line by is drawn."""
    std = 25.0 * DEG
    tangents, covs = drawn(4, inclination_deg * DEG, np.full(4, 1e-4), 1)
    readings = [
        SphereDirection(t, c, Packed(std * np.array([[-t[1]], [t[0]], [0.0]])), (1e-8, std**2))
        for t, c in zip(tangents[0], covs[0], strict=True)
    ]
    fused = fuse_by_bayes(readings)
    turns = np.random.default_rng(6).normal(0.0, std, 400_000)
    lean = fused.tangent[:2]
    along = np.cos(turns) - 1.0  # of the lean, that a turn by so much takes off it
    assert fused.bow[:2, :2] == pytest.approx(np.mean(along**2) * np.outer(lean, lean), rel=0.02)
    assert sum(fused.yaw_vars) == pytest.approx(std**2, rel=0.01)


@pytest.mark.parametrize("inclination_deg", [0.0, 1.0, 60.0, 90.0, 180.0])
def test_one_reading_is_the_direction_and_stations_side_by_side_are_each_alone(inclination_deg: float) -> None:
    tangents, covs = drawn(4, inclination_deg * DEG, np.array([0.02, 0.3, 0.01]), 5)
    begin = np.array([0, 1, 4, 9, 15])
    flat = tangents.reshape(-1, 3), covs.reshape(-1, 3, 3)
    yaws = np.tile([[0.02**2, 0.0], [0.3**2, 0.0], [0.01**2, 0.0]], (5, 1))
    together = fuse_on_sphere(*flat, [NOTHING] * 15, yaws, begin)
    np.testing.assert_allclose(together[0].tangent, flat[0][0], atol=1e-14)
    # a yaw turns the lean without its noise, whose square is two variances in the mean
    x, y = flat[0][0][:2]
    noise = 2.0 * float(np.linalg.eigvalsh(flat[1][0])[1])  # none along the direction, more where the yaw turns it
    part = noise / (x * x + y * y + noise)
    known = flat[1][0] - part * 0.02**2 * np.outer([-y, x, 0.0], [-y, x, 0.0])
    np.testing.assert_allclose(together[0].own, known, atol=1e-8 * float(np.trace(known)))
    for k, one in enumerate(together):
        some, count = slice(begin[k], begin[k + 1]), int(begin[k + 1] - begin[k])
        (alone,) = fuse_on_sphere(flat[0][some], flat[1][some], [NOTHING] * count, yaws[some], np.array([0, count]))
        for name in ("tangent", "own", "bow"):
            np.testing.assert_array_equal(getattr(one, name), getattr(alone, name))


@pytest.mark.slow
@pytest.mark.parametrize(("inclination_deg", "yaw_deg"), [(1.0, 0.5), (45.0, 10.0), (90.0, 10.0), (150.0, 10.0)])
def test_honest_readings_depart_as_often_as_chance_has_it(inclination_deg: float, yaw_deg: float) -> None:
    tangents, covs = drawn(5, inclination_deg * DEG, np.full(3, yaw_deg * DEG), 600)
    squares = [
        newest_departure([bare_direction(*one, (yaw_deg * DEG) ** 2) for one in zip(*run, strict=True)])[1] ** 2
        for run in zip(tangents, covs, strict=True)
    ]
    assert np.mean(squares) == pytest.approx(2.0, rel=0.12)  # chi-square of two; its mean is known to 4 %


def test_a_reading_that_is_off_in_inclination_departs_however_poor_its_yaw_is() -> None:
    tangents, covs = drawn(6, 60.0 * DEG, np.full(4, 20.0 * DEG), 1)
    readings = [bare_direction(*one, (20.0 * DEG) ** 2) for one in zip(tangents[0], covs[0], strict=True)]
    inclination, azimuth = direction_angles(readings[-1].lean, readings[-1].down)
    off, s = inclination + 10.0 * NOISE / G, math.sin(inclination + 10.0 * NOISE / G)
    wrong = bare_direction(
        np.array([s * math.cos(azimuth), s * math.sin(azimuth), math.cos(off)]), covs[0, -1], (20.0 * DEG) ** 2
    )
    earlier = fuse_by_bayes(readings[:-1])
    assert departure_from(earlier, readings[-1])[1] < 3.5
    assert departure_from(earlier, wrong)[1] > 6.0


@pytest.mark.parametrize("sigma_deg", [1.0, 20.0, 60.0])
@pytest.mark.parametrize("inclination_deg", [30.0, 90.0])
def test_the_bow_is_the_mean_square_of_what_the_circle_leaves_the_line_by(
    sigma_deg: float, inclination_deg: float
) -> None:
    s = math.sin(inclination_deg * DEG)
    tangent = np.array([s, 0.0, math.cos(inclination_deg * DEG)])
    errors = sigma_deg * DEG * np.random.default_rng(1).normal(size=200_000)
    bow = bows_of(tangent[None], np.array([(sigma_deg * DEG) ** 2]))[0]
    assert bow[0, 0] == pytest.approx(np.mean((s * (np.cos(errors) - 1.0)) ** 2), rel=0.03)
    assert np.count_nonzero(bow) == 1


@pytest.mark.parametrize("lean", [0.0, 1e-4, 0.01, 1.0])
def test_no_azimuth_is_said_to_be_known_worse_than_not_at_all(lean: float) -> None:
    tangent = np.array([0.6 * lean, 0.8 * lean, math.sqrt(1.0 - lean**2)])
    cov = 1e-4 * (np.eye(3) - np.outer(tangent, tangent))
    ((inclination_std, azimuth_std),) = stds_of_directions([bare_direction(tangent, cov)])
    assert inclination_std == pytest.approx(0.01)
    assert azimuth_std == pytest.approx(min(0.01 / max(lean, 1e-12), math.pi))
