"""Views of the rig and its string: degrees, metres and seconds, the unit in every name."""

from __future__ import annotations

import math

from groundstation.service.answers.answer_texts import finite_or_none
from groundstation.service.answers.answer_views import member_view_of, view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.selector_range import SelectorRange
from groundstation.service.answers.shapes.string_shapes import (
    ChangesAnswer,
    EventRow,
    EventsAnswer,
    MountOffset,
    NodeAnswer,
    PathChange,
    StaticRecordRow,
    StaticRecordsAnswer,
    StatusAnswer,
    StringAnswer,
    StringTube,
)
from groundstation.service.answers.streamed_rows import Parameters, select_rows
from telemetry.messages import Event, NodeFlag, NodeState, StaticRecord


@view_of(StatusAnswer)
def answer_status(k: RigModel, _p: Parameters) -> StatusAnswer:
    """Rig time, depth, counts, health."""
    string, stations = k.string, k.hole.stations
    return StatusAnswer(
        rig=k.config.rig,
        bit_md_m=string.bit,
        tubes=len(string.tubes),
        stale_tubes=string.silent,
        stations=len(stations),
        measurements=sum(s.count for s in stations),
        unplaced_measurements=k.placement.unplaced,
        refused_measurements=k.placement.refused,
        set_aside_measurements=len(k.placement.set_aside),
        untrusted_measurements=sum(s.untrusted for s in stations),
        health=k.rig_alarms.health_of(is_known=string.is_known).name.lower(),
        epoch=string.time.epoch,
        alarms=sorted({alarm.kind.code for alarm in k.rig_alarms}),
    )


@view_of(ChangesAnswer)
def answer_changes(k: RigModel, _p: Parameters) -> ChangesAnswer:
    """When each path changed last: a listener that holds an answer of before has missed one."""
    return ChangesAnswer([PathChange(path, at) for path, at in sorted(k.revisions.changed_at.items())])


@view_of(StringAnswer)
def answer_string(k: RigModel, _p: Parameters) -> StringAnswer:
    """Tubes from top to bottom."""
    string, states, rows = k.string, k.string.states, []
    for tube in string.tubes:
        md = string.depth_of_node(tube)
        shown_md = None if md is None else round(md, 6)
        rows.append(StringTube(tube, shown_md, finite_or_none(states.age(tube)), states.is_stale(tube)))
    return StringAnswer(rows)


@member_view_of(NodeAnswer, lambda k: sorted(k.string.states.newest))
def answer_node(k: RigModel, tube: int) -> NodeAnswer:
    """Last state of one node."""
    states = k.string.states
    s, age, is_stale = states.newest[tube], states.age(tube), states.is_stale(tube)
    return NodeAnswer(
        tube=tube,
        at_s=s.at,
        age_s=finite_or_none(age),
        stale=is_stale,
        hops=s.hops,
        mode=s.mode.name.lower(),
        yaw_deg=math.degrees(s.yaw),
        sigma_yaw_deg=math.degrees(math.sqrt(s.yaw_var)),
        sigma_systematic_deg=math.degrees(math.sqrt(s.systematic_var)),
        gyro_bias_dps=[math.degrees(b) for b in s.gyro_bias],
        scale_factor=s.scale_factor,
        innovation_deg=math.degrees(s.innovation),
        sigma_innovation_deg=math.degrees(math.sqrt(s.innovation_var)),
        aiding_age_s=finite_or_none(s.aiding_age),
        sigma_clock_s=math.sqrt(s.clock_var),
        flags=flag_names(s.flags),
        cycles=s.cycles,
        overruns=s.overruns,
        upper_margin_db=finite_or_none(s.upper_margin),
        lower_margin_db=finite_or_none(s.lower_margin),
        parameters_version=s.parameters_version,
        parameters_hash=s.parameters_hash.hex(),
        alignment=mount_offset(s),
    )


def mount_offset(s: NodeState) -> MountOffset | None:
    """Offset of an IMU's mount that a node corrects; None for one never aligned."""
    pitch, roll, std = map(math.degrees, s.alignment)
    return None if std == 0.0 else MountOffset(pitch, roll, std)


@view_of(EventsAnswer)
def answer_events(k: RigModel, p: Parameters) -> EventsAnswer:
    """What happened; ``tube`` selects."""
    events = k.string.events
    wanted = SelectorRange.of_parameter("tube", p)
    rows = [event_row(e, n) for n, e in events.numbered() if wanted.holds(e.tube)]
    return EventsAnswer(events.newest, select_rows(rows, events.newest, p))


def event_row(e: Event, seq: int) -> EventRow:
    """One event."""
    return EventRow(
        seq=seq,
        tube=e.tube,
        sequence=e.sequence,
        at_s=e.at,
        severity=e.severity.name.lower(),
        code=e.code,
        arguments=e.arguments,
    )


@view_of(StaticRecordsAnswer)
def answer_static_records(k: RigModel, p: Parameters) -> StaticRecordsAnswer:
    """Raw readings averaged at rest; ``tube`` selects."""
    records = k.string.static_records
    wanted = SelectorRange.of_parameter("tube", p)
    rows = [static_record_row(r, n) for n, r in records.numbered() if wanted.holds(r.tube)]
    return StaticRecordsAnswer(records.newest, select_rows(rows, records.newest, p))


def static_record_row(r: StaticRecord, seq: int) -> StaticRecordRow:
    """One static record; the covariances are those of one sample."""
    return StaticRecordRow(
        seq=seq,
        tube=r.tube,
        sequence=r.sequence,
        order=r.command,
        begun_at_s=r.begun_at,
        ended_at_s=r.ended_at,
        samples=r.samples,
        rate_rad_s=list(r.rate),
        rate_cov_rad2_s2=[list(row) for row in r.rate_cov],
        force_m_s2=list(r.force),
        force_cov_m2_s4=[list(row) for row in r.force_cov],
        temperature_c=r.temperature,
        moved=r.moved,
    )


def flag_names(flags: NodeFlag) -> list[str]:
    """Names of the flags that are set."""
    return [flag.name.lower() for flag in NodeFlag if flag and flag in flags and flag.name]
