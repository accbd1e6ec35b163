"""What hosts a node or the encoder, whether a launcher forked it or its command started it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from node.firmware.kernel_choice import kernel_of
from node.firmware.torque import TorqueSettings
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.compiler import leave_blas_out
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.step.precompile import warm_encoder, warm_step
from node.process.board_watch import BoardPlaces
from node.process.drivers.replay_drivers import ReplayImu
from node.process.drivers.source import EncoderSource, ImuSource
from node.process.drivers.timed import TimedImu
from node.process.encoder_process import EncoderProcess
from node.process.tube_process import TubeProcess
from telemetry.messages import ENCODER, Side
from telemetry.runtime.hosting import OwnTime, Place, run_by_own_clock, run_stepped, warn_of_keys, write_warning
from telemetry.runtime.timing import CycleTiming
from telemetry.transport.authentication import read_key

if TYPE_CHECKING:
    from telemetry.application.seals import Seals


def seals_at(place: Path | None, address: int, reach: int, rig: str | None = None) -> Seals | None:
    """Seals of a process with an end on either side; without keys no cryptography is loaded."""
    if place is None:
        return None
    from telemetry.application.seals import seals_of

    return seals_of(place, address, Side, reach, rig)


def run_node(
    place: Place, settings: TubeSettings, imus: Sequence[ImuSource] = (), own_time: OwnTime | None = None
) -> None:
    """Node of one tube until a signal comes; ``imus`` are its own sensors."""
    leave_blas_out()
    key = read_key(place.key_file) if place.key_file is not None else None
    seals = seals_at(place.keys, settings.tube, settings.reach, place.rig)

    def build(timing: CycleTiming | None = None) -> TubeProcess:
        board = BoardPlaces(place.folder, place.keys, place.media, has_clock=own_time is not None)
        process = TubeProcess(settings, place.folder, key=key, imus=imus, timing=timing, seals=seals, places=board)
        for imu in imus:
            if isinstance(imu, ReplayImu | TimedImu) and imu.understood:
                write_warning(name, imu.understood)
        loop = kernel_of(settings.kernel)
        warm_step(loop.step, loop.aiding)  # half a minute on a cold machine: before the token of life
        return process

    name = f"node {settings.tube}"
    warn_of_keys(name, seals)
    if own_time is None:
        run_stepped(name, place, settings.tube, build)
    else:
        run_by_own_clock(name, place, settings.tube, own_time, build, PERIOD)


def run_encoder(
    place: Place,
    source: EncoderSource | None = None,
    own_time: OwnTime | None = None,
    torque: TorqueSettings | None = None,
    reach: int = 1,
) -> None:
    """Encoder node on the drive head; ``source`` is its own counter, ``torque`` that of the drive.

    ``reach`` is of its radio, in tubes.
    """
    leave_blas_out()
    seals = seals_at(place.keys, ENCODER, reach, place.rig)

    def build(timing: CycleTiming | None = None) -> EncoderProcess:
        # on a board a new folder cannot be told from one that was lost
        process = EncoderProcess(place.folder, source, torque, timing, reach, seals=seals, is_new=own_time is None)
        warm_encoder()
        return process

    warn_of_keys("encoder", seals)
    if own_time is None:
        run_stepped("encoder", place, ENCODER, build)
    else:
        run_by_own_clock("encoder", place, ENCODER, own_time, build, PERIOD)
