"""What the sensors of a rough world feel at most: whether a converter stays inside its range in every run."""

from __future__ import annotations

import math

from sim.world.disturbance.vibration import G
from sim.world.rough_motion import BACK_WITHIN, WIND
from sim.world.rough_section import RoughSection
from sim.world.scenario_file import ScenarioFile

RAREST = 6.0  # sigma, up to which a vibration must stay inside a range
SLIP = 5.0 / 3.0  # of the mean rate, by which a stick-slip turns faster than that
STEPPING = 2.0  # times its mean, above the rate of any smooth step
PULLS = 3.0  # sigma of a drawn sensitivity to force, on each of three axes


def most_turning(file: ScenarioFile, rough: RoughSection) -> float:
    """Rate at which a string turns at most, deg/s: that of the drive, as it swings, and of what follows a stop."""
    rotation, drive = file.rotation, rough.drive
    swung = (drive.ripple * drive.ripple_s + drive.stick_slip * drive.stick_slip_s) / math.pi
    driven = rotation.rate_dps * (1.0 + drive.ripple + SLIP * drive.stick_slip) + rotation.acceleration_dps2 * swung
    play, back = rough.string.backlash_deg / rough.string.run_on_s, drive.turns_back_deg / BACK_WITHIN
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
