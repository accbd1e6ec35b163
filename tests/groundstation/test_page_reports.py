"""Reports from the page: the PDF of the wall and of the hole from what is known now, and what is refused."""

import asyncio
from pathlib import Path

import pytest
from hand_fed import Rig
from page_client import PageClient, free_port
from served import serving
from three_holes import write_three_holes

from groundstation.gateway.page.page_settings import PageSettings
from groundstation.gateway.page.reports import ReportTypesetter
from groundstation.gateway.page.request_guard import RequestError

pytestmark = pytest.mark.slow


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    """The middle hole of three, two stops deep."""
    wall = write_three_holes(tmp_path)
    rig = Rig(tmp_path / "ground", target=8.0, wall=wall, hole="H2")
    rig.run(5.0)
    return rig


def test_wall_and_hole_come_as_pdf_and_another_is_refused_meanwhile(rig: Rig) -> None:
    for stop in (1, 2):
        rig.drill(stop, 0.3)
    port = free_port()
    with serving(rig, PageSettings("127.0.0.1", port)):
        page = PageClient(port)
        for subject in ("wall", "hole"):
            answer = page.get(f"/api/reports/{subject}.pdf")
            assert (answer.status, answer.headers["content-type"]) == (200, "application/pdf")
            assert answer.headers["content-disposition"] == f'attachment; filename="H2-{subject}.pdf"'
            assert answer.body.startswith(b"%PDF")
        plain, italian, same = (
            page.get(f"/api/reports/hole.pdf{words}").body
            for words in ("", "?language=it&document=D-17&revision=B&contractor=Bohr%20AG", "?language=en")
        )
        assert italian.startswith(b"%PDF")
        assert (plain == same, plain == italian) == (True, False)
        assert b"/Lang(it)" in italian
        for words, told in (
            ("language=xx", "parameter language: expected one of de, en, es, fr, it, got 'xx'"),
            ("depth=3", "parameter depth: expected one of language, document, revision, contractor"),
            (f"document={'9' * 81}", "parameter document: expected one line of at most 80 characters"),
            ("document=%0a", "parameter document: expected one line"),
        ):
            refused = page.get(f"/api/reports/wall.pdf?{words}")
            assert (refused.status, told in refused.content["error"]) == (400, True)
        unknown = page.get("/api/reports/string.pdf")
        assert (unknown.status, unknown.content["error"]) == (404, "report: expected wall or hole, got 'string'")
    rig.ground.close()


def test_a_second_report_waits_for_the_first(rig: Rig) -> None:
    rig.drill(1, 0.3)
    reporter = ReportTypesetter(rig.ground.model, "0")

    async def both() -> list[object]:
        return await asyncio.gather(reporter.pdf("hole"), reporter.pdf("wall"), return_exceptions=True)

    made, refused = asyncio.run(both())
    assert isinstance(made, tuple)
    assert isinstance(refused, RequestError)
    assert (refused.status, refused.line) == (503, "another report is being made")
    rig.ground.close()


def test_a_rig_without_a_wall_says_how_it_gets_one(tmp_path: Path) -> None:
    rig = Rig(tmp_path, target=8.0)
    with pytest.raises(RequestError, match="no wall; see --wall and --hole"):
        asyncio.run(ReportTypesetter(rig.ground.model, "0").pdf("wall"))
    rig.ground.close()
