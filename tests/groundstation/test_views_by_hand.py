"""What an answer shows of the model, number by number: each is another one, and each stands in its place and unit."""

from __future__ import annotations

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from test_resolved_stops import stops_of

from groundstation.service.alarms.verdict import Deadline, HoleVerdict
from groundstation.service.alarms.verdict_words import Word
from groundstation.service.answers.column_views import answer_column, column_deviation, cone_row, foreseen_end
from groundstation.service.answers.hole_views import answer_uncertainty, direction_value, position_values
from groundstation.service.answers.measurement_views import _selected, measurement_rows
from groundstation.service.answers.recalibration_views import rest_attitude, solution_figures, tube_calibration
from groundstation.service.answers.setup_views import setup_row
from groundstation.service.answers.string_views import answer_node, event_row, flag_names, static_record_row
from groundstation.service.answers.verdict_views import off_target_view, steering_view, verdict_line
from groundstation.service.orders.recalibration.recalibration_progress import Attitude, Found, TubeProgress
from groundstation.service.setup.setup_items import SetupItem, SetupSource
from groundstation.service.setup.told_value import SetupKind
from groundstation.survey.wall.column_deviation import Deviation
from groundstation.survey.wall.projected_end import ConePoint
from telemetry.messages import Event, NodeFlag, NodeMode, NodeState, Severity, StaticRecord

DEG = math.pi / 180.0


def values_of(answer: Any) -> dict[str, Any]:
    return dataclasses.asdict(answer)


STATE = NodeState(
    7, 101.5, 3, NodeMode.STATIC_BIAS, 10.0 * DEG, (0.2 * DEG) ** 2, (0.3 * DEG) ** 2, (DEG, 2.0 * DEG, -3.0 * DEG),
    0.004, -0.5 * DEG, (0.6 * DEG) ** 2, 7.5, 0.008**2, NodeFlag.AIDING_OLD | NodeFlag.NOT_SAVED, 900, 11, 12,
    b"\x01\x02\x03\x04\x05\x06\x07\x08", (1.5 * DEG, -2.5 * DEG, 0.1 * DEG), upper_margin=13.5, lower_margin=-4.5,
)  # fmt: skip


def shown_node(state: NodeState, age: float) -> dict[str, Any]:
    states = SimpleNamespace(newest={7: state}, age=lambda _: age, is_stale=lambda _: age > 5.0)
    model: Any = SimpleNamespace(string=SimpleNamespace(states=states))
    return values_of(answer_node(model, 7))


def test_a_node_s_state_is_shown_in_degrees_and_seconds() -> None:
    near = pytest.approx
    assert shown_node(STATE, 2.5) == {
        "tube": 7, "at_s": 101.5, "age_s": 2.5, "stale": False, "hops": 3, "mode": "static_bias", "yaw_deg": near(10.0),
        "sigma_yaw_deg": near(0.2), "sigma_systematic_deg": near(0.3), "gyro_bias_dps": near([1.0, 2.0, -3.0]),
        "scale_factor": 0.004, "innovation_deg": near(-0.5), "sigma_innovation_deg": near(0.6), "aiding_age_s": 7.5,
        "sigma_clock_s": near(0.008), "flags": ["aiding_old", "not_saved"], "cycles": 900, "overruns": 11,
        "upper_margin_db": 13.5, "lower_margin_db": -4.5, "parameters_version": 12,
        "parameters_hash": "0102030405060708",
        "alignment": {"pitch_deg": near(1.5), "roll_deg": near(-2.5), "sigma_deg": near(0.1)},
    }  # fmt: skip
    bare = NodeState(
        7, 1.0, 1, NodeMode.BOOT, 0.0, 1.0, 1.0, (0.0,) * 3, 0.0, 0.0, 1.0, math.inf, 1.0, NodeFlag(0), 0, 0
    )
    shown = shown_node(bare, math.inf)
    assert (shown["age_s"], shown["stale"], shown["alignment"], shown["flags"]) == (None, True, None, [])
    assert [shown[name] for name in ("aiding_age_s", "upper_margin_db", "lower_margin_db")] == [None] * 3
    level = NodeState(*[getattr(STATE, name) for name in bare.__struct_fields__[:18]], (0.0, 0.0, 0.2 * DEG))
    assert shown_node(level, 0.0)["alignment"] == {"pitch_deg": 0.0, "roll_deg": 0.0, "sigma_deg": near(0.2)}


