"""What a campaign cannot express, by the key of the scenario that asks for it."""

from __future__ import annotations

import math

from sim.errors import ScenarioError
from sim.world.rough_imu import AT_RANGE, G
from sim.world.rough_motion import BACK_WITHIN, RUN_ON, WIND
from sim.world.rough_section import RoughSection
from sim.world.scenario import Scenario
from sim.world.scenario_file import ScenarioFile

RAREST = 6.0  # sigma, up to which a vibration must stay inside a range
SLIP = 5.0 / 3.0  # of the mean rate, by which a stick-slip turns faster than that
STEPPING = 2.0  # times its mean, above the rate of any smooth step
PULLS = 3.0  # sigma of a drawn sensitivity to force, on each of three axes


def refuse_others(scenario: Scenario) -> None:
    """Refuse what a campaign cannot express.

    Raises
    ------
    ScenarioError
        Names the key and the command that can.
    """
    file = scenario.file
    beyond = {
        "torsion": file.torsion is not None,
        "calibration": file.calibration is not None,
        "drift": file.drift is not None,
        "faults": bool(scenario.faults),
        "joints.unseen_std_deg": file.joints.unseen_std_deg > 0.0,
        "joints.head_turn_deg": file.joints.head_turn_deg > 0.0,
        "joints.mount_tilt_std_deg": file.joints.mount_tilt_std_deg > 0.0,
        "gyroscope.instantaneous": file.gyroscope.instantaneous,
        "gyroscope.increments": file.gyroscope.increments,
        "gyroscope.bias_step_dps": file.gyroscope.bias_step_dps != 0.0,
        "encoder.edge_times = false": not file.encoder.edge_times,
        "node.imus": file.node.imus > 1,
        "node.scheme": file.node.scheme != "forward",
        "node.kernel": file.node.kernel != "float64",
        "node.joints": file.node.joints != "marks",
    }
    if file.rough is None:
        # the means of a plain world's cycles are worked out once, at the ends of the encoder's
        beyond['encoder.phase = "random" without the table rough'] = file.encoder.phase != "locked"
    else:
        beyond |= of_field(file, file.rough)
    for key, found in beyond.items():
        if found:
            raise ScenarioError(
                f"{key}: a campaign cannot express it; borechain rig runs such a scenario, seed by seed"
            )


def of_field(file: ScenarioFile, rough: RoughSection) -> dict[str, bool]:
    """What of the table ``rough`` it cannot, by key.

    What is not linear in the readings (clipping, another scale in the other direction, rectification) cannot be added
    up frame by frame, and a motion that is another one in every run cannot be worked out once.
    """
    sensor, vibration = rough.sensor, rough.vibration
    return {
        "rough.latitude_deg": rough.latitude_deg is not None,
        "rough.drive.stop_spread_deg": rough.drive.stop_spread_deg > 0.0,
        'rough.string.transport = "parallel"': rough.string.transport == "parallel",
        "rough.encoder.jump_deg": rough.encoder.jump_deg != 0.0,
        "rough.vibration.resting_g": vibration.resting_g > 0.0,
        "rough.sensor.frames_hz = 0": sensor.frames_hz == 0.0,
        "rough.sensor.low_pass_hz = 0": sensor.low_pass_hz == 0.0,
        "rough.sensor.jitter_ms": sensor.jitter_ms > 0.0,
        "rough.sensor.scale_asymmetry": sensor.scale_asymmetry != 0.0,
        "rough.sensor.rectification_dps_per_g2": sensor.rectification_dps_per_g2 > 0.0,
        "rough.sensor.force_range_g": most_force(file, rough) >= AT_RANGE * sensor.force_range_g,
        "gyroscope.range_dps": most_rate(file, rough) >= AT_RANGE * file.gyroscope.range_dps,
    }


def most_turning(file: ScenarioFile, rough: RoughSection) -> float:
    """Rate at which a string turns at most, deg/s: that of the drive, as it swings, and of what follows a stop."""
    rotation, drive = file.rotation, rough.drive
    swung = (drive.ripple * drive.ripple_s + drive.stick_slip * drive.stick_slip_s) / math.pi
    driven = rotation.rate_dps * (1.0 + drive.ripple + SLIP * drive.stick_slip) + rotation.acceleration_dps2 * swung
    play, back = rough.string.backlash_deg / RUN_ON, drive.turns_back_deg / BACK_WITHIN
    unwinding = rough.string.twist_deg / min(WIND, rough.string.unwind_s or WIND)
    return driven + STEPPING * (play + back + unwinding)


def most_force(file: ScenarioFile, rough: RoughSection) -> float:
    """What an accelerometer feels at most, g: gravity, vibration, and the circle about the axis."""
    a, vibration = file.accelerometer, rough.vibration
    circle = a.radius_m * (math.radians(most_turning(file, rough)) ** 2 + math.radians(file.rotation.acceleration_dps2))
    torsional = a.radius_m * math.radians(vibration.torsional_dps) * math.tau * vibration.highest_hz
    return (a.gravity_mps2 + circle) / G + RAREST * (vibration.turning_g + torsional / G)


def most_rate(file: ScenarioFile, rough: RoughSection) -> float:
    """What a gyroscope feels at most, deg/s."""
    pull = PULLS * math.sqrt(3.0) * rough.sensor.g_sensitivity_dps_per_g * most_force(file, rough)
    return most_turning(file, rough) + RAREST * rough.vibration.torsional_dps + pull
