"""Stops at which every tube of a hand-fed rig surveys, in a hole that builds; one accelerometer may step."""

from __future__ import annotations

import math
import random

from hand_fed import COV, Rig

from telemetry.messages import ImuMean, NodeFlag, SurveyMeasurement

G = 9.81
NOISE, JOINT_STD = 6e-4, 1e-3  # m/s^2 and rad
LEAN_DEG, BUILD_DEG, AZIMUTH_DEG = 0.6, 0.15, 250.0
STEPPED_TUBE, STEPS_AT = 3, 5


def survey_stop(rig: Rig, stop: int, step_mps2: float = 0.0) -> None:
    """Add a tube on top, turn the string to any angle, and have all tubes survey; tube 3 steps from stop 5 on."""
    rig.speak(stop)
    rig.depth(2.0 * stop)
    drawn = random.Random(stop)
    face, at = drawn.uniform(0.0, math.tau), rig.now
    for tube in range(1, stop + 1):
        station, yaw = stop - tube + 1, (face + 0.3 * tube) % math.tau
        inclination, azimuth = math.radians(LEAN_DEG + BUILD_DEG * station), math.radians(AZIMUTH_DEG) - yaw
        across = math.sin(inclination)
        up = (across * math.cos(azimuth), across * math.sin(azimuth), -math.cos(inclination))
        x, y, z = (G * one + NOISE * drawn.gauss(0.0, 1.0) for one in up)
        x += step_mps2 if tube == STEPPED_TUBE and stop >= STEPS_AT else 0.0
        imus, error = (ImuMean((x, y, z), COV),), station * JOINT_STD**2
        message = SurveyMeasurement(tube, station, at, station, imus, yaw, 1e-8, error, 32, 20.0, NodeFlag.NONE)
        rig.ground.on_message(message, rig.now)
    rig.run(3.0)
    rig.speak(stop)
