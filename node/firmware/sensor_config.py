"""The filter's configuration of a node with a sensor of its own, by what is known of that sensor.

Its noise, and how long its bias lasts, are those of a record at rest where there is one. A gyroscope that was
calibrated nowhere has the scale that its datasheet allows, not that of a turn table. A louder sensor scatters more at
rest, and a rest is what scatters no more than it does.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from node.firmware.imu_settings import UNCORRECTED
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD, Array
from node.kernels.record.filter_record import default_config
from telemetry.parameters import ParameterBlock

# standard deviation of a scale factor out of the box. Source: MPU-6000/MPU-6050 product specification 3.4, 6.1:
# sensitivity scale factor tolerance +-3 % at 25 C, taken for two standard deviations
BARE_SCALE_STD: Final = 0.015
SCATTER: Final = 6.0  # standard deviations of a cycle's mean, within which a rest is one


def is_bare(settings: TubeSettings, parameters: ParameterBlock) -> bool:
    """Whether any gyroscope of the node is corrected by nothing, neither by its own file nor by the block in use."""
    return parameters.gyroscope == UNCORRECTED and any(imu.gyroscope == UNCORRECTED for imu in settings.imus)


def sensor_config(settings: TubeSettings, parameters: ParameterBlock) -> Array:
    """Configuration of a node that reads sensors of its own, one record of dtype ``CONFIG``."""
    config = default_config()
    record = config[0]
    if is_bare(settings, parameters):
        record["scale_std"] = BARE_SCALE_STD
    if settings.gyro_noise is not None:
        record["gyro_noise"], record["bias_std"] = settings.gyro_noise.white, settings.gyro_noise.bias_std
        record["bias_tau"] = settings.gyro_noise.bias_tau
    loudest = record["gyro_noise"] * max(imu.noise for imu in settings.imus) / np.sqrt(PERIOD)
    scatter = max(float(loudest[2]), 0.5 * float(loudest[:2].max()))  # about x and y twice as much is a rest
    record["still_rate"] = max(float(record["still_rate"]), SCATTER * scatter)
    return config
