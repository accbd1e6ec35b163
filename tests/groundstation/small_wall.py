"""A wall of six short columns from files, and a verdict on it by hand: every number differs and none is zero.

Straight holes with told covariances, so that positions, deviations and their sigma have a closed form.
"""

import math
from pathlib import Path

import numpy as np

from groundstation.survey.wall.wall_file import Wall
from groundstation.survey.wall.wall_joints import ExtraColumn, Joints
from groundstation.survey.wall.wall_system import SystemProbability
from groundstation.survey.wall.wall_verdict import Finding, FindingKind, Judgement, WallVerdict

WALL = """name = "East pit"
radius_m = 0.6
radius_cv = 0.03
thickness_m = 0.55
depth_step_m = 2
head_sigma_m = 0.004
tolerance = "20 mm + 1:100"
heads = "heads.csv"
stations = "stations.csv"
length_m = 4
serial = "R-17"
calibration = "K-31"
project = "Station square"
client = "City railways"
gravity_mps2 = 9.81234
height_datum = "DHHN2016"
northing_m = 5000.5
easting_m = 300.25
height_m = 31.4
"""
HEADS = """column,north_m,east_m,state,serial,calibration,drilled_to_m,drilled_on,radius_m
A,0,0,,,,,2026-03-02,
B,0,0.9,,,,,2026-03-04,
C,0,1.8,,,,4,2026-03-02,0.65
D,0,2.7,not-drilled,,,,,
E,0,3.6,,R-18,K-40,,2026-03-05,
F,0,4.5,drilled,,,,2026-03-05,
"""
# inclination and azimuth (deg), last station (m) and covariance there (nn, ne, nd, ee, ed, dd; m^2)
HOLES = {
    "A": (0.3, 30.0, 4.0, (4e-6, 1e-6, 2e-7, 9e-6, 3e-7, 1e-6)),
    "B": (1.2, 200.0, 4.0, (25e-6, -6e-6, 1e-7, 16e-6, 2e-7, 2e-6)),
    "C": (0.4, 90.0, 2.0, (1e-6, 0.0, 0.0, 36e-6, 0.0, 3e-6)),
    "E": (0.1, 315.0, 4.0, (8e-6, 3e-6, 0.0, 5e-6, 0.0, 4e-6)),
}
HEAD_STD = 0.004


def write_wall(folder: Path, wall: str = WALL, heads: str = HEADS) -> Path:
    lines = [
        "column,md_m,inclination_deg,azimuth_deg,time_s,cov_nn_m2,cov_ne_m2,cov_nd_m2,cov_ee_m2,cov_ed_m2,cov_dd_m2"
    ]
    for name, (inclination, azimuth, last, cov) in HOLES.items():
        for md in (0.0, 2.0, 4.0):
            if md <= last:
                told = ",".join(f"{md / last * one:.12g}" for one in cov)
                time = "" if name == "E" else f"{100.0 + md:g}"
                lines.append(f"{name},{md:g},{inclination},{azimuth},{time},{told}")
    (folder / "stations.csv").write_text("\n".join(lines) + "\n")
    (folder / "heads.csv").write_text(heads)
    (folder / "wall.toml").write_text(wall)
    return folder / "wall.toml"


NAN = math.nan


def judgement_of(wall: Wall) -> Judgement:
    """A verdict by hand on the five joints at 0, 2 and 4 m."""
    thickness = [[0.7, 0.65, 0.66], [0.8, 0.54, 0.6], [0.9, NAN, NAN], [NAN, NAN, NAN], [0.71, 0.72, 0.73]]
    probability = [[1e-3, 2e-3, 4e-3], [1e-4, 0.61, 0.2], [1e-5, 1.0, 1.0], [1.0, 1.0, 1.0], [1e-9, 0.012, 2e-3]]
    states = [[0, 0, 0], [0, 0, 1], [0, 2, 2], [2, 2, 2], [3, 0, 0]]
    size = np.array(thickness)
    north, east = np.meshgrid([-0.01, -0.02, -0.03], [0.05, 0.07, 0.11, 0.13, 0.17])
    offset = np.stack([north, east], axis=-1)  # (joints, depths, 2)
    joints = Joints(wall.pairs, size + 0.1, size, np.array(probability), offset, np.array(states, np.int8))
    findings = [
        Finding(
            FindingKind.THIN, "B-C", 2.0, 2.0, "joint B-C is 0.540 m thick at the least from 2 to 2 m; required 0.55 m"
        ),
        Finding(FindingKind.MISSING, "D", 0.0, 4.0, "column D is missing from 0 to 4 m"),
    ]
    extras = [
        (1, ExtraColumn(0.25, 1.35, 2.0, 4.0, False)),
        (2, ExtraColumn(0.0, 2.7, 0.0, 4.0, True)),
        (3, ExtraColumn(0.0, 2.7, 0.0, 4.0, True)),
    ]
    system = SystemProbability(0.0234, 0.0056, True)
    return Judgement(WallVerdict.NOT_TIGHT, findings, joints, [], system, extras)
