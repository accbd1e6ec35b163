"""``borechain node`` and ``python -m node``: what a tube's board runs."""

from __future__ import annotations

import click

from node.process.tube_options import TubeRequest, tube_options
from telemetry.runtime.command_line import check_installed, plain_faults
from telemetry.runtime.process_options import EndsRequest, PlaceRequest


@click.command()
@tube_options
@plain_faults
def node(request: TubeRequest, ends: EndsRequest, place: PlaceRequest) -> None:
    """Run the node of one tube until it is stopped.

    \b
    Examples:
      borechain node --tube 1 --drive-joint-deg 12.5 --folder state/tube-1
      borechain node --tube 1 --imu mpu6500:1:0x68 --imu mpu6500:1:0x69
      borechain node --tube 1 --clock own --imu mpu6500:1 --above 2 --folder state/tube-1
      borechain node --tube 2 --clock own --imu mpu6500:1 --upper can:can0 --lower can:can1
      borechain node --tube 2 --clock own --imu mpu6500:1 --kernel fixed --compiled-by c
    """
    if request.compiled_by == "c":
        from node.uncompiled.numba_stand_in import stand_in_for_numba

        stand_in_for_numba()  # before the first kernel is imported

    from node.process.drivers.choice import imu_source
    from node.process.drivers.mpu_chips import CHIPS
    from node.process.node_host import run_node

    sources = request.imus.sources
    if any(source.partition(":")[0] in CHIPS for source in sources):
        check_installed("smbus2")
    settings = request.to_settings()
    own_time = ends.to_own_time(request.tube, ("--imu", sources))
    run_node(place.to_place(), settings, [imu_source(source) for source in sources], own_time)
