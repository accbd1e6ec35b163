"""An adjusted hole against drawn truths: directions within their sigmas, whatever is known of yaws and joints."""

import itertools
import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial.transform import Rotation

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.looks import OF_TUBE, TURN, Looks, PathPrior, StringPrior
from groundstation.survey.adjustment.play import faster_play
from groundstation.survey.adjustment.sphere import carried_bases

Array = npt.NDArray[np.float64]
DEG = math.pi / 180.0
G, GRAVITY_STD = 9.79, 1e-3  # m/s^2
NOISE, PLAY, TURN_STD = 5e-4, 0.008 * DEG, 0.05 * DEG
TUBES, LENGTH = 5, 3.0
CURVATURE, MEMORY = 0.4 * DEG, 30.0  # rad/m, m


def drawn_hole(
    seed: int, inclination: float, yaw_std: float, turns: Array, wanders: bool = False
) -> tuple[Looks, StringPrior, PathPrior, Array]:
    """Five tubes that passed five stations of a hole that bends by some tenths of a degree a station.

    Or of one that wanders, and leaves its collar, as the prior of the path has it.
    """
    random = np.random.default_rng(seed)
    angles = inclination + 0.2 * DEG * np.cumsum(random.standard_normal(TUBES + 1))
    azimuths = 2.0 + 0.3 * DEG * np.cumsum(random.standard_normal(TUBES + 1)) / max(math.sin(inclination), 0.05)
    truth = np.stack([np.sin(angles) * np.cos(azimuths), np.sin(angles) * np.sin(azimuths), np.cos(angles)], axis=1)
    told = truth[0]
    if wanders:
        truth, told = wandering(np.random.default_rng([seed, 1]), inclination)
    bias, rows = 0.01 * random.standard_normal((TUBES, 3)), []
    turns = turns + TURN_STD * random.standard_normal(TUBES)
    for stop in range(TUBES):
        for tube in range(stop + 1):
            station, face = stop - tube + 1, random.uniform(0.0, math.tau)
            force = felt(truth[station], face, PLAY * random.standard_normal(2)) + bias[tube]
            yaw = face + turns[tube] + yaw_std * random.standard_normal()
            rows.append((station, tube, stop, *(force + NOISE * random.standard_normal(3)), yaw))
    table = np.array(rows)
    station, tube, stop = (np.ascontiguousarray(column.astype(np.intp)) for column in table.T[:3])
    known = np.full(len(table), NOISE**2)
    gravity = G + GRAVITY_STD * random.standard_normal()  # of the site, which is known no better than its prior says
    forces, yaws = np.ascontiguousarray(table[:, 3:6]) * (gravity / G), table[:, 6].copy()
    looks = Looks(station, tube, np.zeros_like(tube), stop, forces, known, yaws, np.full(len(table), yaw_std**2))
    string = StringPrior(
        np.full(TUBES, 0.01), np.full(TUBES, 1e-6), np.zeros(TUBES + 1), np.diag([TURN_STD**2] * TUBES + [1e-12]), G,
        GRAVITY_STD, PLAY,
    )  # fmt: skip
    across = np.eye(3) - np.outer(told, told)
    md = LENGTH * np.arange(TUBES + 1)
    return looks, string, PathPrior(md, told, DEG**2 * across, CURVATURE, MEMORY), truth


def wandering(random: np.random.Generator, inclination: float) -> tuple[Array, Array]:
    """Directions (6, 3) of a hole whose curvature wanders, and what was told of its collar, which is off by a degree.

    It goes by steps of 5 cm, in a frame that it carries along.
    """
    frame = Rotation.from_euler("zy", [2.0, inclination])
    curvature, step, found = CURVATURE * random.standard_normal(2), 0.05, [frame.apply([0.0, 0.0, 1.0])]
    off = frame * Rotation.from_rotvec([*(DEG * random.standard_normal(2)), 0.0])
    kept = math.exp(-step / MEMORY)
    for _ in range(TUBES):
        for _ in range(round(LENGTH / step)):
            frame *= Rotation.from_rotvec([*(step * curvature), 0.0])
            curvature = kept * curvature + CURVATURE * math.sqrt(1.0 - kept**2) * random.standard_normal(2)
        found.append(frame.apply([0.0, 0.0, 1.0]))
    return np.array(found), off.apply([0.0, 0.0, 1.0])


def felt(tangent: Array, face: float, tilt: Array) -> Array:
    """Specific force of a tube at rest: the shortest turn from the vertical to its axis, after a turn about it."""
    axis = np.cross([0.0, 0.0, 1.0], tangent)
    angle = math.atan2(float(np.linalg.norm(axis)), float(tangent[2]))
    lean = Rotation.from_rotvec(axis / max(float(np.linalg.norm(axis)), 1e-12) * angle)
    body = lean * Rotation.from_euler("z", face)
    return np.asarray(Rotation.from_rotvec([*tilt, 0.0]).apply(body.inv().apply([0.0, 0.0, -G])))


def test_bases_are_carried_along_by_the_shortest_turns() -> None:
    """Each from the one before by the rotation along the great circle, at any bend; across the direction.

    A direction that turns back on itself has no shortest turn: then they are across it all the same.
    """
    random = np.random.default_rng(1)
    tangents = random.normal(size=(40, 3))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    tangents[20] = -tangents[19]
    bases = carried_bases(tangents)
    for k, (before, after) in enumerate(itertools.pairwise(tangents)):
        np.testing.assert_allclose(bases[k + 1] @ bases[k + 1].T, np.eye(2), atol=1e-12)
        np.testing.assert_allclose(bases[k + 1] @ after, 0.0, atol=1e-12)
        np.testing.assert_allclose(np.cross(after, bases[k + 1, 0]), bases[k + 1, 1], atol=1e-12)
        axis = np.cross(before, after)
        if (sine := float(np.linalg.norm(axis))) > 1e-9:
            turn = Rotation.from_rotvec(axis / sine * math.atan2(sine, float(before @ after)))
            np.testing.assert_allclose(bases[k + 1], turn.apply(bases[k]), atol=1e-9)


