"""The page's form that exports: a file of each format is saved by the browser, and a refusal is told beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from beating import Beating, beating
from page_client import PageClient
from playwright.sync_api import Page, expect
from three_holes import write_three_holes

from groundstation.gateway.page.exports import ENDINGS
from groundstation.survey.exports.export_request import FORMATS

pytestmark = pytest.mark.slow
Open = Callable[..., Page]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Beating]:
    """A hole of three stops."""
    with beating(tmp_path_factory.mktemp("ground"), (0.3, 0.3, 0.3)) as rig:
        yield rig


def saved(page: Page, form: str) -> tuple[str, bytes]:
    """Export by the button; name and bytes of the file that the browser saves."""
    page.select_option("#export-format", form)
    with page.expect_download() as download:
        page.click("#export button")
    return download.value.suggested_filename, Path(download.value.path()).read_bytes()


def test_every_format_is_offered_and_saved(rig: Beating, watched: Open) -> None:
    page = watched(rig.url)
    expect(page.locator("#word")).to_have_text("ON TARGET")
    offered = page.locator("#export-format option").evaluate_all("(rows) => rows.map((row) => row.value)")
    assert offered == list(FORMATS)
    assert page.locator("#export-wall").is_disabled()
    page.fill("#export-origin", "5806123.456, 389000.125, 35.5")
    page.fill("#export-grid", "EPSG:25833")
    asked = "?origin=5806123.456,389000.125,35.5&grid_crs=EPSG:25833"
    for form in FORMATS:
        name, content = saved(page, form)
        assert name == f"rig-1-hole.{ENDINGS.get(form, form)}"
        expect(page.locator("#exported")).to_have_text(name)
        if form != "dxf":  # a drawing says when it was written
            assert content == PageClient(rig.page.port).get(f"/api/exports/hole.{form}{asked}").body
    assert b"389000.125" in saved(page, "dxf")[1]


def test_a_refusal_is_told_beside_the_button(rig: Beating, watched: Open) -> None:
    page = watched(rig.url)
    page.select_option("#export-format", "geojson")
    page.click("#export button")
    expect(page.locator("#exported")).to_contain_text("geojson: expected --grid-crs and --origin")
    page.fill("#export-origin", "north")
    page.click("#export button")
    expect(page.locator("#exported")).to_contain_text("expected NORTHING,EASTING,HEIGHT in m, got 'north'")


def test_a_rig_of_a_wall_offers_it(tmp_path: Path, watched: Open) -> None:
    wall = write_three_holes(tmp_path)
    with beating(tmp_path / "ground", (0.3, 0.3), wall=wall, hole="H2") as rig:
        page = watched(rig.url)
        expect(page.locator("#export-wall")).to_be_enabled()
        expect(page.locator("#export-origin")).to_be_disabled()
        page.select_option("#export-what", "wall")
        name, content = saved(page, "ifc")
        assert name == "H2-wall.ifc"
        assert content.count(b"=IFCPILE(") == 3