def test_every_flag_has_its_name() -> None:
    every = NodeFlag((1 << 11) - 1)
    names = [
        "yaw_untrusted", "aiding_old", "innovation_rejected", "rate_exceeded", "restored", "clock_unsynchronised",
        "bias_unknown", "sensor_fault", "not_saved", "drive_untold", "lower_untold",
    ]  # fmt: skip
    assert flag_names(every) == names
    assert [flag_names(NodeFlag(1 << bit)) for bit in range(11)] == [[name] for name in names]


def test_an_event_and_a_static_record_are_shown_whole() -> None:
    assert values_of(event_row(Event(3, 40, 5.5, Severity.WARNING, "clock", {"a": 1}), 9)) == {
        "seq": 9, "tube": 3, "sequence": 40, "at_s": 5.5, "severity": "warning", "code": "clock", "arguments": {"a": 1},
    }  # fmt: skip
    rate_cov = ((1.0, 2.0, 3.0), (2.0, 4.0, 5.0), (3.0, 5.0, 6.0))
    force_cov = tuple(tuple(10.0 * x for x in row) for row in rate_cov)
    record = StaticRecord(
        3, 41, 17, 100.5, 160.5, 115, (0.1, 0.2, 0.3), rate_cov, (1.0, 2.0, -9.0), force_cov, 21.5, True
    )
    assert values_of(static_record_row(record, 8)) == {
        "seq": 8, "tube": 3, "sequence": 41, "order": 17, "begun_at_s": 100.5, "ended_at_s": 160.5, "samples": 115,
        "rate_rad_s": [0.1, 0.2, 0.3], "rate_cov_rad2_s2": [list(row) for row in rate_cov],
        "force_m_s2": [1.0, 2.0, -9.0], "force_cov_m2_s4": [list(row) for row in force_cov], "temperature_c": 21.5,
        "moved": True,
    }  # fmt: skip


OFF = Deviation(12.0, 11.0, np.array([0.03, -0.04]), np.array([[4e-4, 1e-4], [1e-4, 9e-4]]), 0.08)
STD_CM = math.sqrt(0.36 * 4.0 + 0.64 * 9.0 - 0.48 * 2.0)  # towards (0.6, -0.8)


def test_a_deviation_is_shown_in_centimetres_of_its_depth_along_the_axis() -> None:
    near = pytest.approx
    assert values_of(column_deviation(OFF)) == {
        "md_m": 12.0, "along_m": 11.0, "north_cm": near(3.0), "east_cm": near(-4.0), "deviation_cm": near(5.0),
        "sigma_cm": near(STD_CM), "deviation_percent": near(100.0 * 0.05 / 11.0),
        "direction_deg": near(math.degrees(math.atan2(-4.0, 3.0)) + 360.0), "limit_cm": near(8.0),
        "used_percent": near(62.5), "level_percent": 50,
    }  # fmt: skip
    assert column_deviation(dataclasses.replace(OFF, along=0.0)).deviation_percent == 0.0
    assert values_of(cone_row(ConePoint(OFF, 0.011, 0.023))) == {
        "md_m": 12.0, "along_m": 11.0, "north_cm": near(3.0), "east_cm": near(-4.0), "deviation_cm": near(5.0),
        "half_width_cm": near(1.1), "radius_cm": near(2.3), "limit_cm": near(8.0),
    }  # fmt: skip


def foreseen(**change: Any) -> Any:
    way = SimpleNamespace(path=SimpleNamespace(tendency=SimpleNamespace(curvature=np.array([3e-3, 4e-3]))))
    return SimpleNamespace(
        **{"within": 0.87, "half_width": 0.12, "surveyed_std": 0.02, "way": way, "cone": [], "ends": OFF,
           "is_reached": False} | change
    )  # fmt: skip


def test_an_end_is_shown_with_what_was_surveyed_of_it_and_how_it_bends() -> None:
    near = pytest.approx
    assert values_of(foreseen_end(foreseen())) == {
        "within_percent": near(87.0), "half_width_cm": near(12.0), "surveyed_sigma_cm": near(2.0),
        "bend_deg_per_m": near(math.degrees(5e-3)), "cone": [],
    }  # fmt: skip
    assert foreseen_end(foreseen(way=None)).bend_deg_per_m is None


