"""Small parts of the ground station: a table of stops that grows, arguments of orders, sites, needs of instruments."""

from __future__ import annotations

import datetime
import math
from types import SimpleNamespace
from typing import Any

import msgpack
import numpy as np
import pytest

from groundstation.calibration.attitudes import AttitudeFit
from groundstation.calibration.mwd_model import Triad
from groundstation.errors import SelectorError, SurveyError
from groundstation.gateway.page import exports
from groundstation.gateway.page.openapi import arguments_of, openapi_document
from groundstation.gateway.zenoh import ZenohGateway
from groundstation.report.calibrations.linear_outcome import LinearCalibration, linear_outcome
from groundstation.service.answers.paths import check_parameters
from groundstation.service.hole.resolved_stops import FEWEST, ROW, ResolvedStops
from groundstation.service.process.intake_tape import Tape, unpack_intake
from groundstation.survey.requests.survey_answer import magnetic_needs
from groundstation.survey.requests.wall_result import wall_site
from groundstation.survey.well.gyro_export import needs_record
from telemetry.application.arguments import shown_name
from telemetry.application.commands import COMMANDS
from telemetry.media.zenoh_bus import MSGPACK
from telemetry.quantities import ValueKind


def stops_of(count: int) -> ResolvedStops:
    """A table whose every number is another one."""
    table = ResolvedStops(count)
    bits = np.arange(count * ROW.itemsize, dtype=np.uint64).astype(np.uint8)
    table.rows = np.frombuffer(bits.tobytes(), ROW).copy()
    table.rows["sequence"], table.rows["replaces"] = np.arange(count) + 1000, -1
    table.forces = [b"force %d" % k for k in range(count)]
    table.places = [np.array([k]) for k in range(count)]
    table.depth_places = [np.arange(k + 4) for k in range(count)]
    return table


def test_a_table_of_stops_keeps_every_row_as_it_grows() -> None:
    count = 2 * FEWEST + 30
    other, table = stops_of(count), ResolvedStops()
    for k in range(count):
        assert table.append_stop(other, k) == k
    assert len(table) == count
    assert table.rows[:count].tobytes() == other.rows.tobytes()
    assert table.forces == other.forces
    assert [place.tolist() for place in table.places] == [[k] for k in range(count)]
    assert np.all(np.diff(list(table.below)) == 1)
    table.replace_stop(7, other, 100)
    assert table.rows["sequence"][7] == other.rows["sequence"][100]
    assert table.rows["replaces"][7] == other.rows["sequence"][7]
    assert table.places[7].tolist() == [100]
    assert table.below[7] == table.below[100]
    assert table.rows[8:count].tobytes() == other.rows[8:].tobytes()


TYPES = {ValueKind.NUMBER: "number", ValueKind.INTEGER: "integer", ValueKind.BOOLEAN: "boolean"}


@pytest.mark.parametrize("spec", COMMANDS, ids=[f"{spec.name}-{spec.action}" for spec in COMMANDS])
def test_the_schema_of_an_order_asks_for_its_action_or_tube_and_what_it_needs(spec: Any) -> None:
    """Angles are told in degrees; what a driver may leave out is not required."""
    schema = arguments_of(spec)
    first = "action" if spec.action else "tube"
    assert schema["required"] == [first, *(shown_name(one.quantity) for one in spec.arguments if one.needed)]
    assert list(schema["properties"]) == [first, *(shown_name(one.quantity) for one in spec.arguments)]
    assert schema["properties"][first].get("const") == (spec.action or None)
    assert schema["additionalProperties"] is False
    for one in spec.arguments:
        told, q = schema["properties"][shown_name(one.quantity)], one.quantity
        assert told["type"] == TYPES.get(q.kind, "string")
        assert told["description"] == q.meaning
        assert told.get("enum", []) == list(q.choices)
        if q.kind in (ValueKind.NUMBER, ValueKind.INTEGER):
            scale = 180.0 / math.pi if q.unit == "rad" else 1.0
            for key, end in (("minimum", q.low), ("maximum", q.high)):
                assert told.get(key) == (pytest.approx(end * scale) if math.isfinite(end) else None)


