"""Strings that are drawn tube by tube and stop by stop, with one thing wrong: rotations and normal numbers only."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from groundstation.survey.adjustment.looks import Looks, PathPrior, StringPrior
from groundstation.survey.adjustment.run_of_stops import JOINT, MOUNT, NORTH, RunOfStops, TurnCauses

Array = npt.NDArray[np.float64]
DEG = math.pi / 180.0
MG = 9.80665e-3
LEG = 2.0
HOUR = 3600.0
# least, middling and gross, in the unit of the comment
SIZES = {
    "bias_stepped": (1.0, 4.0, 17.0),  # mg
    "bias_creeps": (0.4, 2.0, 8.0),  # mg an hour, which is a stop
    "bias_wrong": (6.0, 20.0, 60.0),  # mg
    "tilt_slipped": (0.1, 0.5, 2.0),  # deg
    "tilt_wrong": (0.4, 1.0, 3.0),  # deg
    "mount_turned": (1.0, 5.0, 25.0),  # deg
    "mount_misread": (1.0, 5.0, 25.0),  # deg
    "joint_slipped": (1.0, 5.0, 25.0),  # deg
    "joint_misread": (2.0, 8.0, 30.0),  # deg
    "encoder_slipped": (1.0, 7.2, 30.0),  # deg
    "hole_moved": (0.05, 0.15, 0.5),  # deg
    "depth_wrong_once": (0.5, 1.0, 2.0),  # m
    "depth_wrong_from": (0.5, 1.0, 2.0),  # m
    "axes_exchanged": (1.0,),
    "tubes_exchanged": (1.0,),
    "look_wrong": (4.0, 12.0, 50.0),  # mg
    "encoder_drifts": (0.3, 1.0, 7.2),  # deg a stop
}


@dataclass(frozen=True)
class DrawnString:
    """What the ground station is given, and what was so."""

    looks: Looks
    string: StringPrior
    path: PathPrior
    run: RunOfStops
    tangents: Array  # (s + 1, 3) of the hole as it is in the end
    tube: int  # the one that is wrong
    other: int  # and the one it changed places with
    onset: int


def chain_causes(
    from_bit: Sequence[int], make_up_sizes: Sequence[int], joint_std: float, mount_std: float, north_std: float
) -> TurnCauses:
    """Causes of a plain chain that grows on top: a joint turns what lies below it once it is made, a mount its tube.

    The zero of the encoder against north turns all.

    Parameters
    ----------
    from_bit : tubes in their order from the bit up
    make_up_sizes : (u,) how many tubes the string had at each make-up
    joint_std, mount_std, north_std : rad
    """
    count, sizes = len(from_bit), np.asarray(make_up_sizes)
    places = np.argsort(from_bit)
    joints = np.arange(1, count)[:, None]  # the one below the tube at that place
    # together, of a look of the tube at place a with b tubes in the string: 1 where a < joint < b
    of_tubes = [np.where(places >= joints, -1.0, 0.0), np.eye(count), np.ones((1, count))]
    of_make_ups = [np.where(sizes > joints, 1.0, 0.0), np.zeros((count + 1, len(sizes)))]
    names = [*((JOINT, tube) for tube in from_bit[:-1]), *((MOUNT, tube) for tube in range(count)), (NORTH, -1)]
    stds = np.array([joint_std] * (count - 1) + [mount_std] * count + [north_std])
    return TurnCauses(tuple(names), np.concatenate(of_tubes), np.concatenate(of_make_ups), stds)


def draw_string(
    seed: int,
    kind: str = "none",
    size: float = 0.0,
    *,
    count: int = 10,
    bias_mg: float = 1.0,
    tilt_deg: float = 0.05,
    play_deg: float = 0.01,
    same_faces: bool = False,
    begins_deg: float = 0.0,
) -> DrawnString:
    """Draw a string that drills ``count`` stations of 2 m, building 0.34 deg in each, and looks at each as it passes.

    It begins with an inclination of ``begins_deg``, 0 to 180 deg.
    All that the priors name is drawn from them; ``kind`` and ``size`` say what is wrong beside, see ``SIZES``.
    """
    rng = np.random.default_rng([seed, ["none", *SIZES].index(kind)])
    md = np.arange(count + 1) * LEG
    lean, azimuth = (
        (begins_deg + 0.34 * np.arange(count + 1)) * DEG,
        rng.uniform(0.0, 360.0) * DEG + rng.normal(0.0, 0.005),
    )
    tangents = np.stack([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)], axis=1)
    biases, tilts = rng.normal(0.0, bias_mg * MG, (count, 3)), rng.normal(0.0, tilt_deg * DEG, (count, 2))
    joints, mounts = rng.normal(0.0, 0.1 * DEG, count), rng.normal(0.0, 0.02 * DEG, count)
    north, gravity = rng.normal(0.0, 0.1 * DEG), 9.81 + rng.normal(0.0, 2e-3)
    tube = int(rng.integers(0, count - 4))
    other, onset = tube + int(rng.integers(1, 3)), int(rng.integers(tube + 2, count - 2))
    first_moved = int(rng.integers(2, count - 5))
    moved_from, once = int(rng.integers(first_moved + 2, count - 1)), int(rng.integers(tube + 1, count - 1))
    way, sign = rng.normal(size=3), float(rng.choice([-1.0, 1.0]))
    way /= np.linalg.norm(way)
    around = rng.uniform(0.0, 2.0 * np.pi)
    across = np.array([np.cos(around), np.sin(around)])
    biases[tube] = way * size * MG if kind == "bias_wrong" else biases[tube]
    tilts[tube] = across * size * DEG if kind == "tilt_wrong" else tilts[tube]
    mounts[tube] = sign * size * DEG if kind == "mount_misread" else mounts[tube]
    joints[tube] = sign * size * DEG if kind == "joint_misread" else joints[tube]
    faces, face = rng.uniform(0.0, 2.0 * np.pi, count), 0.0
    rows = []
    for stop in range(count):
        face = face if same_faces else rng.uniform(0.0, 2.0 * np.pi)
        for one in range(stop + 1):
            station, since = stop - one + 1, stop >= onset
            at = md[station]
            if (kind == "depth_wrong_once" and stop == onset) or (kind == "depth_wrong_from" and since):
                at += sign * size
            if kind == "tubes_exchanged" and one in (tube, other) and stop >= other:
                at = md[stop - (other if one == tube else tube) + 1]
            d = direction_at(at, md, tangents)
            if kind == "hole_moved" and stop >= moved_from and first_moved <= station <= first_moved + 2:
                d = d + np.append(size * DEG * across, 0.0)
                d /= np.linalg.norm(d)
            psi = face + faces[one]
            told = psi + north + joints[one:stop].sum() + mounts[one] + rng.normal(0.0, 0.02 * DEG)
            tilt = tilts[one] + rng.normal(0.0, play_deg * DEG, 2)
            if since and (
                (kind == "mount_turned" and one == tube)
                or (kind == "joint_slipped" and one <= tube < stop)
                or kind == "encoder_slipped"
            ):
                told += sign * size * DEG
            if kind == "encoder_drifts":
                told += sign * size * DEG * stop
            if since and kind == "tilt_slipped" and one == tube:
                tilt = tilt + across * size * DEG
            force = read_force(d, psi, tilt, gravity) + biases[one] + rng.normal(0.0, 2e-4, 3)
            if one == tube and since and kind in ("bias_stepped", "bias_creeps"):
                force += way * size * MG * (stop - onset + 1 if kind == "bias_creeps" else 1)
            if one == tube and since and kind == "axes_exchanged":
                force = force[[1, 0, 2]]
            if one == tube and stop == once and kind == "look_wrong":
                force += way * size * MG
            rows.append((station, one, stop, force, told))
    stations, tubes, stops, forces, yaws = (np.array(part) for part in zip(*rows, strict=True))
    if kind == "hole_moved":
        tangents[first_moved : first_moved + 3, :2] += size * DEG * across
    looks = Looks(
        stations, tubes, stops, stops, forces, np.full(len(rows), 2e-4**2), yaws, np.full(len(rows), (0.02 * DEG) ** 2)
    )
    causes = chain_causes(range(count), range(1, count + 1), 0.1 * DEG, 0.02 * DEG, 0.1 * DEG)
    string = StringPrior(
        np.full(count, bias_mg * MG),
        np.full(count, tilt_deg * DEG),
        np.zeros(2 * count),
        causes.cov + 1e-12 * np.eye(2 * count),
        9.81,
        2e-3,
        play_deg * DEG,
    )
    across = np.eye(3) - np.outer(tangents[0], tangents[0])
    path = PathPrior(md, tangents[0].copy(), across * (0.5 * DEG) ** 2, 0.15 * DEG, 20.0)
    run = RunOfStops(md[1:], np.arange(count) * HOUR, md, causes)
    return DrawnString(looks, string, path, run, tangents, tube, other, onset)


def direction_at(at: float, md: Array, tangents: Array) -> Array:
    """Direction (3,) of a hole that bends evenly between its stations and beyond the last."""
    last = tangents[-1] + (tangents[-1] - tangents[-2]) * max(0.0, at - md[-1]) / LEG
    d = last if at > md[-1] else np.array([np.interp(at, md, one) for one in tangents.T])
    return np.asarray(d / np.linalg.norm(d))


def read_force(d: Array, psi: float, tilt: Array, gravity: float) -> Array:
    """Force (3,) that a tube along d, turned by psi about it and tilted, reads without noise."""
    c, s = math.cos(psi), math.sin(psi)
    m = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, -1.0]]) @ d
    return np.asarray(gravity * Rotation.from_rotvec([tilt[0], tilt[1], 0.0]).apply(m))
