"""A tube does not lie in the axis of the hole: it has play in it, and a bow of its own.

Model: at every stop each tube lies with another small tilt, two axes, independent of the stop before and of the other
tubes; while the string turns the tilt goes evenly from one to the next. A bow is the same tilt for good, fixed in the
tube as a mount is. The rate of the tilt itself, some 1e-5 deg/s, is not felt.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
from pydantic import Field

from sim.kernel import kernel, shared_body
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.motion import Trapezoid
from sim.world.random_streams import RandomStream, random_stream
from sim.world.scenario_file import ScenarioFile
from sim.world.section import ScenarioSection
from sim.world.truth import lean_rotation

MOST: Final = 128  # tilts of a tube that a campaign keeps


class PlaySection(ScenarioSection):
    """Tilts of a tube against the axis of the hole, 1 sigma of each of two axes."""

    sigma_deg: float = Field(0.0, ge=0.0, le=2.0, description="another one at every stop")
    bow_deg: float = Field(0.0, ge=0.0, le=2.0, description="the same for good, one for each tube")


def draw_play(imu: OneImu) -> Array:
    """Pitch and roll (blocks + 1, 2) rad of one tube: before the first turning and after each."""
    section = imu.section_of(PLAY)
    if not section.sigma_deg and not section.bow_deg:
        return np.zeros((1, 2))
    at_stops = random_stream(imu.seed, RandomStream.PLAY, imu.tube, 0).standard_normal((imu.file.blocks + 1, 2))
    bow = random_stream(imu.seed, RandomStream.PLAY, imu.tube, 1).standard_normal(2)
    return np.asarray(np.radians(section.sigma_deg * at_stops + section.bow_deg * bow))


def block_times(file: ScenarioFile) -> tuple[float, float]:
    """Time (s) of a block, and of the turning in it."""
    rotation, schedule = file.rotation, file.schedule
    rate, acceleration = math.radians(rotation.rate_dps), math.radians(rotation.acceleration_dps2)
    turning = Trapezoid(rotation.turns * math.tau, rate, acceleration).duration
    return schedule.add_s + turning + schedule.stop_s, turning


def tilts_at(tilts: Array, t: Array, block: float, turning: float) -> Array:
    """Pitch and roll (n, 2) rad at times (n,) s after the start of the first turning."""
    k = np.clip(np.floor(t / block).astype(np.int64), -1, len(tilts) - 2)
    share = np.clip((t - k * block) / turning, 0.0, 1.0)[:, None]
    before, after = tilts[np.maximum(k, 0)], tilts[k + 1]
    return np.asarray(before + share * (after - before))


def lean_in_hole(samples: ImuSamples, imu: OneImu, tilts: Array) -> None:
    """Turn rates and forces from a tube in the axis into one that leans."""
    if not tilts.any():
        return
    pitch, roll = tilts_at(tilts, samples.t - imu.turns_from, *block_times(imu.file)).T
    axis = np.stack([np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)], axis=1)
    frame = lean_rotation(axis)
    samples.rate = np.einsum("nij,nj->ni", frame, samples.rate)
    samples.force = np.einsum("nij,nj->ni", frame, samples.force)


def set_times(shared: Any, file: ScenarioFile) -> None:
    """Schedule of the blocks; no block where there is no play."""
    section = PLAY.section_of(file)
    if section.sigma_deg or section.bow_deg:
        shared["play_block"], shared["play_turning"] = block_times(file)
        shared["play_from"], shared["play_last"] = file.schedule.begin_s + file.schedule.add_s, file.blocks - 1


def set_tilts(tube: Any, tilts: Array) -> None:
    """Tilts of a tube; more than are kept belong to a scenario that is refused."""
    count = min(len(tilts), MOST)
    tube["play"][:count] = tilts[:count]


@shared_body
def feel_play(shared: Any, tube: Any, now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Lean as the tube does at the end of the cycle."""
    if shared.play_block > 0.0:
        since = now.end - shared.play_from
        k = int(min(max(math.floor(since / shared.play_block), -1.0), shared.play_last))
        share = min(max((since - k * shared.play_block) / shared.play_turning, 0.0), 1.0)
        before = max(k, 0)
        pitch = tube.play[before, 0] + share * (tube.play[k + 1, 0] - tube.play[before, 0])
        roll = tube.play[before, 1] + share * (tube.play[k + 1, 1] - tube.play[before, 1])
        lean_row(row, math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll))


@kernel
def lean_row(row: Array, x: float, y: float, z: float) -> None:
    """Turn rates and forces of a ``row`` as ``lean_rotation`` of the axis (x, y, z) does."""
    c = 1.0 / (1.0 + z)
    for at in (0, 3):
        u, v, w = row[at], row[at + 1], row[at + 2]
        row[at] = (1.0 - c * x * x) * u - c * x * y * v + x * w
        row[at + 1] = -c * x * y * u + (1.0 - c * y * y) * v + y * w
        row[at + 2] = -x * u - y * v + z * w


def has_many(file: ScenarioFile) -> dict[str, bool]:
    """A campaign keeps the tilts of so many stops."""
    return {"disturbance.play": "play" in file.disturbance and file.blocks >= MOST}


PLAY = Disturbance(
    "play",
    (),
    ActsOn.FELT,
    lean_in_hole,
    draw_play,
    Compiled(
        shared=(("play_from", "f8"), ("play_block", "f8"), ("play_turning", "f8"), ("play_last", "f8")),  # s, and block
        tube=(("play", "f8", (MOST, 2)),),  # rad
        set_shared=set_times,
        set_tube=set_tilts,
        felt=feel_play,
    ),
    has_many,
    PlaySection,
)
