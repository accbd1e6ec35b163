"""What a scenario file may not say together, though each key by itself is in its range."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from groundstation.calibration.attitudes import rank_of, true_vectors
from sim.errors import ScenarioError
from sim.world.disturbance.disturbance_table import TABLE
from sim.world.parsing import validate_tables
from sim.world.radio import check_radio
from sim.world.scenario_file import AidingSection, CalibrationSection, ScenarioFile
from telemetry.errors import RadioError

MAX_RATE_DPS = 57.0 * 6.0  # 57 rev/min: half a turn a cycle is where one sample a cycle aliases
LEAST_LATENCY_MS = 0.5  # of a hop with a link
SURVEY_AFTER = 22.0  # s at rest, for a survey
RECORD_MARGIN = 8.0  # s at an attitude beside its record: the tubes settle and the order travels


def check_scenario(path: Path, file: ScenarioFile) -> None:
    """Refuse what no rig could run.

    Raises
    ------
    ScenarioError
        One line: the file, the key, what was expected and what came.
    """
    _check_motion(path, file)
    _check_link(path, file)
    _check_torsion(path, file)
    _check_radio(path, file)
    _check_rough(path, file)
    _check_node(path, file)
    _check_calibration(path, file.calibration)
    _check_disturbances(path, file)
    _check_told(path, file)
    _check_moved(path, file)


def _check_motion(path: Path, file: ScenarioFile) -> None:
    rate, schedule = file.rotation.rate_dps, file.schedule
    if rate > MAX_RATE_DPS:
        raise ScenarioError(
            f"{path}: rotation.rate_dps: expected at most {MAX_RATE_DPS:g} deg/s (57 rev/min, "
            f"half a turn a cycle), got {rate:g}; turn slower"
        )
    if file.rig.tubes_at_start > file.rig.tubes:
        raise ScenarioError(
            f"{path}: rig.tubes_at_start: expected at most tubes = {file.rig.tubes}, got {file.rig.tubes_at_start}"
        )
    hanging = file.rig.hanging
    if file.rig.depth_at_start > hanging:
        raise ScenarioError(
            f"{path}: rig.depth_at_start_m: expected at most the {hanging:g} m that the tubes at the start reach, "
            f"got {file.rig.depth_at_start_m:g}"
        )
    if file.blocks < file.least_blocks:
        raise ScenarioError(
            f"{path}: schedule.blocks: expected at least one for each tube that is added, got {schedule.blocks}"
        )
    if schedule.joint_s >= schedule.add_s:
        raise ScenarioError(
            f"{path}: schedule.joint_s: expected less than add_s = {schedule.add_s:g} s, "
            f"got {schedule.joint_s:g}; close the joint before drilling"
        )


def _check_link(path: Path, file: ScenarioFile) -> None:
    """Settings of a string without a link stand beside ``link = "off"`` only: on a link they would do nothing."""
    if file.medium.link == "off":
        return
    if file.medium.latency_ms < LEAST_LATENCY_MS:
        raise ScenarioError(
            f"{path}: medium.latency_ms: expected at least {LEAST_LATENCY_MS:g} ms, got {file.medium.latency_ms:g}"
        )
    usual = {
        "medium.delay_ms": file.medium.delay_ms == 0.0,
        "medium.dated_by": file.medium.dated_by == "validity",
        "aiding": file.aiding == AidingSection(),
        "encoder.edge_times": file.encoder.edge_times,
        "node.tuning": not file.node.tuning,
    }
    for key, holds in usual.items():
        if not holds:
            raise ScenarioError(f'{path}: {key}: expected medium.link = "off" with it; a link decides that by itself')


def _check_torsion(path: Path, file: ScenarioFile) -> None:
    section, schedule = file.torsion, file.schedule
    if file.node.joints != "marks" and file.node.scheme != "forward":
        raise ScenarioError(
            f"{path}: node.joints: expected marks with the scheme {file.node.scheme}, "
            f"got {file.node.joints}; only forward can solve them"
        )
    if section is None:
        return
    if section.inner_diameter_m >= section.outer_diameter_m:
        raise ScenarioError(
            f"{path}: torsion.inner_diameter_m: expected less than outer_diameter_m = "
            f"{section.outer_diameter_m:g} m, got {section.inner_diameter_m:g}"
        )
    needed = section.release_after_s + section.release_s + SURVEY_AFTER
    if schedule.stop_s < needed:
        raise ScenarioError(
            f"{path}: schedule.stop_s: expected at least {needed:g} s, the release of the torque and "
            f"{SURVEY_AFTER:g} s for a survey, got {schedule.stop_s:g}; stop longer"
        )


def _check_radio(path: Path, file: ScenarioFile) -> None:
    section = file.radio
    if section is None:
        return
    if file.medium.link == "off":
        raise ScenarioError(f'{path}: radio: expected medium.link = "on" with it, got off')
    if section.mode == "pipe" and file.node.joints != "marks":
        raise ScenarioError(
            f"{path}: node.joints: expected marks with a radio in the pipe, got {file.node.joints}; "
            "a tube that hears beyond a silent one knows the marks alone"
        )
    try:
        check_radio(section, file.rig.tube_length_m)
    except RadioError as error:
        raise ScenarioError(f"{path}: radio: {error}") from error


def _check_rough(path: Path, file: ScenarioFile) -> None:
    """What the grid of a rough world does not hold is refused beside it."""
    if file.rough is None:
        return
    vibration = file.rough.vibration
    lowest, highest = vibration.lowest_hz, vibration.highest_hz
    shaken = vibration.turning_g or vibration.resting_g or vibration.torsional_dps
    if shaken and not lowest < highest <= 0.5 * file.rough.samples_hz:
        raise ScenarioError(
            f"{path}: rough.vibration: expected lowest_hz below highest_hz and this at most half of samples_hz = "
            f"{file.rough.samples_hz:g}, got {lowest:g} and {highest:g}"
        )
    usual = {
        "calibration": file.calibration is None,
        "joints.head_turn_deg": file.joints.head_turn_deg == 0.0,
        "encoder.edge_times": file.encoder.edge_times,
        "gyroscope.instantaneous": not file.gyroscope.instantaneous,
    }
    for key, holds in usual.items():
        if not holds:
            raise ScenarioError(
                f"{path}: {key}: expected no such setting beside the table rough; leave out one of them"
            )


def _check_node(path: Path, file: ScenarioFile) -> None:
    if len(file.node.imu_noise) not in (0, file.node.imus):
        raise ScenarioError(
            f"{path}: node.imu_noise: expected {file.node.imus} factors, one for each of node.imus, "
            f"got {len(file.node.imu_noise)}"
        )


def _check_calibration(path: Path, section: CalibrationSection | None) -> None:
    if section is None:
        return
    if section.record_s + RECORD_MARGIN > section.hold_s:
        raise ScenarioError(
            f"{path}: calibration.record_s: expected at most hold_s - {RECORD_MARGIN:g} s = "
            f"{section.hold_s - RECORD_MARGIN:g} s, got {section.record_s:g}; hold longer"
        )
    pitch, roll = np.radians(np.array(section.attitudes_deg)).T
    rank = rank_of(np.column_stack([np.ones(len(pitch)), true_vectors(pitch, roll)]))
    if rank < 4:
        raise ScenarioError(
            f"{path}: calibration.attitudes_deg: expected attitudes that determine bias and matrix (rank 4), "
            f"got rank {rank}; add some of other tilts"
        )


def _check_disturbances(path: Path, file: ScenarioFile) -> None:
    """Every table below ``disturbance`` is of a row of the table of disturbances, with the keys of its section."""
    sections = {row.name: row.section for row in TABLE if row.section is not None}
    for name, table in file.disturbance.items():
        section = sections.get(name)
        if section is None:
            known = ", ".join(sections) or "none"
            raise ScenarioError(f"{path}: disturbance.{name}: no such disturbance has a table; expected one of {known}")
        made = validate_tables(Path(f"{path}: disturbance.{name}"), table, section, 1)
        _check_tube(path, file, f"disturbance.{name}.tube", getattr(made, "tube", 1))
        _check_pair(path, file, f"disturbance.{name}.tubes", getattr(made, "tubes", None))


def _check_tube(path: Path, file: ScenarioFile, key: str, tube: int) -> None:
    if not 1 <= tube <= file.rig.tubes:
        raise ScenarioError(f"{path}: {key}: expected one of {file.rig.tubes} tubes, got {tube}")


def _check_pair(path: Path, file: ScenarioFile, key: str, tubes: tuple[int, int] | None) -> None:
    if tubes is None:
        return
    if tubes[0] == tubes[1]:
        raise ScenarioError(f"{path}: {key}: expected two tubes, got {tubes[0]} twice")
    for tube in tubes:
        _check_tube(path, file, key, tube)


def _check_told(path: Path, file: ScenarioFile) -> None:
    told = file.told
    _check_tube(path, file, "told.joint_tube", told.joint_tube)
    if len(told.lengths_off_m) > file.rig.tubes:
        raise ScenarioError(
            f"{path}: told.lengths_off_m: expected at most {file.rig.tubes}, one a tube, got {len(told.lengths_off_m)}"
        )
    if told.depth_stuck_s is not None and told.depth_stuck_after_s is None:
        raise ScenarioError(f"{path}: told.depth_stuck_s: expected depth_stuck_after_s with it")


def _check_moved(path: Path, file: ScenarioFile) -> None:
    moved = file.path.moved
    if moved is None:
        return
    if moved.to_m <= moved.from_m:
        raise ScenarioError(
            f"{path}: path.moved.to_m: expected more than from_m = {moved.from_m:g}, got {moved.to_m:g}"
        )
    if moved.to_m > file.depth:
        raise ScenarioError(
            f"{path}: path.moved.to_m: expected at most the {file.depth:g} m that are drilled, got {moved.to_m:g}"
        )
