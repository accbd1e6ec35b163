"""Reports in other languages: every phrase is in the tables of words, names stay, page 1 says what it has to."""

import functools
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from forked_commands import run
from matplotlib.text import Text
from test_reports import DAY, write_wall

from borechain import api
from borechain.cli.report_options import LANGUAGES
from groundstation.errors import SurveyError
from groundstation.report import figure_panels, figure_words
from groundstation.report.calibrations.calibration_request import AttitudesRequest, TurntableRequest
from groundstation.report.certificate import Identity, template_data, typeset_png_pages
from groundstation.report.column_report import column_report
from groundstation.report.document import Document, Origin, ReportPapers, document_content, report_pages, report_pdf
from groundstation.report.figure_words import translate_figure
from groundstation.report.hole_report import HolePapers, hole_report
from groundstation.report.plots_wall import draw_wall
from groundstation.report.wall_report import column_records, site_of, wall_report
from groundstation.report.word_tables import known_languages, word_table
from groundstation.survey.requests.survey_request import SurveyRequest
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import read_wall

pytestmark = pytest.mark.slow
OTHERS = [language for language in LANGUAGES if language != "en"]
SHOWN = ("P01", "P03", "P06", "P10", "P15")
DATA = Path(__file__).parents[1] / "data" / "calibration"
# what is the same in another language, names of the test, and names of models, methods and sources
SAME = {
    "de": "Revision Software sigma", "fr": "Document Site Joints joint Date vertical source Stations attitude sigma",
    "es": "Software sigma vertical", "it": "Software sigma",
}  # fmt: skip
NAMES = {
    "North pit wall", "Station square, lot 3", "Bohr and Sons", "City railways", "Station to Station",
    "minimum-curvature", "relay", "relay: Chain of low-cost nodes with relayed yaw, calibrated", "R-17",
    "Tube 7", "wall",
    "calibration, Allan analysis and the filter's own variances, station by station",
}  # fmt: skip
UNITS = r"[\W\d_]*(\b(m|mm|deg|azi|incl|N|E|s|MD|sigma)\b[\W\d_]*)*"
NO_WORD = re.compile(UNITS + r"|[0-9a-f]{64}|[A-Z]+(-[A-Z]+)?|[PRKD]-?\d+.*|[\d.]+ .{1,5}|[-+−]?[xyz]|[\d.e−-]+")

DRAWN = re.compile(r"\$.*\$|rms [\d.e-]+ \S+|K7|P\d\d")  # ticks, and what is the same in every language


def in_turn(languages: list[str]) -> pytest.MarkDecorator:
    """Every test of one language before those of the next: two workers that share them do not each set every report."""
    return pytest.mark.parametrize("language", languages, scope="module")


def origin_in(language: str) -> Origin:
    papers = ReportPapers("D-17", "B", "Bohr and Sons", "City railways", language)
    return Origin(DAY, "1.2.3", [("SHA-256 of wall.toml", "ab" * 32)], papers)


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("hole") / "K7.csv"
    path.write_text("MD (m),Inc (deg),Azi (deg),time_s\n0,0,0,10\n10,1,120,200\n20,3,125,390\n30,3.5,124,580\n")
    return path


class Said(NamedTuple):
    """Reports of a wall of 20, of five of its columns and of a hole in one language, and what they say."""

    documents: list[Document]
    contents: list[dict[str, Any]]
    texts: list[str]  # of these and of two certificates
    drawn: list[str]  # in every picture of them


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory, record: Path) -> Callable[[str], Said]:
    """The same wall and hole in any language; each is set once."""
    wall = read_wall(write_wall(tmp_path_factory.mktemp("wall")))
    judgement, answer = judge_wall(wall), api.answer_survey(SurveyRequest(record))
    records = [one for one in column_records(wall, judgement) if one.design.name in SHOWN]

    @functools.cache
    def in_language(language: str) -> Said:
        origin, drawn = origin_in(language), []

        def keep(figure: Any, language: str) -> Any:
            shown = translate_figure(figure, language)
            drawn.extend(text.get_text() for text in shown.findobj(Text))
            return shown

        with pytest.MonkeyPatch.context() as patch:
            for module in (figure_words, figure_panels):
                patch.setattr(module, "translate_figure", keep)
            columns = [column_report(one, site_of(wall), origin) for one in records]
            hole = hole_report(answer, HolePapers("Station to Station", "R-17", ""), origin)
            documents = [wall_report(wall, judgement, origin), *columns, hole]
            contents = [document_content(one) for one in documents]
            told = [text for one in (*contents, *certificates(language)) for text in texts(one)]
        return Said(documents, contents, told, drawn)

    return in_language


def certificates(language: str) -> Iterator[dict[str, Any]]:
    for request in (
        AttitudesRequest(DATA / "calibration_vn100_accel.csv"),
        TurntableRequest(DATA / "calibration_node_a1_gyro.csv", reference=720.0),
    ):
        found = api.calibrate(request, DAY)
        papers = (("Certificate", "K-17"), ("Serial number", "R-17"), ("Next due", "2027-11-20"))
        identity = Identity("Tube 7", DAY, "r.csv", found.record_sha256, found.block_sha256, "1", papers, language)
        yield json.loads(template_data(found.sheet, found.panels(), identity))