def test_the_worst_of_a_column_is_what_uses_most_of_its_limit() -> None:
    rows = [dataclasses.replace(OFF, md=float(k), limit=limit) for k, limit in enumerate((0.08, 0.06, 0.5))]
    rows.append(dataclasses.replace(OFF, md=9.0, offset=np.array([0.3, 0.0]), limit=9.0))
    design = SimpleNamespace(
        inclination=0.1, azimuth=0.2, length=20.0, radius=0.6, tolerance=SimpleNamespace(name="t"), plan=None,
        points_at=lambda along: np.zeros((len(along), 3)),
    )  # fmt: skip
    hole = SimpleNamespace(deviations=rows, projection=None, history=None, stations=[])
    model: Any = SimpleNamespace(hole=hole, config=SimpleNamespace(design=design))
    answer = answer_column(model, {})
    assert answer.worst.md_m == 1.0
    assert [row.md_m for row in answer.stations] == [0.0, 1.0, 2.0, 9.0]
    assert (answer.projection, answer.ahead, answer.dominant) == (None, None, None)
    assert answer.design.inclination_deg == pytest.approx(math.degrees(0.1))
    assert answer.design.azimuth_deg == pytest.approx(math.degrees(0.2))


def test_a_station_says_what_its_direction_is_made_of() -> None:
    station: Any = SimpleNamespace(count=7, first=2, untrusted=3, mean_variances=lambda: (4e-6, 9e-6, 16e-6))
    found = direction_value(station, (0.1, 0.2), (1e-3, 2e-3), (0.03, 0.04))
    assert found == {
        name: pytest.approx(value)
        for name, value in {
            "inclination_deg": math.degrees(0.1), "azimuth_deg": math.degrees(0.2),
            "sigma_inclination_deg": math.degrees(1e-3), "sigma_azimuth_deg": math.degrees(2e-3),
            "transport_deg": math.degrees(0.03), "sigma_transport_deg": math.degrees(0.04), "measurements": 7,
            "dropped_measurements": 2, "untrusted_measurements": 3, "sigma_yaw_deg": math.degrees(2e-3),
            "sigma_systematic_deg": math.degrees(3e-3), "sigma_force_mps2": 4e-3,
        }.items()
    }  # fmt: skip
    covs = np.diag([1e-4, 4e-4, 9e-4])[None]
    assert position_values(np.array([[1.0, 2.0, 3.0]]), covs) == [
        {"north_m": 1.0, "east_m": 2.0, "tvd_m": 3.0, "sigma_north_m": pytest.approx(0.01),
         "sigma_east_m": pytest.approx(0.02), "sigma_tvd_m": pytest.approx(0.03)}
    ]  # fmt: skip


def test_a_region_holds_its_part_in_the_plane_and_in_space() -> None:
    """95 % of two normal numbers lie within sqrt(-2 ln 0.05), of three within 2.7955 standard deviations."""
    covs = np.array([np.diag([4e-4, 1e-4, 9e-4])])
    drawn = SimpleNamespace(md=np.array([12.0]), covs=covs)
    variances = {"north": np.array([[1e-4, 4e-4, 0.0]]), "legs": np.array([[9e-4, 0.0, 16e-4]])}
    model: Any = SimpleNamespace(hole=SimpleNamespace(trajectory=drawn, variances=variances))
    answer = answer_uncertainty(model, {})
    plane, space = math.sqrt(-2.0 * math.log(0.05)), 2.795483
    assert (answer.confidence, answer.sigma_plane, answer.sigma_space) == (
        0.95,
        pytest.approx(plane),
        pytest.approx(space),
    )
    (region,) = answer.stations
    assert (region.plan_ellipse.major_m, region.plan_ellipse.minor_m) == pytest.approx((0.02 * plane, 0.01 * plane))
    assert sorted(axis.semi_axis_m for axis in region.ellipsoid) == pytest.approx(
        [space * s for s in (0.01, 0.02, 0.03)]
    )
    found = {name: tuple(values_of(one).values()) for name, one in region.sources.items()}
    assert found == {"north": pytest.approx((0.01, 0.02, 0.0)), "legs": pytest.approx((0.03, 0.0, 0.04))}


