"""What the page says of a request that it refuses, and every line and label of the pictures of radio."""

import asyncio
import hashlib
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from starlette.exceptions import HTTPException

from groundstation.gateway.page import application
from groundstation.gateway.page.application import files_digest, not_served, refuse_request
from groundstation.gateway.page.reports import LONGEST, papers_of
from groundstation.gateway.page.request_guard import RequestError, text_of
from groundstation.report.plots_radio import soil_curves, soil_map
from groundstation.report.style import SERIES, WRONG
from groundstation.service.hole.hole_stations import HoleStations


@pytest.mark.parametrize(
    ("status", "wait", "headers"),
    [
        (400, 0.0, {}),
        (429, 2.1, {"retry-after": "3"}),
        (503, 20.0, {"retry-after": "20"}),
        (408, 0.0, {"connection": "close"}),
        (413, 0.5, {"connection": "close", "retry-after": "1"}),
        (415, 0.0, {}),
    ],
)
def test_a_refusal_says_its_line_when_to_come_again_and_that_it_hangs_up(
    status: int, wait: float, headers: dict[str, str]
) -> None:
    answer = asyncio.run(refuse_request(None, RequestError(status, "a line", wait)))  # type: ignore[arg-type]
    assert (answer.status_code, json.loads(bytes(answer.body))) == (status, {"error": "a line"})
    told = {name: value for name, value in answer.headers.items() if name in ("retry-after", "connection")}
    assert told == headers
    with pytest.raises(ZeroDivisionError):
        asyncio.run(refuse_request(None, ZeroDivisionError()))  # type: ignore[arg-type]


def test_an_address_that_there_is_not_is_named_in_eighty_letters() -> None:
    request: Any = SimpleNamespace(method="POST", url=SimpleNamespace(path="/" + "x" * 100))
    answer = asyncio.run(not_served(request, HTTPException(405, "Method Not Allowed", {"allow": "GET"})))
    line = f"POST /{'x' * 79}: Method Not Allowed; see /api/openapi.json"
    assert (answer.status_code, json.loads(bytes(answer.body)), answer.headers["allow"]) == (
        405,
        {"error": line},
        "GET",
    )
    with pytest.raises(ZeroDivisionError):
        asyncio.run(not_served(request, ZeroDivisionError()))


def test_the_name_of_the_files_is_that_of_all_their_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "b").mkdir()
    for name, text in (("b/a.js", "two"), ("a.css", "one"), ("README", "no suffix")):
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(application, "FILES", tmp_path)
    assert files_digest() == hashlib.sha256(b"onetwo").hexdigest()[:16]


def test_what_is_asked_of_the_papers_word_by_word() -> None:
    asked = {"language": "it", "document": "D" * LONGEST, "revision": "B", "contractor": "Bohr"}
    assert papers_of(asked) == {"language": "it", "number": "D" * LONGEST, "revision": "B", "contractor": "Bohr"}
    assert papers_of({}) == {}
    for wrong, line in (
        ({"d" * 50: "x"}, f"parameter {'d' * 40}: expected one of language, document, revision, contractor"),
        ({"document": "D" * 81}, "parameter document: expected one line of at most 80 characters"),
        ({"revision": "a\tb"}, "parameter revision: expected one line of at most 80 characters"),
        ({"language": "y" * 30}, f"parameter language: expected one of de, en, es, fr, it, got '{'y' * 19}"),
    ):
        with pytest.raises(RequestError) as refused:
            papers_of(wrong)
        assert (refused.value.status, refused.value.line[: len(line)]) == (400, line)


@pytest.mark.parametrize("value", ["", "x" * 9, 3, None])
def test_a_text_of_a_body_is_of_its_length(value: Any) -> None:
    assert text_of({"name": "x" * 8}, "name", 8) == "x" * 8
    with pytest.raises(RequestError) as refused:
        text_of({"name": value}, "name", 8)
    assert (refused.value.status, refused.value.line) == (400, "name: expected a text of 1 to 8 characters")


def test_a_map_of_soil_is_shaded_every_five_decibels_and_marks_the_threshold_alone_where_it_is_crossed() -> None:
    """Margins that are linear in sand and clay: contours are straight lines through known points."""
    sand, clay = (side.ravel() for side in np.meshgrid(*2 * [np.linspace(0.0, 1.0, 9)]))
    kept = sand + clay <= 1.0
    sand, clay = sand[kept], clay[kept]
    crossed, above = 30.0 * sand - 12.0, 4.0 + 20.0 * clay
    figure = soil_map(sand, clay, {0.05: crossed, 0.125: above}, "Soil")
    first, second, bar = figure.axes
    assert [one.get_title("left") for one in (first, second)] == ["5 % water", "12.5 % water"]
    assert (first.get_xlabel(), first.get_ylabel(), second.get_ylabel()) == ("Sand (%)", "Clay (%)", "")
    assert (first.get_xlim(), first.get_ylim()) == ((0.0, 100.0), (0.0, 100.0))
    assert bar.get_ylabel() == "Margin (dB)"
    levels = [-15.0, -10.0, -5.0, 0.0, 5.0, 10.0, 15.0, 20.0, 25.0]
    filled, lines, threshold = first.collections[:3]
    np.testing.assert_allclose(filled.levels, levels)  # type: ignore[attr-defined]
    np.testing.assert_allclose(lines.levels, levels)  # type: ignore[attr-defined]
    np.testing.assert_allclose(threshold.levels, [0.0])  # type: ignore[attr-defined]
    assert [to_hex(one) for one in threshold.get_edgecolor()] == [to_hex(WRONG)]
    (path,) = [one for one in threshold.get_paths() if len(one.vertices)]
    np.testing.assert_allclose(np.asarray(path.vertices)[:, 0], 40.0, atol=1e-9)  # 30 * 0.4 = 12
    assert len(second.collections) == 2  # nowhere below the threshold
    assert {text.get_text() for text in first.texts} <= {f"{level:.0f}" for level in levels}
    assert first.texts


def test_curves_of_soil_have_a_line_each_and_the_threshold() -> None:
    distances = np.array([1.0, 2.0, 4.0])
    powers = {"5 % water": np.array([-60.0, -70.0, -90.0]), "20 % water": np.array([-65.0, -80.0, -110.0])}
    (axes,) = soil_curves(distances, powers, -97.0, "Power").axes
    *curves, threshold = axes.get_lines()
    assert [line.get_label() for line in curves] == list(powers)
    for line, values, colour in zip(curves, powers.values(), SERIES, strict=False):
        np.testing.assert_allclose(line.get_xydata(), np.column_stack([distances, values]))
        assert to_hex(line.get_color()) == to_hex(colour)
    assert set(threshold.get_ydata()) == {-97.0}
    assert (threshold.get_label(), to_hex(threshold.get_color())) == ("threshold", to_hex(WRONG))
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("Distance (m)", "Received power (dBm)")
    legend = axes.get_legend()
    assert legend is not None
    assert [text.get_text() for text in legend.get_texts()] == ["5 % water", "20 % water", "threshold"]


def test_stations_below_the_collar_leave_out_the_one_at_it() -> None:
    stations = [SimpleNamespace(md=md) for md in (0.0, 1e-9, 3.0)]
    below: Any = HoleStations.below
    assert [one.md for one in below.fget(SimpleNamespace(all=stations))] == [1e-9, 3.0]