def texts(content: Any) -> Iterator[str]:
    """Every text that is set but for software, pictures and file names."""
    if isinstance(content, str):
        yield content
    elif isinstance(content, list | tuple):
        for part in content:
            yield from texts(part)
    elif isinstance(content, dict):
        for name, part in content.items():
            if name not in ("software", "svg", "figure", "language", "logo", "record", "day"):
                yield from texts(part)


def test_no_title_of_a_picture_is_cut(tmp_path: Path) -> None:
    """A wall with missing and unsurveyed columns has the longest."""
    wall = read_wall(write_wall(tmp_path))
    figure = draw_wall(wall, judge_wall(wall))
    figure.canvas.draw()
    titles = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().startswith("All joints")]
    assert [title.get_text() for title in titles] == [
        "All joints (ring: the worst;\ncrossed: missing;\nhatched: not surveyed)"
    ]
    for title in titles:
        extent = title.get_window_extent()
        assert extent.x0 >= 0.0
        assert extent.x1 <= figure.bbox.x1
        assert extent.y1 <= figure.bbox.y1


@in_turn(OTHERS)
def test_no_english_phrase_is_left(said: Callable[[str], Said], language: str) -> None:
    english, other = said("en"), said(language)
    assert len(english.texts) == len(other.texts)
    left = {a for a, b in zip(english.texts, other.texts, strict=True) if a == b} - NAMES - set(SAME[language].split())
    assert {text for text in left if not NO_WORD.fullmatch(text)} == set()
    assert {"Plan", "Worst joints", "design axis", "residual, deg/s"} < set(english.drawn)
    left = {a for a, b in zip(english.drawn, other.drawn, strict=True) if a == b} - NAMES
    assert {text for text in left if not (NO_WORD.fullmatch(text) or DRAWN.fullmatch(text))} == set()
    for a, b in zip(english.drawn, other.drawn, strict=True):
        assert sorted(re.findall(r"\d[\d.]*\d|\d", a)) == sorted(re.findall(r"\d[\d.]*\d|\d", b)), (a, b)


@in_turn(OTHERS)
def test_numbers_stay_as_they_are(said: Callable[[str], Said], language: str) -> None:
    for one, other in zip(said("en").contents, said(language).contents, strict=True):
        for a, b in zip(texts(one), texts(other), strict=True):
            assert sorted(re.findall(r"-?\d[\d.]*\d|\d", a)) == sorted(re.findall(r"-?\d[\d.]*\d|\d", b)), (a, b)


@in_turn(OTHERS)
def test_names_of_people_stay_as_they_are(said: Callable[[str], Said], language: str) -> None:
    content = said(language).contents[-1]
    shown = [text for _, text in content["facts"]]
    assert {"Bohr and Sons", "City railways", "Station to Station", "D-17", "B"} <= set(shown)
    assert content["subject"] == "Station to Station"


def test_the_first_page_says_what_is_not_stated_and_what_the_sigma_holds(said: Callable[[str], Said]) -> None:
    wall, column, *_, hole = (dict(content["facts"]) for content in said("en").contents)
    for facts in (wall, column, hole):
        assert (facts["Document"], facts["Revision"], facts["Contractor"]) == ("D-17", "B", "Bohr and Sons")
    assert wall["Serial and calibration of the instruments"] == "stated of all 19 columns that were surveyed"
    assert column["Serial and calibration of the instruments"] == "R-17 / R-17/2026-031"
    assert wall["Site"] == "gravity 9.81000 m/s^2"
    assert "no mistakes" in wall["What the ± contains"]
    assert hole["Times of the surveys"] == "10 to 580 s of its record"
    assert hole["Site"].startswith("gravity 9.81000 m/s^2 (default); latitude 52 deg")


def test_a_column_says_when_it_was_surveyed_and_what_of_its_data_hardly_can_be(tmp_path: Path) -> None:
    path = write_wall(tmp_path)
    table = (tmp_path / "stations.csv").read_text().splitlines()
    timed = [table[0] + ",time_s", *(f"{line},{100 + 7 * k}" for k, line in enumerate(table[1:]))]
    (tmp_path / "stations.csv").write_text("\n".join(timed) + "\n")
    wall = read_wall(path)
    records = column_records(wall, judge_wall(wall))
    facts = dict(column_report(records[0], site_of(wall), origin_in("en")).facts)
    assert re.fullmatch(r"100 to \d+ s of its record", facts["Times of the surveys"])
    assert facts["Check of the data"] == "nothing is missing, and nothing is beyond what steel does"
    good = column_report(records[0], site_of(wall), origin_in("en"))
    doubted = column_report(replace(records[0], warnings=("a spike",)), site_of(wall), origin_in("en"))
    assert (good.good, doubted.good, dict(doubted.facts)["Check of the data"]) == (True, False, "warnings: 1")
    whole = dict(wall_report(wall, judge_wall(wall), origin_in("en")).facts)
    assert whole["Times of the surveys"] == "stated of all 19 columns that were surveyed"