def setup_item(kind: SetupKind, unit: str, **more: Any) -> SetupItem:
    return SetupItem(kind, "4-3", (0.5, 0.25), 0.0125, unit, SetupSource.TOLD, "by anna", by="anna", **more)


@pytest.mark.parametrize(
    ("unit", "shown", "scale"),
    [("rad", "deg", 1.0 / DEG), ("rad/s", "deg/s", 1.0 / DEG), ("rad/m", "deg/m", 1.0 / DEG), ("m", "m", 1.0),
     ("m/s^2", "m/s^2", 1.0), ("1", "1", 1.0)],
)  # fmt: skip
def test_an_item_of_the_setup_is_shown_in_the_unit_that_people_read(unit: str, shown: str, scale: float) -> None:
    item = setup_item(
        SetupKind.JOINT, unit, utc="2026-01-01T00:00:10+00:00", times_told=2, check="seen", least_slip=0.75
    )
    row = setup_row(item, {item.name: 0.012345}, 1767225620.0)
    assert (row.unit, row.value) == (shown, pytest.approx([0.5 * scale, 0.25 * scale]))
    assert (row.sigma, row.least_slip) == (
        pytest.approx(0.0125 * scale, rel=1e-5),
        pytest.approx(0.75 * scale, rel=1e-5),
    )
    assert (row.toe_cm, row.age_s, row.way, row.item, row.times_told) == (1.23, 10.0, "across", item.name, 2)
    assert (row.subject, row.source, row.by, row.check, row.detail) == ("4-3", "told", "anna", "seen", "by anna")
    early = setup_row(item, {item.name: 1.0}, 0.0)
    assert early.age_s == 0.0
    assert setup_row(setup_item(SetupKind.LENGTH, "m"), {"length.4-3": 0.1}, 0.0).way == "along"


def test_a_recalibration_is_shown_as_it_stands() -> None:
    near = pytest.approx
    found = Found(0.011, (0.1, 0.2, 0.3), 0.04, 1.5, 0.5 * DEG, 0.25 * DEG)
    assert values_of(solution_figures(found)) == {
        "residual_rms_mps2": 0.011, "bias_std_mps2": [0.1, 0.2, 0.3], "matrix_std": 0.04, "condition": 1.5,
        "inclination_rms_deg": {"before": near(0.5), "after": near(0.25)},
    }  # fmt: skip
    assert values_of(rest_attitude(Attitude(10.0 * DEG, -20.0 * DEG, 30.0, 100.0, 140.0), 4)) == {
        "attitude": 4, "pitch_deg": 10.0, "roll_deg": -20.0, "told_at_s": 100.0, "left_at_s": 140.0,
    }  # fmt: skip
    tube = TubeProgress(
        3, detail="d", version_before=5, hash_before="aa", orders={1: 0, 2: 1}, uploads=2, restarted=True
    )
    tube.hash_after_restart, tube.hash, tube.found = "bb", "cc", found
    row = values_of(tube_calibration(tube, 9, None))
    shown = {
        "tube": 3, "detail": "d", "records": 9, "asked": 2, "version_before": 5, "hash_before": "aa", "uploads": 2,
        "restarted": True, "hash_after_restart": "bb", "hash": "cc", "version": None, "hash_proposed": "",
    }  # fmt: skip
    assert {name: row[name] for name in shown} == shown


def test_a_survey_is_shown_with_its_own_variances() -> None:
    table = stops_of(3, 6, 101.5)
    table.rows["yaw"], table.rows["yaw_var"], table.rows["systematic_var"] = 0.5, 4e-6, 9e-6
    table.rows["md"], table.rows["replaces"], table.rows["settle_time"] = 6.25, 4, 33.0
    (row,) = measurement_rows(table, [0], [2])
    assert (row.yaw_deg, row.sigma_yaw_deg, row.sigma_systematic_deg) == pytest.approx(
        [math.degrees(one) for one in (0.5, 2e-3, 3e-3)]
    )
    assert (row.station, row.md_m, row.tube, row.sequence, row.replaces) == (2, 6.25, 3, 6, 4)
    assert (row.station_at_s, row.hops, row.samples, row.settle_s) == (101.5, 3, 32, 33.0)
    assert (row.quality, row.trust, row.flags) == (["motion", "spread"], "full", [])
    assert row.inclination_deg == pytest.approx(math.degrees(0.003), rel=1e-3)
    assert row.forces_mps2 == [[pytest.approx(9.81 * math.sin(0.003)), 0.0, pytest.approx(-9.81 * math.cos(0.003))]]


