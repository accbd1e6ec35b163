"""The field's disturbances in a second world.

A cycle is told of if the node carries a doubt in it or in one of the ten after it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from second_world import BEGIN, BLOCKS, DRILL, HOLD, PERIOD, STOP, Cycles, Disturbance, SecondWorld

from node.firmware.inputs import ImuReading, RigContext
from node.firmware.tube import Tube
from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from telemetry.messages import Aiding, Event, NodeFlag, NodeState, SurveyMeasurement

Array = npt.NDArray[np.float64]
MPU, PULL = {"frames_hz": 50.0, "low_pass_hz": 20.0}, {"pull_dps_per_g": 0.1}
ROWS: dict[str, Disturbance] = {
    "clean, cycles locked": Disturbance(locked=True),
    "clean, random phase": Disturbance(),
    "the same, of a sensor that gives means alone": Disturbance(increments=False),
    "MPU-6500: frames of 50 Hz behind 20 Hz, crystal 1 % off": Disturbance(crystal=0.01, **MPU),
    "ripple of 30 %, 4 s": Disturbance(ripple=0.3),
    "stick-slip": Disturbance(stick_slip=True),
    "vibration 4 g while turning": Disturbance(turning_g=4.0, **MPU, **PULL),
    "vibration 8 g while turning": Disturbance(turning_g=8.0, **MPU, **PULL),
    "torsional vibration 20 deg/s": Disturbance(torsional_dps=20.0),
    "vibration 0.05 g at rest": Disturbance(resting_g=0.05, **MPU),
    "g-sensitivity 0.1 deg/s/g at 30 deg": Disturbance(inclination_deg=30.0, **PULL),
    "misalignment 0.05 deg at 88 deg": Disturbance(inclination_deg=88.0, lean_deg=0.05),
    "clean, 88 deg": Disturbance(inclination_deg=88.0),
    "time stamps jitter by 5 ms": Disturbance(jitter_ms=5.0, increments=False),
    "the same, of a FIFO that is read": Disturbance(jitter_ms=5.0, **MPU),
    "scale asymmetry 2e-3, turned back by 30 deg": Disturbance(asymmetry=2e-3, turns_back_deg=30.0),
    "earth rate at 50 deg of latitude": Disturbance(earth=math.tau / 86164.1),
    "warm-up drift 0.2 deg/s": Disturbance(warm_up_dps=0.2, warm_up_c=10.0),
    "warm-up drift 1 deg/s": Disturbance(warm_up_dps=1.0, warm_up_c=20.0),
    "encoder eccentric by 0.02 deg": Disturbance(eccentricity_deg=0.02),
    "encoder eccentric by 0.05 deg": Disturbance(eccentricity_deg=0.05),
    "backlash 0.1 deg": Disturbance(backlash_deg=0.1),
    "backlash 0.5 deg": Disturbance(backlash_deg=0.5),
    "head stops dead at 10 deg/s": Disturbance(dead_stop_dps=10.0),
    "head turns back by 5 deg": Disturbance(turns_back_deg=5.0),
    "unwinds 0.5 deg at rest": Disturbance(twist_deg=0.5, hold_s=5.0, unwind_s=20.0),
    "untold twist of 2 deg": Disturbance(twist_deg=2.0),
    "30 deg, through 20 deg of azimuth": Disturbance(inclination_deg=30.0, azimuth_turn_deg=10.0),
    "outliers 5 %": Disturbance(outliers=0.05),
    "outliers 20 %": Disturbance(outliers=0.2),
    "mark misread by 5 deg": Disturbance(wrong_mark_deg=5.0),
    "mark misread by 180 deg": Disturbance(wrong_mark_deg=180.0),
    "first mark misread by 5 deg": Disturbance(wrong_mark_deg=5.0),
    "encoder jumps by 1 deg": Disturbance(jump_deg=1.0),
    "the same, with an index": Disturbance(jump_deg=1.0, index=True),
    "belt slip of 1e-3": Disturbance(belt_slip=1e-3),
    "encoder counts backwards": Disturbance(reversed=True),
    "accelerometer bias 1 mg": Disturbance(force_bias_g=1e-3),
}
TRUE_FAULTS = {name: ("force_saturated",) for name in ROWS if name.startswith("vibration") and "turning" in name}
DOUBTS = NodeFlag.YAW_UNTRUSTED | NodeFlag.INNOVATION_REJECTED | NodeFlag.RATE_EXCEEDED | NodeFlag.SENSOR_FAULT
DOUBTS |= NodeFlag.BIAS_UNKNOWN
FAULTS = ("gyro_saturated", "gyro_stuck", "gyro_step", "gyro_scale", "force_saturated", "force_stuck", "bad_sample")
CLOCK_STD, LATENCY, MARK_STD = 2e-4, 3e-3, math.radians(0.05)
OPENED, CLOSED = BEGIN + HOLD + DRILL + STOP, BEGIN + HOLD + DRILL + STOP + 5.0  # the joint of a tube that is added


@dataclass(frozen=True, slots=True)
class Seen:
    """One seed: (cycles,) of the lowest tube."""

    error: Array  # rad
    var: Array  # rad^2
    told: npt.NDArray[np.bool_]
    turning: npt.NDArray[np.bool_]
    resting: npt.NDArray[np.bool_]
    faults: tuple[str, ...]
    surveys: int


def drill(name: str, seed: int, given: SecondWorld | None = None) -> Seen:
    """Take the nodes of one row through the world of one seed."""
    world = given or SecondWorld(ROWS[name], seed)
    what = world.what
    random, phase = world.random, 0.0 if what.locked else float(world.random.uniform(0.0, PERIOD))
    joint, second, misread = *random.uniform(-3.0, 3.0, 2).tolist(), math.radians(what.wrong_mark_deg)
    grows = name.startswith("mark")
    marks = MARK_STD * random.standard_normal(3) if grows else np.zeros(3)
    std = MARK_STD if grows else 0.0
    drives = [joint + float(marks[0]) + (0.0 if grows else misread), second + float(marks[1]) + misread]
    lower = MakeUpAngle(joint - second + float(marks[2]), std)
    upper = TubeSettings(2, MakeUpAngle(drives[1], std), lower, state_every=1)
    tubes = [_tube(TubeSettings(1, MakeUpAngle(drives[0], std), state_every=1))] + ([_tube(upper)] if grows else [])
    sensors = [world.sensor(joint, phase)] + ([world.sensor(second, phase)] if grows else [])
    clocks = CLOCK_STD * random.standard_normal(2)
    said, count, faults, surveys = world.encoder(), len(world.ends), [], set()
    yaw, var, flagged = np.full(count, math.nan), np.full(count, math.nan), np.ones(count, np.bool_)

    def relay(k: int) -> None:
        now, aiding = float(world.ends[k]), said[k]
        if grows and OPENED < now < CLOSED:
            return
        passed: Aiding | None = aiding
        for tube in tubes[::-1] if now > OPENED else tubes[:1]:
            if passed is not None:
                passed = tube.on_aiding(passed, passed.valid_at + float(clocks[tube.settings.tube - 1]))

    for k in range(count):
        end = float(world.ends[k]) + phase
        if phase > LATENCY:
            relay(k)
        for tube, sensor in zip(tubes, sensors, strict=True):
            if k in world.lost or (tube.settings.tube == 2 and end < OPENED):
                continue
            joined = not (grows and OPENED < end < CLOSED)
            hops = len(tubes) - tube.settings.tube + 1 if end > OPENED else 1
            context = RigContext(joined, hops, end, CLOCK_STD**2 * hops, synchronised=True)
            for message in tube.on_cycle(_reading(sensor, k, end), context):
                if tube.settings.tube == 2:
                    continue
                if isinstance(message, NodeState):
                    flagged[k] = bool(message.flags & DOUBTS)
                elif isinstance(message, Event) and message.code in FAULTS:
                    faults.append(message.code)
                surveys |= {message.station_at} if isinstance(message, SurveyMeasurement) else set()
        yaw[k], var[k] = tubes[0].yaw, tubes[0].yaw_var + tubes[0].systematic_var
        if phase <= LATENCY:
            relay(k)
    at = world.ends + phase
    error = np.mod(yaw - joint - world.yaw(at) + math.pi, math.tau) - math.pi
    told = np.array([flagged[k : k + 11].any() for k in range(count)])
    return Seen(error, var, told, world.is_turning(at, 20.0), world.is_resting(at, 5.0), tuple(faults), len(surveys))


def figures(name: str, seen: Sequence[Seen]) -> list[float]:
    """Of the seeds of one row: NEES turning and at rest, unflagged (%), false faults a run, surveys (%)."""
    parts = [[(s.error**2 / s.var)[getattr(s, when) & ~s.told] for s in seen] for when in ("turning", "resting")]
    lies = [np.mean(((s.error**2 > 9.0 * s.var) & ~s.told)[s.turning | s.resting]) for s in seen]
    false = [sum(code not in TRUE_FAULTS.get(name, ()) for code in s.faults) for s in seen]
    means = [float(np.mean(n)) if len(n) else math.nan for n in map(np.concatenate, parts)]
    surveys = float(np.mean([s.surveys for s in seen])) / BLOCKS
    return [*means, 100.0 * float(np.mean(lies)), float(np.mean(false)), 100.0 * surveys]


def _tube(settings: TubeSettings) -> Tube:
    return Tube(settings, default_config(), new_node(default_config()), itertools.count().__next__, restored=False)


def _reading(sensor: Cycles, k: int, end: float) -> ImuReading:
    (wx, wy, wz), (fx, fy, fz) = sensor.rate[k].tolist(), sensor.force[k].tolist()
    heat, clipped, late = float(sensor.temperature[k]), int(sensor.clipped[k]), float(sensor.late[k])
    window = late, float(sensor.late_std[k]), tuple(sensor.parts[k][np.isfinite(sensor.parts[k])].tolist())
    return ImuReading(end - PERIOD, end, (wx, wy, wz), (fx, fy, fz), heat, clipped, *window)