@pytest.mark.parametrize("slope", [-1.5, -1.0, -0.5, 0.0, 0.5, 0.75])
def test_the_play_that_is_gone_on_with_settles_whatever_way_it_swings(slope: float) -> None:
    """What is found goes as a power of what was tried, about a place of its own; five steps find that."""
    place, tried, var = 2e-8, list[tuple[float, float]](), 3e-6
    for _ in range(5):
        tried.append((var, place * (var / place) ** slope))
        var = faster_play(tried)
    assert var == pytest.approx(place, rel=1e-6)


def squares_of(found: Adjusted, truth: Array) -> Array:
    """Normalised squares (s,) of the errors of inclination and azimuth of the stations, each of two numbers.

    A yaw that is known to some degrees moves a direction on a circle, which is straight in these two alone.
    """
    there = found.now.tangents[1:]
    (inclination, azimuth), (true_inclination, true_azimuth) = polar(there), polar(truth[1:])
    sine = np.sin(inclination)
    down = np.stack([np.cos(inclination) * np.cos(azimuth), np.cos(inclination) * np.sin(azimuth), -sine], axis=1)
    level = np.stack([-np.sin(azimuth), np.cos(azimuth), np.zeros_like(azimuth)], axis=1)
    axes = np.einsum("kpi,kai->kpa", np.stack([down, level], axis=1), found.bases[1:])
    covs = axes @ found.covs[1:, :2, :2] @ np.swapaxes(axes, 1, 2)
    around = np.angle(np.exp(1j * (true_azimuth - azimuth)))
    errors = np.stack([true_inclination - inclination, around * sine], axis=1)
    return np.asarray(np.einsum("ka,kab,kb->k", errors, np.linalg.inv(covs), errors) / 2.0)


def polar(tangents: Array) -> tuple[Array, Array]:
    """Inclination and azimuth (s,) of unit vectors (s, 3)."""
    level = np.hypot(tangents[:, 0], tangents[:, 1])
    return np.arctan2(level, tangents[:, 2]), np.arctan2(tangents[:, 1], tangents[:, 0])


@pytest.mark.parametrize("yaw_std_deg", [0.02, 3.0])
@pytest.mark.parametrize("inclination_deg", [0.5, 30.0, 88.0, 90.5, 120.0, 140.0, 179.5])
def test_directions_are_within_their_sigmas_at_every_inclination(inclination_deg: float, yaw_std_deg: float) -> None:
    """300 stations, five a hole that share their tubes: the mean of their squares is one within its standard error."""
    squares = []
    for seed in range(60):
        looks, string, path, truth = drawn_hole(seed, inclination_deg * DEG, yaw_std_deg * DEG, np.zeros(TUBES))
        squares.append(squares_of(adjust_hole(looks, string, path), truth))
    assert 0.75 < np.mean(squares) < 1.3


@pytest.mark.parametrize("turn_deg", [25.0, 100.0, 170.0])
def test_an_untold_joint_is_found_from_what_other_tubes_saw(turn_deg: float) -> None:
    turns = np.array([0.0, 0.0, turn_deg * DEG, 0.0, 0.0])
    looks, string, path, truth = drawn_hole(3, 4.0 * DEG, 0.02 * DEG, turns)
    cov = string.turn_cov.copy()
    cov[2, 2] = math.pi**2 / 3.0
    found = adjust_hole(looks, replace(string, turn_cov=cov), path)
    std = math.sqrt(found.common_cov[2 * OF_TUBE + TURN, 2 * OF_TUBE + TURN])
    assert std < 2.0 * DEG
    assert found.now.tubes[2, TURN] == pytest.approx(turns[2], abs=4.0 * std)
    assert np.max(squares_of(found, truth)) < 8.0


@pytest.mark.slow
@pytest.mark.parametrize("yaw_std_deg", [10.0, 20.0])
@pytest.mark.parametrize("inclination_deg", [0.5, 30.0, 60.0, 90.5, 120.0, 140.0, 150.0, 179.5])
def test_yaws_that_are_hardly_known_leave_sigmas_honest_and_inclinations_as_sharp(
    inclination_deg: float, yaw_std_deg: float
) -> None:
    """The hole wanders as its prior has it. Inclinations are as good as with yaws well known, and as those of a look.

    Beside the vertical a yaw tells a lean from a bias, and they are as good as a look alone at the least.
    """
    squares, off, alone = list[Array](), dict[float, list[Array]]({0.02: [], yaw_std_deg: []}), list[Array]()
    for seed in range(40):
        for std, errors in off.items():
            looks, string, path, truth = drawn_hole(seed, inclination_deg * DEG, std * DEG, np.zeros(TUBES), True)
            found = adjust_hole(looks, string, path)
            true_inclination = polar(truth)[0]
            errors.append(polar(found.now.tangents[1:])[0] - true_inclination[1:])
        squares.append(squares_of(found, truth))
        read = np.arctan2(np.hypot(looks.force[:, 0], looks.force[:, 1]), -looks.force[:, 2])
        alone.append(read - true_inclination[looks.station])
    assert 0.65 < np.mean(squares) < 1.4  # of 40 holes, whose stations share their azimuth
    well, poorly = (float(np.sqrt(np.mean(np.square(errors)))) for errors in off.values())
    assert poorly < 1.05 * well or not 1.0 < inclination_deg < 179.0
    assert poorly < 0.6 * np.sqrt(np.mean(np.concatenate(alone) ** 2))