def test_a_command_of_several_actions_takes_one_of_them() -> None:
    paths = openapi_document("1")["paths"]
    for name in {spec.name for spec in COMMANDS}:
        specs = [spec for spec in COMMANDS if spec.name == name]
        order = paths[f"/api/cmd/{name}"]["post"]
        body = order["requestBody"]["content"]["application/json"]["schema"]
        assert body == (arguments_of(specs[0]) if len(specs) == 1 else {"oneOf": [arguments_of(one) for one in specs]})
        assert all(spec.meaning in order["description"] for spec in specs)


def test_a_parameter_that_no_path_takes_is_refused_with_those_that_are() -> None:
    paths: Any = [SimpleNamespace(parameters=("md", "tube")), SimpleNamespace(parameters=("since",))]
    check_parameters(paths, {"md": "1", "since": "2", "format": "3"}, ("format",))
    with pytest.raises(SelectorError, match="parameter dm: expected one of format, md, since, tube"):
        check_parameters(paths, {"dm": "1"}, ("format",))
    with pytest.raises(SelectorError, match="parameter md: expected none"):
        check_parameters([], {"md": "1"})


def test_the_site_of_a_wall_is_told_in_degrees_with_what_was_stated() -> None:
    site = SimpleNamespace(gravity=9.81, b_field=49_000.0, dip=1.1, declination=-0.05, latitude=0.9)
    wall: Any = SimpleNamespace(
        file=SimpleNamespace(assumed=SimpleNamespace(site=site), stated={"dip_deg", "field_nt"})
    )
    assert wall_site(wall) == {
        "gravity_mps2": 9.81,
        "field_nt": 49_000.0,
        "dip_deg": math.degrees(1.1),
        "declination_deg": math.degrees(-0.05),
        "latitude_deg": math.degrees(0.9),
        "sources": {
            "gravity_mps2": "default", "field_nt": "stated", "dip_deg": "stated", "declination_deg": "default",
            "latitude_deg": "default",
        },
    }  # fmt: skip


def tool_for(*variables: str) -> Any:
    return SimpleNamespace(asks_for=lambda name: name in variables)


@pytest.mark.parametrize(
    ("tools", "needs"),
    [
        ([()], set()),
        ([("BField",)], {"field_nt"}),
        ([("Dip",), ("Inc",)], {"dip_deg"}),
        ([("Inc",), ("AzM", "BField")], {"declination_deg", "field_nt"}),
        ([("BField", "Dip", "AzM")], {"field_nt", "dip_deg", "declination_deg"}),
    ],
)
def test_a_figure_of_the_field_is_needed_where_one_instrument_asks(tools: list[Any], needs: set[str]) -> None:
    assert magnetic_needs([tool_for(*variables) for variables in tools]) == needs


@pytest.mark.parametrize("name", ["SigmaYaw", "SigmaSystematic", "SigmaForce", "Readings"])
def test_a_record_is_needed_for_any_of_its_columns(name: str) -> None:
    assert needs_record(tool_for(name))
    assert not needs_record(tool_for("MD", "Inc"))


def test_coefficients_that_are_absent_are_zero() -> None:
    names = [f"{kind}_{axis}0" for kind in ("SF", "B") for axis in "ABC"]
    names += [f"m_{pair}" for pair in ("AB", "AC", "BA", "BC", "CA", "CB")]
    triad = Triad.of("ABC", {name: float(k + 1) for k, name in enumerate(names)})
    assert triad.scale.tolist() == [[1.0, 0.0, 0.0, 0.0], [2.0, 0.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0]]
    assert triad.bias.tolist() == [[4.0, 0.0, 0.0, 0.0], [5.0, 0.0, 0.0, 0.0], [6.0, 0.0, 0.0, 0.0]]
    assert triad.cross.tolist() == [7.0, 8.0, 9.0, 10.0, 11.0, 12.0]


