"""What a field does to a string that a laboratory does not: the table ``[rough]`` of a scenario, every effect off.

docs/field.md names the source of each figure. Without the table the world is that of the other pages.
"""

from __future__ import annotations

import math
from typing import Literal

from pydantic import Field

from sim.world.section import NotNegative, Positive, Probability, ScenarioSection


class RoughDriveSection(ScenarioSection):
    """How the drive head turns."""

    ripple: float = Field(0.0, ge=0.0, le=1.0, description="swing of the rate, of itself")
    ripple_s: Positive = Field(4.0, description="of one swing")
    stick_slip: float = Field(0.0, ge=0.0, le=1.0, description="1: the head stands for a part of every swing")
    stick_slip_s: Positive = Field(5.0, description="of one swing")
    dead_stop_dps: NotNegative = Field(0.0, description="rate from which the head stops dead; 0: it is braked to rest")
    turns_back_deg: NotNegative = Field(0.0, le=90.0, description="after every stop, within 3 s")
    stop_spread_deg: NotNegative = Field(0.0, le=360.0, description="drawn up to so much more turning before each stop")


class RoughStringSection(ScenarioSection):
    """How the string follows the head, untold by any torque."""

    backlash_deg: NotNegative = Field(0.0, le=10.0, description="play; a string that stops runs on into it")
    run_on_s: Positive = Field(0.3, description="in which it does")
    twist_deg: NotNegative = Field(0.0, le=90.0, description="by which the string lags the head while it is driven")
    hold_s: NotNegative = Field(2.0, description="after the stop, until the twist unwinds")
    unwind_s: NotNegative = Field(3.0, description="that this takes; 0: it stays until the string is driven again")
    wrong_mark_deg: float = Field(0.0, ge=-180.0, le=180.0, description="by which the first mark read is misread")
    transport: Literal["shortest", "parallel"] = Field(
        "shortest", description="yaw of a tube in a bent hole: that of the head, or as a shaft without twist carries it"
    )


class RoughEncoderSection(ScenarioSection):
    """The encoder and how it sits on the head."""

    eccentricity_deg: NotNegative = Field(0.0, le=5.0, description="amplitude of the error of once a turn")
    belt_slip: float = Field(0.0, ge=0.0, le=0.1, description="part of the turning that it misses")
    jump_deg: float = Field(0.0, ge=-180.0, le=180.0, description="counts that appear from nowhere, once")
    jump_s: NotNegative = Field(0.0, description="after the start")
    index: bool = Field(False, description="a pulse once a turn of the head sets the counter right")
    reversed: bool = Field(False, description="wired the wrong way round: it counts backwards")
    outliers: Probability = Field(0.0, description="share of the readings that are off")
    outlier_deg: NotNegative = Field(1.0, description="1 sigma of these")
    stuck_bit: int = Field(-1, ge=-1, le=11, description="of the counter, that is always set; -1: none")


class RoughVibrationSection(ScenarioSection):
    """Vibration of a tube; its spectrum is flat between two frequencies."""

    turning_g: NotNegative = Field(0.0, description="rms of each axis while the string turns")
    resting_g: NotNegative = Field(0.0, description="likewise while it rests")
    torsional_dps: NotNegative = Field(0.0, description="rms of the rate about the axis while it turns")
    lowest_hz: Positive = 20.0
    highest_hz: Positive = 300.0


class RoughSensorSection(ScenarioSection):
    """Front end of every IMU: samples, filter, FIFO, clock. A node knows its filter, as a driver does."""

    frames_hz: NotNegative = Field(0.0, le=1000.0, description="of the FIFO; 0: the exact mean of every cycle")
    low_pass_hz: NotNegative = Field(0.0, description="of two poles, before the frames; 0: none")
    delay_off_ms: float = Field(0.0, ge=-10.0, le=10.0, description="by which the filter delays more than a node knows")
    crystal: float = Field(0.0, ge=-0.2, le=0.2, description="by which its frames come too fast, of 1")
    jitter_ms: NotNegative = Field(0.0, le=100.0, description="of the time stamp of every cycle")
    stamp_step_ms: float = Field(
        0.0, ge=-100.0, le=100.0, description="by which all time stamps are off from a time on"
    )
    stamp_step_s: NotNegative = Field(0.0, description="after the start, that time")
    force_range_g: Positive = 8.0
    g_sensitivity_dps_per_g: NotNegative = Field(0.0, description="of the gyroscope, each axis to each force; 1 sigma")
    scale_asymmetry: float = Field(
        0.0, ge=-0.1, le=0.1, description="of the gyroscope: its scale in one direction less that in the other"
    )
    rectification_dps_per_g2: NotNegative = Field(0.0, description="of the gyroscope, each axis, under vibration")
    warm_up_dps: float = Field(0.0, ge=-10.0, le=10.0, description="drift of each gyroscope until it is warm")
    warm_up_s: Positive = Field(120.0, description="time constant of that")
    warm_up_c: NotNegative = Field(0.0, le=100.0, description="by which the sensor warms meanwhile")

    @property
    def delay(self) -> float:
        """Delay (s) of slow changes by the filter, as a node knows it: of two poles 1 / (sqrt(2) pi f)."""
        plain = 0.0 if self.low_pass_hz == 0.0 else 1.0 / (math.sqrt(2.0) * math.pi * self.low_pass_hz)
        return plain - 1e-3 * self.delay_off_ms


class RoughSection(ScenarioSection):
    """The field's world."""

    samples_hz: float = Field(1000.0, ge=50.0, le=5000.0, description="at which motion and vibration are followed")
    latitude_deg: float | None = Field(
        None, ge=-90.0, le=90.0, description="where the gyroscopes feel the earth turn; without it they do not"
    )
    drive: RoughDriveSection = RoughDriveSection()
    string: RoughStringSection = RoughStringSection()
    encoder: RoughEncoderSection = RoughEncoderSection()
    vibration: RoughVibrationSection = RoughVibrationSection()
    sensor: RoughSensorSection = RoughSensorSection()
