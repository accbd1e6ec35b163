"""What instruments know of single stations of a wall: used as an independent Monte Carlo says, or refused by name."""

import math
from pathlib import Path

import numpy as np
import pytest
import walls_by_sampling as sampling

from groundstation.errors import SurveyError
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import read_wall

DEG = math.pi / 180.0
RADIUS, THICKNESS, SPACING, LENGTH, STEP = 0.6, 0.8, 0.75, 14.0, 2.0
RAKE = 15.0 * DEG
BIAS, GRAVITY = 0.002 * DEG, 9.81  # of the instrument `relay`
DRAWS = 40_000


def made(folder: Path, columns: str, cells: str, more: str = "") -> Path:
    """Two columns side by side, raked by 15 deg across the wall; ``cells`` stand at every station but the head."""
    (folder / "heads.csv").write_text(f"column,north_m,east_m\nA,0,0\nB,0,{SPACING}\n")
    rows = []
    for name in "AB":
        for md in np.arange(0.0, LENGTH + 1e-9, STEP):
            rows.append(f"{name},{md},15,0" + (f",{cells}" if md > 0.0 else "," * len(cells.split(","))))
    (folder / "stations.csv").write_text(
        f"column,md_m,inclination_deg,azimuth_deg,{columns}\n" + "\n".join(rows) + "\n"
    )
    path = folder / "wall.toml"
    path.write_text(
        f'radius_m = {RADIUS}\nthickness_m = {THICKNESS}\nheads = "heads.csv"\nstations = "stations.csv"\n'
        f"inclination_deg = 15\nlength_m = {LENGTH}\n{more}"
    )
    return path


def chance_by_drawing(yaw: float, systematic: float, force: float, readings: float) -> float:
    """P(thinner than required) at the toe of two columns whose readings are drawn, positions added up leg by leg."""
    rng = np.random.default_rng(53)
    count = round(LENGTH / STEP)
    feet = []
    for east in (0.0, SPACING):
        lean = rng.normal(0.0, force / GRAVITY, (2, DRAWS, count)) + rng.normal(
            0.0, BIAS / math.sqrt(readings), (2, DRAWS, 1)
        )
        inclination = RAKE + math.cos(RAKE) * lean[0]  # the design leans to the north
        azimuth = rng.normal(0.0, yaw, (DRAWS, count)) + rng.normal(0.0, systematic, (DRAWS, 1))
        azimuth += math.cos(RAKE) / math.sin(RAKE) * lean[1]
        zero = np.zeros((DRAWS, 1))
        i, a = np.hstack([zero + RAKE, inclination]), np.hstack([zero, azimuth])
        t = np.stack([np.sin(i) * np.cos(a), np.sin(i) * np.sin(a), np.cos(i)], axis=-1)
        foot = 0.5 * STEP * (t[:, 1:] + t[:, :-1]).sum(axis=1)
        across = np.stack([math.cos(RAKE) * foot[:, 0] - math.sin(RAKE) * foot[:, 2], foot[:, 1] + east], axis=-1)
        feet.append(across)
    radii = np.full(DRAWS, RADIUS)
    return float(np.mean(sampling.joint_thickness(feet[0], feet[1], radii, radii) < THICKNESS))


@pytest.mark.parametrize(
    ("yaw_deg", "systematic_deg", "force", "readings"),
    [(0.02, 1.2, 1e-3, 1), (3.0, 1.2, 1e-3, 1), (6.0, 0.02, 1e-3, 4), (0.02, 0.02, 0.35, 1), (0.5, 2.5, 0.1, 3)],
)
def test_the_probability_moves_with_the_stations_own_sigmas(
    tmp_path: Path, yaw_deg: float, systematic_deg: float, force: float, readings: int
) -> None:
    columns = "sigma_yaw_deg,sigma_systematic_deg,sigma_force_mps2,measurements"
    path = made(tmp_path, columns, f"{yaw_deg},{systematic_deg},{force},{readings}")
    found = judge_wall(read_wall(path))
    drawn = chance_by_drawing(yaw_deg * DEG, systematic_deg * DEG, force, readings)
    assert 0.005 < drawn < 0.5
    error = math.sqrt(drawn * (1.0 - drawn) / DRAWS)
    # the model is linear in the readings; they are drawn as they are
    assert float(found.joints.probability[0, -1]) == pytest.approx(drawn, abs=4.0 * error + 0.02 * drawn)


def test_columns_that_the_instrument_asks_for_may_be_of_one_column_alone(tmp_path: Path) -> None:
    path = made(tmp_path, "sigma_yaw_deg", "3")
    stations = path.with_name("stations.csv")
    text = stations.read_text()
    both = read_wall(path).columns.covs[:, -1, 1, 1]
    stations.write_text(
        "\n".join(x[:-2] + "," if x.startswith("B,") and x.endswith(",3") else x for x in text.splitlines())
    )
    one = read_wall(path).columns.covs[:, -1, 1, 1]
    assert one[0] == pytest.approx(both[0], rel=1e-12)
    assert one[1] < 0.3 * both[1]


@pytest.mark.parametrize(
    ("columns", "cells", "more", "named"),
    [
        (
            "sigma_yaw_deg",
            "0.5",
            'instrument = "mwd-rev5.1"\n',
            "column A: sigma_yaw_deg: the instrument mwd-rev5.1 has",
        ),
        (
            "sigma_force_mps2",
            "0.1",
            'instrument = "gyro-continuous"\n',
            "sigma_force_mps2: the instrument gyro-continuous",
        ),
        (
            "sigma_yaw_deg",
            "-1",
            "",
            "line 3: column A: sigma_yaw_deg: expected a number that is not negative, got '-1'",
        ),
        ("sigma_yaw_deg", "wide", "", "sigma_yaw_deg: expected a number that is not negative, got 'wide'"),
        ("measurements", "0", "", "measurements: expected a number of 1 or more, got '0'"),
    ],
)
def test_what_an_instrument_has_no_use_for_is_refused_by_name(
    tmp_path: Path, columns: str, cells: str, more: str, named: str
) -> None:
    with pytest.raises(SurveyError) as error:
        read_wall(made(tmp_path, columns, cells, more))
    assert named in str(error.value)
    assert "\n" not in str(error.value)


def test_a_station_without_its_sigma_among_others_is_refused(tmp_path: Path) -> None:
    path = made(tmp_path, "sigma_yaw_deg", "3")
    stations = path.with_name("stations.csv")
    stations.write_text(stations.read_text().replace("A,6.0,15,0,3", "A,6.0,15,0,"))
    with pytest.raises(
        SurveyError, match="line 5: column A: sigma_yaw_deg: expected a number that is not negative, got"
    ):
        read_wall(path)