def test_what_was_found_of_a_rig_is_a_fact_of_its_sheet() -> None:
    fit = AttitudeFit(np.eye(3), np.zeros(3), np.eye(12), np.ones((2, 3)), 1.0, 4, np.ones(2), yaw=0.1, yaw_std=0.01)
    job = LinearCalibration(
        fit, ("a", "b"), np.eye(3)[:2], np.eye(3)[:2], 1.0, 1.0, "m/s2", "", "accelerometer", "by hand", "0" * 64,
        forced=("gate one", "gate two"), widened=1.25,
    )  # fmt: skip
    outcome = linear_outcome(job, "2026-02-03", 21.5, {"yaw_deg": 1.23456, "yaw_std_deg": 0.06789})
    assert outcome.sheet.title == "Calibration of accelerometer"
    assert list(outcome.sheet.facts[:6]) == [
        ("Method", "by hand"),
        ("Temperature", "21.5 °C"),
        ("Yaw of the rig", "1.2346 deg, standard error 0.0679 deg"),
        ("Intervals", "up to 1.25 times wider, for the order of the residuals"),
        ("Forced past", "gate one"),
        ("Forced past", "gate two"),
    ]
    plain = linear_outcome(LinearCalibration(*([getattr(job, n) for n in job.__slots__][:11])), "2026-02-03", None, {})
    assert [name for name, _ in plain.sheet.facts[:3]] == ["Method", "Temperature", "Residual rms"]
    assert dict(plain.sheet.facts)["Temperature"] == "not stated"
    assert (outcome.result["temperature_c"], outcome.result["widened"], outcome.result["forced"]) == (
        21.5, 1.25, ["gate one", "gate two"],
    )  # fmt: skip


class AskedIntake:
    """A question of a recorder, and what it is answered."""

    def __init__(self, **parameters: str) -> None:
        self.parameters, self.selector_key = parameters, "key"
        self.replies: list[list[int]] = []
        self.refusals: list[str] = []
        self.is_finished = False

    def reply(self, key: str, payload: bytes, encoding: str) -> None:
        assert (key, encoding) == ("key", MSGPACK)
        self.replies.append([unpack_intake(one).number for one in msgpack.unpackb(payload)])

    def reply_error(self, text: str) -> None:
        self.refusals.append(text)

    def finish(self) -> None:
        self.is_finished = True


@pytest.mark.parametrize(
    ("since", "numbers"),
    [
        (None, range(1, 501)), ("0", range(1, 501)), ("3", range(4, 504)), ("599", range(600, 701)), ("699", [700]),
        ("700", []), ("701", []), ("99999", []),
    ],
)  # fmt: skip
def test_a_recorder_gets_what_came_after_its_newest_so_many_at_a_time(since: str | None, numbers: Any) -> None:
    tape = Tape()
    for k in range(700):
        tape.add("depth", float(k), float(k), 1, b"x")
    gateway: Any = SimpleNamespace(_process=SimpleNamespace(tape=tape))
    query: Any = AskedIntake(**({} if since is None else {"since": since}))
    ZenohGateway._answer_intake(gateway, query)
    assert query.replies == [list(numbers)]
    assert query.is_finished
    wrong: Any = AskedIntake(since="-1")
    ZenohGateway._answer_intake(gateway, wrong)
    assert wrong.refusals
    assert "parameter since: expected a whole number, got '-1'" in wrong.refusals[0]


@pytest.mark.parametrize(("what", "alone"), [("hole", "K21"), ("wall", None)])
def test_a_hole_of_a_wall_is_exported_alone_and_the_wall_whole(
    what: str, alone: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged = SimpleNamespace(judgement="judged", wall="wall", problem="")
    model: Any = SimpleNamespace(
        wall=SimpleNamespace(hole="K21", judged=lambda survey, bit: judged), string=SimpleNamespace(bit=3.0)
    )
    monkeypatch.setattr(exports, "survey_of", lambda model: "survey")
    monkeypatch.setattr(exports, "site_of_wall", lambda *given: given)
    day = datetime.date(2026, 2, 3)
    assert exports.live_site(model, what, {"grid_crs": "EPSG:1"}, day) == (("wall", "judged", day, "EPSG:1"), alone)
    with pytest.raises(SurveyError, match="--origin: the wall's file says"):
        exports.live_site(model, what, {"origin": "1,2,3"}, day)
    judged.judgement, judged.problem = None, "no heads"
    with pytest.raises(SurveyError, match="nothing to export yet: no heads"):
        exports.live_site(model, what, {}, day)