def test_a_hole_has_a_report_of_its_own(said: Callable[[str], Said]) -> None:
    hole = said("en").documents[-1]
    found = re.fullmatch(
        r"The hole ends at 30 m: north (\S+) ± (\S+) m, east (\S+) ± (\S+) m, down (\S+) ± (\S+) m, 95 % each",
        hole.verdict,
    )
    assert found
    north, east, down = (float(found[k]) for k in (1, 3, 5))
    assert (north, east) == (pytest.approx(-0.558, abs=2e-3), pytest.approx(0.833, abs=2e-3))
    assert down < 30.0
    sections = {section.title: section for section in hole.sections}
    stds_mm = [float(cell) for cell in sections["Stations"].rows[-1][-3:]]  # one sigma, rounded to 0.1 mm
    for half, std_mm in zip((2, 4, 6), stds_mm, strict=True):
        assert std_mm > 1.0
        assert 1e3 * float(found[half]) == pytest.approx(1.959964 * std_mm, abs=0.7)
    assert dict(sections["Instrument"].facts)["Calibration"] == "not stated"
    assert [row[0] for row in sections["Stations"].rows] == ["0.00", "10.00", "20.00", "30.00"]
    assert hole.good


def test_a_warning_stands_on_the_report_of_a_hole(tmp_path: Path) -> None:
    path = tmp_path / "typed.csv"
    path.write_text("md_m,inclination_deg,azimuth_deg\n0,0,0\n10,1,120\n20,30,120\n30,1,120\n")
    document = hole_report(api.answer_survey(SurveyRequest(path)), HolePapers(), origin_in("en"))
    assert not document.good
    assert re.search(r"warnings: [1-9]", document.verdict)
    check = next(section for section in document.sections if section.title == "Check of the data")
    assert any("20 m" in line for line in check.words)


@pytest.mark.parametrize("language", [language for language in LANGUAGES if language != "en"])
@pytest.mark.parametrize(
    "text",
    [
        "Line 23: Inc (deg) = '-999.25' stands for no value, at 63: the station is left out.",
        "Line 23: MD = '' stands for no value: the station is left out.",
        "The hole: the station at 30 m departs by 11.9 and 11.8 deg from its neighbours, which differ by 0.1: "
        "inclination 12 deg, azimuth 109 deg.",
        "K011: a dogleg of 9.0 deg from 3 to 6 m, 90 deg in 30 m; expected at most 2 deg and 1 deg a metre.",
        "Column K1, line 6: inclination_deg stands for no value: the station at 5 m is left out.",
        "Column K1: it leans by 30.0 deg from its design at 5 m; expected at most 10 deg.",
        "Column K1: surveyed to 10000 m; it is designed to 10 m.",
        "K1: a radius of 60 m; expected at most 3 m.",
        "Joint K1-K2: radii of up to 60 m at a spacing of 0.7 m.",
        "T-12 / not stated",
    ],
)
def test_a_warning_and_what_is_not_stated_are_said_in_every_language(text: str, language: str) -> None:
    """Each number and name once, and none of the English words."""
    told = word_table(language).text(text)
    assert sorted(re.findall(r"-?\d+\.?\d*", told)) == sorted(re.findall(r"-?\d+\.?\d*", text))
    english = set(re.findall("[a-z]+", "the station left out stands for from leans expected most stated spacing"))
    assert not english & set(re.findall(r"[a-z]+", told)) - ({"station"} if language == "fr" else set())


@in_turn([*OTHERS, "en"])
def test_every_report_is_set_and_alike_twice(said: Callable[[str], Said], language: str) -> None:
    hole = said(language).documents[-1]
    assert report_pdf(hole) == report_pdf(hole)
    assert len(report_pages(hole, 20.0)) == 2
    for content in certificates(language):
        assert len(typeset_png_pages(json.dumps(content), DAY, 20.0)) >= 1


def test_the_tables_have_the_phrases_of_each_other() -> None:
    assert known_languages() == sorted(LANGUAGES)
    tables = [word_table(language) for language in OTHERS]
    known = [{*table._exact, *(pattern.pattern for pattern, _ in table._patterns)} for table in tables]
    assert all(words == known[0] for words in known)
    with pytest.raises(SurveyError, match="--language: expected one of de, en, es, fr, it, got 'xx'"):
        word_table("xx")


def test_the_command_writes_a_report_of_a_hole(tmp_path: Path, record: Path) -> None:
    logo = tmp_path / "logo.svg"
    logo.write_text('<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"><circle cx="4" cy="4" r="3"/></svg>')
    words = ("survey", record, "--report", tmp_path / "K7.pdf", "--report-date", "2026-11-20", "--language", "de")
    done = run(*words, "--document", "D-17", "--contractor", "Bohr AG", "--logo", logo)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "K7.pdf").read_bytes().startswith(b"%PDF-")
    wrong = run(*words, "--logo", record)
    assert (wrong.returncode, "--logo" in wrong.stderr) == (2, True)
    assert run("survey", record, "--report", tmp_path / "K7.txt").returncode == 2
