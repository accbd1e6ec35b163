"""What contradicts itself in a wall, in a real browser: one plain line where it is asked for, and all else is there."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from beating import Beating, beating
from hand_fed import FOLLOWED
from playwright.sync_api import Page, expect
from three_holes import write_three_holes

pytestmark = pytest.mark.slow
Open = Callable[..., Page]
BESIDE = ("#word", "#plan svg", "#strip svg", "#tubes tr", "#joints")


def one_line(page: Page, place: str, text: str) -> None:
    """Expect a text that stands in one line, with no word of the program that wrote it."""
    expect(page.locator(place)).to_contain_text(text)
    said = page.locator(place).inner_text()
    assert "\n" not in said.strip()
    assert not re.search(r"Traceback|Error\b|None|nan|undefined|\[object", said.replace(text, ""))


def stations_of(rig: Beating) -> list[float]:
    return [row["md_m"] for row in rig.served.rig.ask("stations")["stations"]]


def test_a_hole_that_leaves_the_planes_is_a_line_and_all_else_is_there(tmp_path: Path, watched: Open) -> None:
    wall = write_three_holes(tmp_path)
    with beating(tmp_path / "ground", (0.3, 0.3, 88.0), wall=wall, hole="H2", **FOLLOWED) as rig:
        page = watched(rig.url)
        one_line(page, "#wall-problem", "the hole runs more than 80 deg off the mean design axis")
        expect(page.locator("#wall-title")).to_have_text("Wall three holes, hole H2")
        expect(page.locator("#wall-findings li")).to_have_count(0)
        for shown in BESIDE[:-1]:
            expect(page.locator(shown).first).to_be_visible()
        assert stations_of(rig) == [2.0, 4.0, 6.0]
        page.select_option("#export-what", "wall")
        page.click("#export button")
        one_line(page, "#exported", "export: nothing to export yet: column H2: at 6 m the hole runs more than 80 deg")
        answer = page.request.get(f"{rig.url}/api/reports/wall.pdf")
        assert answer.status == 409
        assert "\n" not in answer.json()["error"]


def test_a_course_of_no_length_is_one_station(tmp_path: Path, watched: Open) -> None:
    wall = write_three_holes(tmp_path)
    with beating(tmp_path / "ground", (0.1, 0.1), wall=wall, hole="H2") as rig:
        page = watched(rig.url)
        expect(page.locator("#joints tr")).to_have_count(2)
        before = page.locator("#joints").inner_text()
        rig.do(lambda hand: hand.survey(1, 7, 0.1))  # the same place again
        rig.do(lambda hand: hand.survey(1, 8, 0.1))
        expect(page.locator("#wall-problem")).to_have_text("NOT TIGHT so far; required 80 cm")
        expect(page.locator("#joints tr")).to_have_count(2)
        assert stations_of(rig) == [2.0, 4.0]
        assert [line.split()[0] for line in page.locator("#joints").inner_text().splitlines()[:1]] == [
            before.split()[0]
        ]


def test_a_layer_from_the_heads_on_is_a_wall_as_others(tmp_path: Path, watched: Open) -> None:
    wall = write_three_holes(tmp_path, "[[layer]]\nfrom_m = 0\nradius_m = 0.62\n")
    with beating(tmp_path / "ground", (0.1, 0.1), wall=wall, hole="H2") as rig:
        page = watched(rig.url)
        expect(page.locator("#wall-problem")).to_have_text("NOT TIGHT so far; required 80 cm")
        expect(page.locator("#joints tr")).to_have_count(2)


def test_a_hole_that_crosses_its_neighbour_is_named(tmp_path: Path, watched: Open) -> None:
    wall = write_three_holes(tmp_path)
    with beating(tmp_path / "ground", (25.0, 25.0, 25.0, 25.0), wall=wall, hole="H2", **FOLLOWED) as rig:
        page = watched(rig.url)
        expect(page.locator("#wall-findings")).to_contain_text("cross: they have changed sides at ")
        expect(page.locator("#wall-problem")).to_have_text("NOT TIGHT so far; required 80 cm")
        for shown in BESIDE:
            expect(page.locator(shown).first).to_be_visible()


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Beating]:
    """A hole of two stops without a wall."""
    with beating(tmp_path_factory.mktemp("ground"), (0.3, 0.3)) as rig:
        yield rig


@pytest.mark.parametrize(
    ("origin", "grid", "said"),
    [
        ("1,2", "EPSG:25833", "expected NORTHING,EASTING,HEIGHT in m, got '1,2'"),
        ("nan,0,0", "EPSG:25833", "expected a coordinate of -1e+08..1e+08 m, got nan"),
        ("1,2,3", "EPSG:0", "expected a grid such as EPSG:25833, got 'EPSG:0'"),
        ("<b>1</b>", "", "<b>1</b>"),
    ],
)
def test_a_place_that_cannot_be_is_a_line_beside_the_button(
    rig: Beating, watched: Open, origin: str, grid: str, said: str
) -> None:
    page = watched(rig.url)
    page.select_option("#export-format", "geojson")
    page.fill("#export-origin", origin)
    page.fill("#export-grid", grid)
    page.click("#export button")
    one_line(page, "#exported", said)
    assert page.input_value("#export-origin") == origin  # what was typed stands there to be mended
    assert page.input_value("#export-grid") == grid
