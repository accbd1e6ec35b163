"""The axes x and y of both sensors of one tube are exchanged, from a time on: a cable put in again the wrong way."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sim.kernel import shared_body
from sim.world.disturbance.one_tube import NEVER, OneTubeSection, is_later, starts_at
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.scenario_file import ScenarioFile

SWAPPED: Final = [1, 0, 2]  # axes


class AxesExchangedSection(OneTubeSection):
    """Of whom, and since when."""


def is_exchanged(imu: OneImu) -> bool:
    """Whether it befalls this tube at all."""
    return AXES_EXCHANGED.name in imu.file.disturbance and imu.section_of(AXES_EXCHANGED).tube == imu.tube


def exchange_axes(samples: ImuSamples, imu: OneImu, is_it: bool) -> None:
    """Exchange x and y of rates and forces."""
    if is_it:
        later = is_later(imu, imu.section_of(AXES_EXCHANGED), samples.t)[:, None]
        samples.rate = np.where(later, samples.rate[:, SWAPPED], samples.rate)
        samples.force = np.where(later, samples.force[:, SWAPPED], samples.force)


def set_exchange_time(shared: Any, file: ScenarioFile) -> None:
    """When they are exchanged."""
    at = starts_at(file, AXES_EXCHANGED.section_of(file))
    shared["exchanged_at"] = at if AXES_EXCHANGED.name in file.disturbance else NEVER


def set_exchanged(tube: Any, is_it: bool) -> None:
    """Whether it is this tube."""
    tube["axes_exchanged"] = is_it


@shared_body
def read_exchanged(shared: Any, tube: Any, now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Exchange x and y of rates and forces."""
    if now.end > shared.exchanged_at and tube.axes_exchanged == 1:
        row[0], row[1] = row[1], row[0]
        row[3], row[4] = row[4], row[3]


AXES_EXCHANGED = Disturbance(
    "axes-exchanged",
    (),
    ActsOn.SAMPLES,
    exchange_axes,
    is_exchanged,
    Compiled(
        shared=(("exchanged_at", "f8"),),  # s, rig time
        tube=(("axes_exchanged", "i8"),),
        set_shared=set_exchange_time,
        set_tube=set_exchanged,
        read=read_exchanged,
    ),
    section=AxesExchangedSection,
)
