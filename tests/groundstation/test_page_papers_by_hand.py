"""What the page hands out, by hand: papers and files by their names, its document, and what a refusal says."""

from __future__ import annotations

import asyncio
import json
import math
from types import SimpleNamespace
from typing import Any

import pytest

from groundstation.errors import SurveyError
from groundstation.gateway.page import application, exports, reports
from groundstation.gateway.page.openapi import answer_operation, arguments_of, openapi_document
from groundstation.gateway.page.request_guard import (
    RequestError,
)
from groundstation.service.answers.answer_table import ANSWERS
from telemetry.application.commands import COMMANDS


@pytest.mark.parametrize(
    ("asked", "status"),
    [
        ({"language": "de", "document": "D-7", "revision": "2", "contractor": "C"}, 0), ({"x" * 60: "1"}, 400),
        ({"document": "a" * 80}, 0), ({"document": "a" * 81}, 400), ({"contractor": "a\nb"}, 400),
        ({"language": "xx"}, 400),
    ],
)  # fmt: skip
def test_papers_of_a_report_are_named_and_one_line_each(asked: dict[str, str], status: int) -> None:
    if status:
        with pytest.raises(RequestError) as told:
            reports.papers_of(asked)
        assert told.value.status == status
        return
    found = reports.papers_of(asked)
    assert found == {("number" if name == "document" else name): text for name, text in asked.items()}


def test_what_cannot_be_exported_is_refused_before_anything_is_made() -> None:
    model: Any = SimpleNamespace(wall=None, config=SimpleNamespace(hole="", rig="rig-7"))
    refused: tuple[tuple[str, str, dict[str, str]], ...] = (
        ("tube", "las", {}, 404),
        ("hole", "doc", {}, 404),
        ("hole", "las", {"x": "y"}, 400),
        ("wall", "las", {}, 404),
    )
    for what, form, asked, status in refused:
        with pytest.raises(RequestError) as told:
            asyncio.run(exports.live_export(model, what, form, asked))
        assert told.value.status == status


@pytest.mark.parametrize(
    ("hole", "form", "name"), [("", "las", "rig-7-hole.las"), ("K4", "witsml", "K4-hole.witsml.xml")]
)
def test_a_file_has_the_name_of_its_hole_and_the_ending_of_its_format(
    monkeypatch: pytest.MonkeyPatch, hole: str, form: str, name: str
) -> None:
    model: Any = SimpleNamespace(wall=None, config=SimpleNamespace(hole=hole, rig="rig-7"))
    done: list[Any] = []

    def live_site(*given: Any) -> tuple[str, str]:
        done.append(given[:3])
        return "site", "one"

    def exported(*given: Any) -> bytes:
        done.append(given)
        return b"made"

    monkeypatch.setattr(exports, "live_site", live_site)
    monkeypatch.setattr(exports, "exported_bytes", exported)
    found = asyncio.run(exports.live_export(model, "hole", form, {"origin": "1,2,3"}))
    assert found == (name, {"las": "text/plain", "witsml": "application/xml"}[form], b"made")
    assert done == [(model, "hole", {"origin": "1,2,3"}), ("site", form, "one")]
    for error, status in ((SurveyError("not yet"), 409), (ImportError("x", name="lasio"), 501)):

        def fail(*_: Any, error: Exception = error) -> Any:
            raise error

        monkeypatch.setattr(exports, "exported_bytes", fail)
        with pytest.raises(RequestError) as told:
            asyncio.run(exports.live_export(model, "hole", form, {}))
        assert told.value.status == status


# the document


def test_the_document_has_every_answer_and_order_with_limits_as_they_are_written() -> None:
    document = openapi_document("7.1")
    assert (document["openapi"], document["info"]["version"]) == ("3.1.0", "7.1")
    paths = document["paths"]
    assert {path for path in paths if path.startswith("/api/cmd/")} == {f"/api/cmd/{spec.name}" for spec in COMMANDS}
    assert {f"/api/{pattern}" for pattern in ANSWERS} <= set(paths)
    names = [op["operationId"] for one in paths.values() for op in one.values()]
    assert len(names) == len(set(names))
    assert set(paths["/api/session"]) == {"get", "post", "delete"}
    assert set(paths["/api/session"]["post"]["responses"]) == {"200", "400", "401", "403", "408", "413", "415", "429"}
    assert set(paths["/api/stream"]["get"]["responses"]) == {"200", "401", "503"}
    spec = next(one for one in COMMANDS if one.name == "north" and one.action == "tell")
    schema = arguments_of(spec)
    angle = next(one.quantity for one in spec.arguments if one.quantity.unit == "rad")
    shown = schema["properties"]["angle_deg"]
    assert (shown["minimum"], shown["maximum"]) == pytest.approx((math.degrees(angle.low), math.degrees(angle.high)))
    assert schema["properties"]["action"] == {"const": "tell"}
    assert schema["required"][0] == "action"
    assert schema["additionalProperties"] is False
    tube = next(arguments_of(one) for one in COMMANDS if not one.action)
    assert tube["required"][0] == "tube"
    numbered = answer_operation(ANSWERS["orders/{n}"])
    assert [(one["name"], one["in"], one["required"]) for one in numbered["parameters"] if one["in"] == "path"] == [
        ("n", "path", True)
    ]  # fmt: skip
    stations = answer_operation(ANSWERS["stations"])
    assert [(one["name"], one["in"]) for one in stations["parameters"]] == [("md", "query")]


def test_a_refusal_says_when_to_come_again_and_closes_what_it_cannot_read() -> None:
    for status, wait, headers in (
        (429, 1.2, {"retry-after": "2"}),
        (413, 0.0, {"connection": "close"}),
        (400, 0.0, {}),
    ):
        made = asyncio.run(application.refuse_request(None, RequestError(status, "why", wait)))  # type: ignore[arg-type]
        assert (made.status_code, json.loads(bytes(made.body))) == (status, {"error": "why"})
        found = {name: made.headers.get(name) for name in ("retry-after", "connection") if name in made.headers}
        assert found == headers
    assert len(application.files_digest()) == 16
    assert application.files_digest() == application.files_digest()
