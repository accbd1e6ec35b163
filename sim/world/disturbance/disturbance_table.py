"""The table of disturbances, in the order in which they act.

A new one is a module beside these with its ``Disturbance``, and one line here. What it is called, which keys of a
scenario it owns and what a campaign makes of it stand in its row alone.
"""

from __future__ import annotations

from typing import Final

from sim.world.disturbance.accelerometer import FORCE_BIAS, FORCE_NOISE
from sim.world.disturbance.asymmetry import ASYMMETRY
from sim.world.disturbance.axes_exchanged import AXES_EXCHANGED
from sim.world.disturbance.bias_step import BIAS_STEP
from sim.world.disturbance.calibration_exchanged import CALIBRATION_EXCHANGED
from sim.world.disturbance.converter import CLIPPED_FORCES, CLIPPED_RATES, RANGE, STEPS
from sim.world.disturbance.counter_stands import COUNTER_STANDS
from sim.world.disturbance.counts_lost import COUNTS_LOST
from sim.world.disturbance.drift import DRIFT
from sim.world.disturbance.earth_rate import EARTH_RATE
from sim.world.disturbance.eighths import EIGHTHS
from sim.world.disturbance.fifo import FRAMES, JITTER
from sim.world.disturbance.force_pull import PULL_ACROSS, PULL_ALONG
from sim.world.disturbance.force_step import FORCE_STEP
from sim.world.disturbance.gyroscope import GYROSCOPE
from sim.world.disturbance.joint_slips import JOINT_SLIPS
from sim.world.disturbance.lost_cycles import LOST_CYCLES
from sim.world.disturbance.low_pass import LOW_PASS
from sim.world.disturbance.mount_slip import MOUNT_SLIP
from sim.world.disturbance.mount_tilt import MOUNT_TILT
from sim.world.disturbance.row import Disturbance
from sim.world.disturbance.slow_twist import SLOW_TWIST
from sim.world.disturbance.tube_play import PLAY
from sim.world.disturbance.vibration import RECTIFICATION, TORSIONAL, VIBRATION
from sim.world.disturbance.wander import WANDER
from sim.world.disturbance.warm_up import WARM_UP
from sim.world.disturbance.whirl import WHIRL
from sim.world.disturbance.white_noise import SINGLE_SAMPLES, WHITE_NOISE

TABLE: Final[tuple[Disturbance, ...]] = (
    COUNTER_STANDS,
    COUNTS_LOST,
    SLOW_TWIST,
    JOINT_SLIPS,
    TORSIONAL,
    EARTH_RATE,
    PLAY,
    MOUNT_SLIP,
    MOUNT_TILT,
    VIBRATION,
    WHIRL,
    RECTIFICATION,
    PULL_ACROSS,
    ASYMMETRY,
    CLIPPED_RATES,
    CLIPPED_FORCES,
    LOW_PASS,
    FRAMES,
    JITTER,
    LOST_CYCLES,
    SINGLE_SAMPLES,
    BIAS_STEP,
    WARM_UP,
    DRIFT,
    GYROSCOPE,
    WANDER,
    WHITE_NOISE,
    PULL_ALONG,
    STEPS,
    RANGE,
    EIGHTHS,
    FORCE_BIAS,
    FORCE_STEP,
    CALIBRATION_EXCHANGED,
    FORCE_NOISE,
    AXES_EXCHANGED,
)
