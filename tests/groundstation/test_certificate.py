"""The certificate: what it says, and the same bytes for the same content."""

import json
from datetime import date

from groundstation.report.certificate import Identity, certificate_pdf, template_data, typeset_pdf, typeset_png_pages
from groundstation.report.figure_panels import Panel
from groundstation.report.sheet import Sheet, SheetTable, column_texts, number_text

RECORD, BLOCK = "ab" * 32, "cd" * 32
SHEET = Sheet(
    "Calibration of *nothing* #1",
    (("Method", "[none] $x$ \\ @a"),),
    (SheetTable("Matrix", ("", "x"), [("x", number_text(-0.5, 3))]),),
    ("a warning",),
)
IDENTITY = Identity("Tube 7", date(2024, 5, 31), "record.csv", RECORD, BLOCK, "0.1.0")
PANELS = (Panel("A line", 1.0, lambda part: part.subplots().plot([0.0, 1.0])),)


def test_it_holds_both_hashes_the_day_and_the_software() -> None:
    held = json.loads(template_data(SHEET, PANELS, IDENTITY))
    assert held["record_sha256"] == RECORD
    assert held["block_sha256"] == BLOCK
    assert (held["day"], held["software"], held["subject"]) == ("2024-05-31", "0.1.0", "Tube 7")
    assert held["figures"][0]["svg"].startswith("<?xml")


def test_the_same_content_gives_the_same_bytes_and_another_day_gives_others() -> None:
    first = certificate_pdf(SHEET, PANELS, IDENTITY)
    assert first.startswith(b"%PDF")
    assert first == certificate_pdf(SHEET, PANELS, IDENTITY)
    assert first != typeset_pdf(template_data(SHEET, PANELS, IDENTITY), date(2024, 6, 1))


def test_number_serial_number_and_next_due_day_are_printed() -> None:
    papers = (("Certificate", "K-17"), ("Serial number", "#9 *b*"), ("Next due", "2025-05-31"))
    told = Identity("Tube 7", date(2024, 5, 31), "record.csv", RECORD, BLOCK, "0.1.0", papers)
    assert json.loads(template_data(SHEET, (), told))["papers"] == [list(paper) for paper in papers]
    pages = [typeset_png_pages(template_data(SHEET, (), one), one.day) for one in (told, IDENTITY)]
    assert pages[0] != pages[1]


def test_what_looks_like_markup_is_text_and_a_block_may_be_absent() -> None:
    bare = Identity("#panic()", date(2024, 5, 31), "*.csv", RECORD, None, "0.1.0")
    (page,) = typeset_png_pages(template_data(SHEET, (), bare), bare.day)
    assert page.startswith(b"\x89PNG")


def test_numbers_have_a_true_minus_and_columns_equal_decimals() -> None:
    assert number_text(-0.0001234567, 3) == "\N{MINUS SIGN}0.000123"
    assert column_texts([-6.66e-16, 0.0159, -0.0141]) == ["0.0000", "0.0159", "\N{MINUS SIGN}0.0141"]
    assert column_texts([0.0]) == ["0.000"]
