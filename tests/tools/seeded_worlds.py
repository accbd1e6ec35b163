"""Short worlds with everything on, and one figure of each thing that they show: no draw or term may move unseen."""

from __future__ import annotations

import dataclasses
import io
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from sim.campaign.chunk import Campaign
from sim.instruments.instrument_table import INSTRUMENTS
from sim.string.direct_string import DirectString
from sim.string.head_measurements import measure_head
from sim.studies.scenarios import Tables, change_sections
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.frozen import replace
from telemetry.messages import BASE, ENCODER, SurveyMeasurement

SEED = 7
STRING: Tables = {
    "rig": {"tubes": 3, "tubes_at_start": 1, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": 20.0, "azimuth_deg": 35.0}},
    "schedule": {"add_s": 15.0, "joint_s": 4.0, "stop_s": 23.0, "finish_s": 6.0},
    "rotation": {"turns": 2.5, "rate_dps": 60.0, "acceleration_dps2": 30.0},
    "joints": {"reading_std_deg": 0.4, "mount_std_deg": 0.3, "mount_tilt_std_deg": 0.7, "unseen_std_deg": 0.2},
    "clocks": {"offset_std_s": 3.0, "drift_std_ppm": 25.0},
    "gyroscope": {
        "misalignment_std_deg": 0.5,
        "g_sensitivity_dps_per_g": 0.02,
        "bias_step_dps": 0.3,
        "increments": True,
        "range_dps": 59.0,
        "resolution_dps": 0.01,
    },
    "accelerometer": {"vibration_mps2": 0.4},
    "drift": {"accelerometer_bias_std_mps2": 0.1},
    "node": {"imus": 2, "imu_noise": [1.0, 2.0]},
    "disturbance": {
        "play": {"sigma_deg": 0.5, "bow_deg": 0.4},
        "mount-slip": {"after_s": 50.0, "pitch_deg": 2.0, "roll_deg": -3.0, "turn_deg": 10.0},
        "force-step": {"after_s": 40.0, "step_mg": (1.0, -2.0, 3.0), "creep_mg_per_s": (0.1, 0.2, -0.3)},
        "calibration-exchanged": {"raw_mg": 20.0},
        "axes-exchanged": {"after_s": 70.0},
    },
}
WOUND: Tables = change_sections(
    STRING,
    schedule={"stop_s": 26.0},
    torsion={"bit_torque_nm": 700.0, "wall_friction_nm_per_m": 20.0, "trapped_fraction": 0.1, "stick_slip": 0.5},
    joints={"head_turn_deg": 40.0},
    told={"north_deg": 3.0},
    gyroscope={"instantaneous": True, "increments": False},
)
ROUGH: Tables = change_sections(
    STRING,
    gyroscope={"increments": False, "range_dps": 70.0},
    disturbance={
        "slow-twist": {"twist_deg": 5.0, "wind_s": 4.0, "hold_s": 2.0, "unwind_s": 5.0, "creep_dps": 0.05},
        "joint-slips": {"slip_deg": 2.0},
        "whirl": {"lean_deg": 1.0, "force_g": 0.1},
        "counter-stands": {"after_s": 20.0, "stands_s": 1.0},
        "counts-lost": {"above_dps": 30.0, "share": 0.01},
    },
    rough={
        "samples_hz": 250.0,
        "latitude_deg": 50.0,
        "drive": {"ripple": 0.2, "stick_slip": 0.3, "turns_back_deg": 4.0, "stop_spread_deg": 90.0},
        "string": {"backlash_deg": 1.5, "twist_deg": 6.0, "wrong_mark_deg": 5.0},
        "encoder": {"eccentricity_deg": 0.5, "belt_slip": 0.01, "jump_deg": 20.0, "jump_s": 30.0, "outliers": 0.05},
        "vibration": {"turning_g": 0.3, "resting_g": 0.05, "torsional_dps": 2.0, "highest_hz": 100.0},
        "sensor": {
            "frames_hz": 50.0,
            "low_pass_hz": 20.0,
            "delay_off_ms": 2.0,
            "crystal": 0.03,
            "jitter_ms": 5.0,
            "stamp_step_ms": 20.0,
            "stamp_step_s": 60.0,
            "force_range_g": 1.02,
            "g_sensitivity_dps_per_g": 0.05,
            "scale_asymmetry": 0.01,
            "rectification_dps_per_g2": 0.2,
            "warm_up_dps": 0.5,
            "warm_up_c": 10.0,
        },
    },
)
RESTING: Tables = {  # two tubes that rest, turn and rest
    "rig": {"tubes": 2, "tubes_at_start": 2, "tube_length_m": 1.0},
    "path": {"straight": {"inclination_deg": 12.0, "azimuth_deg": 70.0}},
    "schedule": {"add_s": 58.0, "stop_s": 32.0, "finish_s": 5.0},
    "rotation": {"turns": 2.5},
    "joints": {"reading_std_deg": 0.4, "mount_std_deg": 0.3, "mount_tilt_std_deg": 0.7},
    "medium": {"link": "off"},
}
DRAWN = change_sections(
    RESTING,
    rough={
        "samples_hz": 500.0,
        "vibration": {"turning_g": 0.3, "torsional_dps": 1.0, "highest_hz": 200.0},
        "sensor": {"frames_hz": 50.0, "low_pass_hz": 20.0, "g_sensitivity_dps_per_g": 0.02, "warm_up_dps": 0.1},
    },
)
WORLDS = {"plain": STRING, "wound": WOUND, "rough": ROUGH}


def figure_of(values: Any) -> float:
    """One number of many: their sum by weights that differ, so that no two may be exchanged."""
    flat = np.asarray(values, dtype=np.float64).ravel()
    flat = np.where(np.isfinite(flat), flat, 17.0)
    return float(np.sum(flat * np.cos(0.7 * np.arange(1.0, len(flat) + 1.0))))


def shown_by(name: str) -> Iterator[tuple[str, float]]:
    """Name and figure of each thing that a world shows."""
    world = World(scenario_of(dict(WORLDS[name])), SEED)
    ends = world.ends
    for imu in range(len(world.sensors.noises)):
        for tube in (1, 3):
            of = f"imu {imu} of tube {tube}"
            samples = world.sensors.samples(tube, imu)
            yield f"rates of {of}", figure_of(samples[:, :3])
            yield f"forces of {of}", figure_of(samples[:, 3:])
            if (parts := world.sensors.parts(tube, imu)) is not None:
                yield f"parts of {of}", figure_of(parts)
            yield f"tilt of {of}", figure_of(world.sensors.tilt(tube, imu))
            yield f"one sample of {of}", figure_of(_flat(world.imu_sample(tube, 33)))
    if world.scenario.file.rough is not None:
        found = world.sensors.rough_cycles(3)
        for part in ("temperature", "clipped", "late", "late_std"):
            yield part, figure_of(getattr(found, part))
    yield "phases", figure_of([(p.start, p.tube, len(p.kind)) for p in world.phases])
    yield "bias", figure_of(world.sensors.gyro_bias(2))
    for tube in (1, 2, 3):
        yield f"yaw of tube {tube}", figure_of(world.truth(tube).yaw(ends))
        yield f"error of tube {tube}", figure_of(world.systematic_errors(tube, ends))
        joints = world.marks.read(tube)
        told = [(a.angle, a.std) for a in (joints.drive_joint, joints.lower_joint)]
        yield f"marks of tube {tube}", figure_of(told)
        yield f"phase of tube {tube}", world.phase(tube)
    yield "head", figure_of(np.nan_to_num(measure_head(world)))
    yield "counts", figure_of([_flat(world.encoder_sample(t)[:4]) for t in ends[::5].tolist()])
    yield "depths", figure_of([(world.bit_depth(t), world.measured_depth(t)) for t in ends[::3].tolist()])
    yield (
        "clocks",
        figure_of([world.local_clock(a, 1050.0) - world.true_time(a, 1050.0) for a in (ENCODER, BASE, 1, 3)]),
    )
    yield "truth", figure_of([list(world.truth_station(md).values()) for md in (0.5, 3.0, 6.0)])
    yield "torque", figure_of(_flat([world.tube_settings(2).stiffness, *vars_of(world.torque_settings())]))


def drilled() -> Iterator[tuple[str, float]]:
    """What the nodes of a string knew, cycle by cycle, and what they said of it."""
    run = DirectString(World(scenario_of(dict(RESTING)), SEED), state_every=7).drill()
    for part in ("yaw", "total_error", "systematic_error", "var", "systematic_var", "gyro_bias", "turning"):
        yield part, figure_of(getattr(run, part))
    for name, surveys in (("surveys", run.surveys), ("revisions", run.revisions)):
        yield name, figure_of([(s.cycle, s.tube, s.error, s.said, *_survey_numbers(s.measurement)) for s in surveys])
    yield "states", figure_of([(cycle, *_flat(msgspec.structs.astuple(state))) for cycle, state in _whole(run.states)])
    yield "events", figure_of([(cycle, len(event.code), event.sequence, event.at) for cycle, event in run.events])


def _whole(states: Any) -> Any:
    return [(cycle, replace(state, parameters_hash=b"")) for cycle, state in states]


def _survey_numbers(survey: SurveyMeasurement) -> list[float]:
    given = [msgspec.structs.astuple(imu) for imu in survey.imus]
    return _flat([given, survey.yaw, survey.yaw_var, survey.systematic_var, survey.samples, survey.settle_time])


def drawn(name: str) -> Iterator[tuple[str, float]]:
    """What a campaign keeps of two runs, column by column."""
    chunk = Campaign(scenario_of(dict({"plain": RESTING, "rough": DRAWN}[name]))).chunk(SEED, SEED + 1)
    for table, columns in (("surveys", chunk.surveys), ("epochs", chunk.epochs)):
        for column, values in columns.items():
            yield f"{table}.{column}", figure_of(np.asarray(values, dtype=np.float64))


def vars_of(settings: Any) -> list[float]:
    """Numbers of a frozen dataclass, in the order of its fields."""
    return [float(getattr(settings, field.name)) for field in dataclasses.fields(settings)]


def _flat(values: Any) -> list[float]:
    flat: list[float] = []
    for value in values:
        if isinstance(value, list | tuple):
            flat += _flat(value)
        elif isinstance(value, bytes):
            flat += list(value)
        else:
            flat.append(math.nan if value is None else float(value))
    return flat


def records_by(name: str) -> Iterator[tuple[str, float]]:
    """Name and figure of each file of an instrument, and of what its calibration must find."""
    records = INSTRUMENTS[name].records(SEED)
    for file, content in records.files.items():
        if file.endswith(".npy"):
            yield file, figure_of(np.load(io.BytesIO(content)))
            continue
        rows = [line.split(",") for line in content.decode().splitlines() if line and not line.startswith("#")]
        yield file, figure_of([float(word) for row in rows for word in row if _is_number(word)])
    for what, truth in records.truth.items():
        yield f"truth of {what}", figure_of(_numbers(truth))


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _numbers(given: Any) -> list[float]:
    if isinstance(given, dict):
        return [number for key in given for number in _numbers(given[key])]
    if isinstance(given, list | tuple):
        return [number for value in given for number in _numbers(value)]
    return [float(given)] if isinstance(given, int | float) else []


FIGURES = Path(__file__).parents[1] / "data" / "seeded_worlds.json"


def everything() -> dict[str, dict[str, float]]:
    """Figures by world."""
    found = {name: dict(shown_by(name)) for name in WORLDS}
    found |= {f"records of {name}": dict(records_by(name)) for name in INSTRUMENTS}
    return found | {"drilled": dict(drilled()), "campaign": dict(drawn("plain")), "field": dict(drawn("rough"))}


if __name__ == "__main__":
    FIGURES.write_text(json.dumps(everything(), indent=1) + "\n", encoding="utf-8")