@pytest.mark.parametrize(
    ("asked", "rows", "stations"),
    [
        ({}, [0, 1, 2, 3], [1, 1, 2, 3]),
        ({"station": "2"}, [2], [2]),
        ({"tube": "7"}, [1, 3], [1, 3]),
        ({"since": "0"}, [3, 1, 0, 2], [3, 1, 1, 2]),
        ({"since": "2"}, [0, 2], [1, 2]),
        ({"since": "4"}, [], []),
    ],
)
def test_surveys_are_chosen_by_station_by_tube_and_by_those_that_were_seen(
    asked: dict[str, str], rows: list[int], stations: list[int]
) -> None:
    columns = {"number": np.array([3, 2, 4, 1]), "tube": np.array([5, 7, 5, 7])}
    known = [SimpleNamespace(stops=SimpleNamespace(rows=np.array(own))) for own in ([0, 1], [2], [3])]
    hole = SimpleNamespace(stations=known, stops=SimpleNamespace(column=columns.__getitem__), newest=4)
    found, of = _selected(SimpleNamespace(hole=hole), asked)
    assert (found.tolist(), of.tolist()) == (rows, stations)


# the verdict


def test_how_far_off_a_hole_is_and_where_it_is_to_be_steered() -> None:
    off = values_of(off_target_view(OFF, foreseen()))
    assert off == {
        "md_m": 12.0, "deviation_cm": 5.0, "sigma_cm": 2.5, "half_width_cm": 12.0, "within_percent": 87.0,
        "limit_cm": 8.0, "used_percent": 62, "azimuth_deg": 307, "wind": "NW",
    }  # fmt: skip
    alone = off_target_view(dataclasses.replace(OFF, limit=0.0), None)
    assert (alone.used_percent, alone.half_width_cm, alone.within_percent) == (None, pytest.approx(4.9, abs=0.11), 0.0)
    assert off_target_view(dataclasses.replace(OFF, limit=0.02), None).used_percent == 250
    known: Any = SimpleNamespace(curvature=0.5 * DEG)
    steer = values_of(steering_view(OFF, Deadline(14.04, 2.04, 0.4567), known))
    expected = {
        "azimuth_deg": 127, "wind": "SE", "before_md_m": 14.0, "left_m": 2.0, "missed": False, "best_percent": 45.7,
        "bend_deg_per_m": 0.5,
    }  # fmt: skip
    assert {name: steer[name] for name in expected} == expected
    assert steering_view(OFF, Deadline(14.0, -0.1, 0.4), known).missed


ENDS = "5 ± 12 cm (95 %) at 307 deg NW; within 8 cm: 87 %"


@pytest.mark.parametrize(
    ("word", "deadline", "end", "line"),
    [
        (Word.DONT_KNOW, None, None, "DON'T KNOW: no depth"),
        (Word.WATCH, None, None, "WATCH: at 12.0 m 5.0 ± 4.9 cm (95 %) at 307 deg NW; limit 8 (62 %)"),
        (Word.STEER, Deadline(14.0, 2.0, 0.5), {}, f"STEER: ends {ENDS}; act before 14.0 m"),
        (Word.STEER, Deadline(14.0, -2.0, 0.5), {}, f"STEER: ends {ENDS}; act at once"),
        (Word.OUT, Deadline(14.0, -2.0, 0.5), {}, f"OUT: ends {ENDS}"),
        (Word.WATCH, Deadline(14.0, None, 0.5), {}, f"WATCH: ends {ENDS}"),
        (Word.OUT, None, {"is_reached": True}, f"OUT: ended {ENDS}"),
    ],
)  # fmt: skip
def test_the_line_of_a_verdict(word: Word, deadline: Deadline | None, end: Any, line: str) -> None:
    found = HoleVerdict(
        word, word, ("no depth",), about=OFF, end=None if end is None else foreseen(**end), deadline=deadline
    )
    assert verdict_line(found) == line


# what the tubes say
