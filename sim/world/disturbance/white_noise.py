"""White noise of a gyroscope: the angle random walk."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from sim.kernel import kernel, shared_body
from sim.world.disturbance.lanes import Lane
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import GyroSection, ScenarioFile

SAMPLE_RATE_HZ = 65.0  # of the gyroscope, whose single sample has the noise of this band. Source: thesis Table V.1


def noise_densities(gyroscope: GyroSection, period: float) -> tuple[float, float, float]:
    """Noise (deg/s/sqrt(Hz)) of means over ``period`` (s), or of single samples as if they were such means."""
    if not gyroscope.instantaneous:
        return gyroscope.noise_dps_rthz
    spread = math.sqrt(period * SAMPLE_RATE_HZ)
    x, y, z = (noise * spread for noise in gyroscope.noise_dps_rthz)
    return x, y, z


def add_white(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add the noise of each sample."""
    density = np.array([imu.noise * x for x in noise_densities(imu.file.gyroscope, samples.period)])
    white = np.radians(density) / math.sqrt(samples.period)
    samples.rate = samples.rate + white * imu.random(RandomStream.GYRO).standard_normal(samples.rate.shape)


def set_white(shared: Any, file: ScenarioFile) -> None:
    """Noise of the mean of a cycle, or of a frame."""
    white = np.radians(np.array(file.gyroscope.noise_dps_rthz))
    if file.rough is None:
        shared["white"] = white / math.sqrt(PERIOD)
    else:
        shared["white"] = white * math.sqrt(file.rough.sensor.frames_hz)


@shared_body
def read_white(shared: Any, _tube: Any, now: Any, drawn: Array, at: int, row: Array) -> None:
    """Noise of a mean; about z that of frames comes by the parts of the window."""
    row[0] += shared.white[0] * now.share * drawn[at]
    row[1] += shared.white[1] * now.share * drawn[at + 1]
    if now.is_mean:
        row[2] += shared.white[2] * now.share * drawn[at + 2]


@shared_body
def part_white(
    shared: Any,
    _tube: Any,
    _now: Any,
    drawn: Array,
    at: int,
    further: Array,
    borders: Array,
    pieces: int,
    parts: Array,
) -> None:
    """Noise about z of the parts of a window."""
    add_part_noise(parts, borders, pieces, shared.white[2], drawn[at + 2], further)


@kernel
def add_part_noise(noise: Array, borders: Array, pieces: int, size: float, first: float, drawn: Array) -> None:
    """Add the noise (PARTS + 1,) of the parts of a window, a sum over frames of ``size`` each.

    A frame that a border divides gives either part its share of one noise.

    Parameters
    ----------
    borders : (PARTS + 2,) of the parts, in frames
    first, drawn : normal, of the whole frames of the first part and of the others, then of the frames that are divided
    """
    left, begin = 0.0, math.floor(borders[0])
    for piece in range(pieces):
        end = math.floor(borders[piece + 1])
        of_whole = first if piece == 0 else drawn[piece - 1]
        noise[piece] += left + size * math.sqrt(float(max(end - begin, 0))) * of_whole
        if piece < pieces - 1:
            share, divided = borders[piece + 1] - end, size * drawn[PARTS + piece]
            noise[piece] += share * divided
            left, begin = (1.0 - share) * divided, end + 1


WHITE_NOISE = Disturbance(
    "white-noise",
    ("gyroscope.noise_dps_rthz",),
    ActsOn.SAMPLES,
    add_white,
    compiled=Compiled(
        shared=(("white", "f8", (3,)),),  # rad/s
        set_shared=set_white,
        lane=Lane.WHITE,
        read=read_white,
        parts=part_white,
    ),
)
SINGLE_SAMPLES = Disturbance("single-samples", ("gyroscope.instantaneous",), ActsOn.TAKING)
