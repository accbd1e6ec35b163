"""What the compiled reading knows of a scenario and of a tube: records of fields that the rows of the table name.

A kernel reads a field of a record at no cost, where every array that it is given costs some nanoseconds a call.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from sim.world.disturbance.disturbance_table import TABLE
from sim.world.disturbance.frame_layout import CIRCLE, SLACK_RATE, SUMS, TORSIONAL
from sim.world.disturbance.row import Compiled, OneImu
from sim.world.scenario_file import ScenarioFile

FORMS: Final[tuple[Compiled, ...]] = tuple(row.compiled for row in TABLE if row.compiled is not None)
SHARED: Final = np.dtype([field for form in FORMS for field in form.shared], align=True)
TUBE: Final = np.dtype(
    [
        ("cos", "f8"),  # of the angle of the IMU's frame with the head at 0
        ("sin", "f8"),
        ("gains", "f8", (3, 6)),  # what the gyroscopes show of the rates and forces that they feel
        ("force_gains", "f8", (3, 3)),  # what the accelerometers show of the forces
        ("shows", "f8", (SUMS,)),  # what the z gyroscope shows of each sum over frames
        *(field for form in FORMS for field in form.tube),
    ],
    align=True,
)


def make_shared(file: ScenarioFile) -> Array:
    """What all tubes of a scenario have in common, (1,) of dtype ``SHARED``; the same for all runs."""
    shared = np.zeros(1, SHARED)
    for form in FORMS:
        if form.set_shared is not None:
            form.set_shared(shared, file)
    return shared


def make_tubes(file: ScenarioFile, seed: int, frame: Array) -> Array:
    """Sensors of the tubes of a seed, (tubes,) of dtype ``TUBE``; ``frame`` (tubes,) rad, of their IMUs."""
    tubes = np.zeros(len(frame), TUBE)
    for number, (tube, angle) in enumerate(zip(tubes, frame.tolist(), strict=True), 1):
        imu, gains = OneImu(file, seed, number), np.eye(6)
        for row in TABLE:
            if row.compiled is None:
                continue
            drawn = None if row.draw is None else row.draw(imu)
            if row.compiled.gains is not None:
                gains = row.compiled.gains(drawn, file) @ gains
            if row.compiled.set_tube is not None:
                row.compiled.set_tube(tube, drawn)
        tube["cos"], tube["sin"] = math.cos(angle), math.sin(angle)
        tube["gains"], tube["force_gains"] = gains[:3], gains[3:, 3:]
        tube["shows"] = shown_sums(gains[2], math.cos(angle), math.sin(angle))
    return tubes


def shown_sums(gains: Array, c: float, s: float) -> Array:
    """What an axis of a gyroscope of ``gains`` (6,) shows of each sum over frames (SUMS,), its frame turned by c, s."""
    shows = np.zeros(SUMS)
    for at in (0, 3):
        shows[at], shows[at + 1] = c * gains[at] - s * gains[at + 1], s * gains[at] + c * gains[at + 1]
        shows[at + 2] = gains[at + 2]
    shows[SLACK_RATE] = shows[TORSIONAL] = gains[2]
    shows[CIRCLE : CIRCLE + 2] = gains[3:5]
    return shows
