"""The disturbances of a field, each as a scenario by itself: one node on a string that turns and rests twice.

Aiding comes at a random phase of the node's cycle. Joints and mounts are exact, so that what is wrong is the
disturbance's. docs/field.md says where each size is from.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sim.studies.scenarios import Tables, change_sections, complete_string

BLOCKS = 2
FEWEST, LARGEST = 5, 8  # disturbances of a bad day
FINE_HZ = 1000.0  # of the samples where something vibrates
BASE: Tables = {
    "rig": complete_string(1),
    "path": {"straight": {"inclination_deg": 2.0}},
    "schedule": {"add_s": 55.0, "stop_s": 40.0, "finish_s": 5.0, "blocks": BLOCKS},
    "rotation": {"turns": 12.0},
    "joints": {"reading_std_deg": 0.0, "mount_std_deg": 0.0},
    "accelerometer": {"bias_std_deg": 0.0},
    "encoder": {"phase": "random"},
    "gyroscope": {"increments": True},
    "medium": {"link": "off", "loss": 0.0},
    "rough": {"samples_hz": 250.0},
}
PULL = {"g_sensitivity_dps_per_g": 0.1}
MPU = {"frames_hz": 50.0, "low_pass_hz": 20.0}


@dataclass(frozen=True, slots=True)
class DisturbanceCase:
    """One row, whose constants may be drawn (``sim.studies.field.drawn_constants``).

    ``unseen``: reason for which one node by itself cannot observe it, if any.
    """

    key: str
    name: str
    setup: Tables
    unseen: str = ""
    by_ground: bool = False  # the ground station makes up for it, so it is judged by what comes of the surveys there
    true_faults: tuple[str, ...] = ()  # of sensors, which this world has
    judges_ramps: bool = False  # the first seconds of a turning count too
    has_state: bool = False  # the filter estimates it, so it is to be sharp
    mild: tuple[Tables, ...] = ()  # of which ``FEWEST`` to ``LARGEST`` come together


def _rough(hertz: float = 250.0, **sections: Mapping[str, Any]) -> Tables:
    return change_sections(BASE, rough={"samples_hz": hertz, **sections})


def _means_alone(setup: Tables) -> Tables:
    return change_sections(setup, gyroscope={"increments": False})


def _at(setup: Tables, inclination_deg: float) -> Tables:
    return {**setup, "path": {"straight": {"inclination_deg": inclination_deg}}}


def _shaken(turning_g: float) -> Tables:
    return _rough(FINE_HZ, vibration={"turning_g": turning_g}, sensor={**MPU, **PULL})


def _grown(wrong_mark_deg: float) -> Tables:
    setup = _rough(string={"wrong_mark_deg": wrong_mark_deg})
    return change_sections(setup, rig={"tubes": 2, "tubes_at_start": 1}, joints={"reading_std_deg": 0.05})


def _uneven() -> Tables:
    return _rough(sensor={"scale_asymmetry": 2e-3}, drive={"turns_back_deg": 30.0})


def _bent(setup: Tables) -> Tables:
    """The azimuth turns by 30 deg, a third of it above the first stop before the run begins."""
    return {**setup, "path": {"spiral": {"inclination_deg": 30.0, "turn_deg": 30.0}}}


CLIPPED = ("force_saturated",)
MARK = "the first mark of a string is all that ties it to the reference"
SCALE = "an encoder that misses a part of every turn is a gyroscope that shows too much; other nodes show the same"

CASES = (
    DisturbanceCase("locked", "clean, cycles locked", change_sections(_rough(), encoder={"phase": "locked"})),
    DisturbanceCase("random-phase", "clean, random phase", _rough()),
    DisturbanceCase("means", "the same, of a sensor that gives means alone", _means_alone(_rough())),
    DisturbanceCase(
        "mpu6500",
        "MPU-6500: frames of 50 Hz behind 20 Hz, crystal 1 % off",
        _rough(FINE_HZ, sensor={**MPU, "crystal": 0.01}),
    ),
    DisturbanceCase("ripple", "ripple of 30 %, 4 s", _rough(drive={"ripple": 0.3})),
    DisturbanceCase("stick-slip", "stick-slip", _rough(drive={"stick_slip": 1.0})),
    DisturbanceCase("vibration-4g", "vibration 4 g while turning", _shaken(4.0), true_faults=CLIPPED),
    DisturbanceCase("vibration-8g", "vibration 8 g while turning", _shaken(8.0), true_faults=CLIPPED),
    DisturbanceCase("torsional", "torsional vibration 20 deg/s", _rough(FINE_HZ, vibration={"torsional_dps": 20.0})),
    DisturbanceCase(
        "resting-vibration", "vibration 0.05 g at rest", _rough(FINE_HZ, vibration={"resting_g": 0.05}, sensor=MPU)
    ),
    DisturbanceCase("g-sensitivity", "g-sensitivity 0.1 deg/s/g at 30 deg", _at(_rough(sensor=PULL), 30.0)),
    DisturbanceCase(
        "misalignment",
        "misalignment 0.05 deg at 88 deg",
        _at(change_sections(_rough(), gyroscope={"misalignment_std_deg": 0.05}), 88.0),
    ),
    DisturbanceCase("clean-88", "clean, 88 deg", _at(_rough(), 88.0)),
    DisturbanceCase("jitter", "time stamps jitter by 5 ms", _means_alone(_rough(sensor={"jitter_ms": 5.0}))),
    DisturbanceCase(
        "jitter-fifo", "the same, of a FIFO that is read", _rough(FINE_HZ, sensor={**MPU, "jitter_ms": 5.0})
    ),
    DisturbanceCase("asymmetry", "scale asymmetry 2e-3, turned back by 30 deg", _uneven()),
    DisturbanceCase(
        "earth",
        "earth rate at 50 deg of latitude",
        change_sections(BASE, rough={"samples_hz": 250.0, "latitude_deg": 50.0}),
    ),
    DisturbanceCase("warm-up-0.2", "warm-up drift 0.2 deg/s", _rough(sensor={"warm_up_dps": 0.2, "warm_up_c": 10.0})),
    DisturbanceCase("warm-up-1", "warm-up drift 1 deg/s", _rough(sensor={"warm_up_dps": 1.0, "warm_up_c": 20.0})),
    DisturbanceCase("eccentric-0.02", "encoder eccentric by 0.02 deg", _rough(encoder={"eccentricity_deg": 0.02})),
    DisturbanceCase("eccentric-0.05", "encoder eccentric by 0.05 deg", _rough(encoder={"eccentricity_deg": 0.05})),
    DisturbanceCase("backlash-0.1", "backlash 0.1 deg", _rough(string={"backlash_deg": 0.1})),
    DisturbanceCase("backlash-0.5", "backlash 0.5 deg", _rough(string={"backlash_deg": 0.5})),
    DisturbanceCase("dead-stop", "head stops dead at 10 deg/s", _rough(drive={"dead_stop_dps": 10.0})),
    DisturbanceCase("turns-back", "head turns back by 5 deg", _rough(drive={"turns_back_deg": 5.0})),
    DisturbanceCase(
        "unwinds", "unwinds 0.5 deg at rest", _rough(string={"twist_deg": 0.5, "hold_s": 5.0, "unwind_s": 20.0})
    ),
    DisturbanceCase("untold-twist", "untold twist of 2 deg", _rough(string={"twist_deg": 2.0})),
    DisturbanceCase(
        "transport",
        "30 deg, through 20 deg of azimuth",
        _bent(_rough(string={"transport": "parallel"})),
        by_ground=True,
    ),
    DisturbanceCase("outliers-5", "outliers 5 %", _rough(encoder={"outliers": 0.05})),
    DisturbanceCase("outliers", "outliers 20 %", _rough(encoder={"outliers": 0.2})),
    DisturbanceCase("mark-5", "mark misread by 5 deg", _grown(5.0)),
    DisturbanceCase("mark-180", "mark misread by 180 deg", _grown(180.0)),
    DisturbanceCase("first-mark", "first mark misread by 5 deg", _rough(string={"wrong_mark_deg": 5.0}), MARK),
    DisturbanceCase("jump", "encoder jumps by 1 deg", _rough(encoder={"jump_deg": 1.0, "jump_s": 85.0})),
    DisturbanceCase(
        "jump-index", "the same, with an index", _rough(encoder={"jump_deg": 1.0, "jump_s": 85.0, "index": True})
    ),
    DisturbanceCase("belt-slip", "belt slip of 1e-3", _rough(encoder={"belt_slip": 1e-3}), SCALE),
    DisturbanceCase("backwards", "encoder counts backwards", _rough(encoder={"reversed": True})),
    DisturbanceCase(
        "force-bias",
        "accelerometer bias 1 mg",
        change_sections(_rough(), accelerometer={"bias_std_deg": math.degrees(1e-3)}),
    ),
)
ALL = "all"
