"""Answers about the rig and its string: what stands before every answer, status, tubes, nodes and what they told."""

from __future__ import annotations

from typing import Annotated, Any

from groundstation.service.alarms.rig_alarms import Health
from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from telemetry.messages import NodeFlag, NodeMode, Severity

Tube = Annotated[int, "number of the tube"]
Sequence = Annotated[int, "the tube's number of it"]
Seq = Annotated[int, "place in the stream since the ground station started, for `since`"]
Newest = Annotated[int, "`seq` of the newest row"]
Yaw = Annotated[float, "yaw"]
YawSigma = Annotated[float, "random standard deviation of the yaw"]
SystematicSigma = Annotated[float, "constant errors of joints; never averages away"]
Flags = Annotated[list[str], "trust in the own yaw", OneOf(*(str(flag.name).lower() for flag in NodeFlag if flag))]


@answer_class
class AnswerHeader:
    """What every answer begins with."""

    revision: Annotated[
        int, "grows with everything that the ground station takes in; of two answers the smaller is older"
    ]
    utc: Annotated[str, "when the ground station answered"]
    rig_time_s: Annotated[float | None, "rig time now"]


@answer_class
class StatusAnswer:
    """Rig time, depth, counts, health."""

    rig: Annotated[str, "name"]
    bit_md_m: Annotated[float | None, "measured depth of the bit"]
    tubes: Annotated[int, "in the string"]
    stale_tubes: Annotated[list[int], "tubes that have been silent for too long"]
    stations: Annotated[int, "depths surveyed"]
    measurements: Annotated[int, "surveys that belong to a station"]
    unplaced_measurements: Annotated[int, "surveys without a known depth"]
    refused_measurements: Annotated[int, "surveys with invalid numbers"]
    set_aside_measurements: Annotated[int, "surveys of a faulty sensor, never fused"]
    untrusted_measurements: Annotated[int, "surveys whose yaw is taken for unknown"]
    health: Annotated[
        str,
        "the worst of the rig's alarms; unknown where it cannot be told",
        OneOf(*(health.name.lower() for health in Health)),
    ]
    epoch: Annotated[int, "of rig time: starts of the encoder so far, 0 unknown"]
    alarms: Annotated[list[str], "kinds that stand"]


@answer_class
class StringTube:
    """One tube of the string."""

    tube: Tube
    md_m: Annotated[float | None, "measured depth of its node"]
    age_s: Annotated[float | None, "since its newest state"]
    stale: Annotated[bool, "silent for too long"]


@answer_class
class StringAnswer:
    """Tubes from top to bottom."""

    tubes: list[StringTube]


@answer_class
class MountOffset:
    """Offset of an IMU's mount that a node corrects."""

    pitch_deg: Annotated[float, "offset of the mount"]
    roll_deg: Annotated[float, "offset of the mount"]
    sigma_deg: Annotated[float, "of both"]


@answer_class
class NodeAnswer:
    """Last state of one node."""

    tube: Tube
    at_s: Annotated[float, "rig time of this state"]
    age_s: Annotated[float | None, "since then"]
    stale: Annotated[bool, "silent for too long"]
    hops: Annotated[int, "distance from the encoder in tubes, -1 unknown"]
    mode: Annotated[str, "execution state", OneOf(*(mode.name.lower() for mode in NodeMode))]
    yaw_deg: Yaw
    sigma_yaw_deg: YawSigma
    sigma_systematic_deg: SystematicSigma
    gyro_bias_dps: Annotated[list[float], "estimated bias of the gyroscope, x y z"]
    scale_factor: Annotated[float, "estimated error of the gyroscope's z scale"]
    innovation_deg: Annotated[float, "of the last aiding"]
    sigma_innovation_deg: Annotated[float, "standard deviation of the innovation"]
    aiding_age_s: Annotated[float | None, "since the last aiding used"]
    sigma_clock_s: Annotated[float, "of the node's rig time"]
    flags: Flags
    cycles: Annotated[int, "since its start"]
    overruns: Annotated[int, "cycles that ended too late"]
    upper_margin_db: Annotated[
        float | None, "of the frames from above over the radio's threshold; null without a radio"
    ]
    lower_margin_db: Annotated[float | None, "the same from below"]
    parameters_version: Annotated[int, "of the parameter block in use, 0 is the identity"]
    parameters_hash: Annotated[str, "first 8 bytes of its SHA-256, hexadecimal"]
    alignment: MountOffset | None


@answer_class
class EventRow:
    """One event of a node."""

    seq: Seq
    tube: Tube
    sequence: Sequence
    at_s: Annotated[float, "rig time"]
    severity: Annotated[str, "how grave", OneOf(*(severity.name.lower() for severity in Severity))]
    code: Annotated[str, "what happened"]
    arguments: Annotated[dict[str, Any], "of the event"]


@answer_class
class EventsAnswer:
    """Events of the nodes."""

    newest: Newest
    events: list[EventRow]


@answer_class
class StaticRecordRow:
    """One average at rest."""

    seq: Seq
    tube: Tube
    sequence: Sequence
    order: Annotated[int, "number of the order that asked for it"]
    begun_at_s: Annotated[float, "rig time"]
    ended_at_s: Annotated[float, "rig time"]
    samples: Annotated[int, "in the means"]
    rate_rad_s: Annotated[list[float], "mean, raw"]
    rate_cov_rad2_s2: Annotated[list[list[float]], "of one sample"]
    force_m_s2: Annotated[list[float], "mean, raw"]
    force_cov_m2_s4: Annotated[list[list[float]], "of one sample"]
    temperature_c: Annotated[float, "mean"]
    moved: Annotated[bool, "it was not at rest all the time"]


@answer_class
class StaticRecordsAnswer:
    """Raw readings averaged at rest."""

    newest: Newest
    static_records: list[StaticRecordRow]


@answer_class
class PathChange:
    """Newest change of one path."""

    path: Annotated[str, "below ground/, without those of a number"]
    changed_at: Annotated[int, "revision of its newest change"]


@answer_class
class ChangesAnswer:
    """When each path changed last."""

    changes: list[PathChange]


@answer_class
class SchemaAnswer:
    """JSON schema of every answer."""

    schemas: Annotated[dict[str, Any], "JSON schema of the answer of each path, made from the code that answers"]
