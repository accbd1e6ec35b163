"""One reader of surveys: whatever the format, a table of stations, and one line of how it was read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from groundstation.errors import SurveyError
from groundstation.survey.files.ags_files import read_ags
from groundstation.survey.files.field_table import FieldTable, TableWish
from groundstation.survey.files.file_bytes import decode_text, read_file
from groundstation.survey.files.las_files import read_las
from groundstation.survey.files.several_tables import choose_table
from groundstation.survey.files.station_tables import Understood, extent_words, understand_table
from groundstation.survey.files.survey_columns import is_survey_header, unknown_unit
from groundstation.survey.files.survey_records import DISPLACEMENTS, DisplacementRule, read_record
from groundstation.survey.files.text_tables import find_table
from groundstation.survey.files.unit_rows import with_unit_row
from groundstation.survey.files.xlsx_files import read_xlsx
from groundstation.survey.files.xml_surveys import read_xml

NO_WISH = TableWish()
OLD_XLS = b"\xd0\xcf\x11\xe0"
READERS: dict[str, Callable[[Path, bytes], list[FieldTable]]] = {
    "las": read_las, "xlsx": read_xlsx, "xml": read_xml, "ags": read_ags,
}  # fmt: skip


def read_any(path: Path, rule: DisplacementRule = DisplacementRule.EXACT, wish: TableWish = NO_WISH) -> Understood:
    """Record of a file, or of standard input where ``path`` is ``-``.

    Parameters
    ----------
    rule : how displacements become angles
    wish : what is said of a table that does not say it

    Raises
    ------
    SurveyError
        Names file and line, what was expected and what came.
    """
    if path.suffix.lower() == ".wbp":
        from groundstation.survey.files.landmark_files import read_wbp

        return understand_table(path, read_wbp(path), wish)
    content = read_file(path)
    form = format_of(path, content)
    if form == "edm":
        from groundstation.survey.files.landmark_files import read_edm

        return understand_table(path, read_edm(path, content), wish)
    if form:
        return understand_table(path, *choose_table(path, READERS[form](path, content), wish))
    table = find_table(path, decode_text(path, content), is_known_header)
    if set(DISPLACEMENTS) <= {cell.strip() for cell in table.header} and table.plain:
        record = read_record(path, rule)
        return Understood(record, f"read as: MD m, displacements, cm; {extent_words(record)}")
    if not is_known_header(table.header) and (column := unknown_unit(table.header)) is not None:
        with_unit_row(path, table, [column])  # says which unit is not known
    if not is_known_header(table.header) and path != Path("-"):
        read_record(path, rule)  # says which columns a table of ours has
    return understand_table(path, _with_frame(table), wish)


def is_known_header(cells: list[str]) -> bool:
    """Whether a header is that of stations or of displacements."""
    return is_survey_header(cells) or set(DISPLACEMENTS) <= {cell.strip() for cell in cells}


def format_of(path: Path, content: bytes) -> str:
    """Format of a file by how it begins; empty of a table of text.

    Raises
    ------
    SurveyError
        Of a workbook that the reader does not know.
    """
    head = content[:2000].lstrip(b"\xef\xbb\xbf \t\r\n")
    if content.startswith(b"PK\x03\x04"):
        return "xlsx"
    if content.startswith(OLD_XLS):
        raise SurveyError(f"{path}: a workbook of before 2007 (.xls); expected .xlsx")
    if head.startswith(b"<") or b"<\x00?\x00" in content[:12]:
        return "edm" if b"<export" in head.lower() else "xml"
    if head.startswith(b"~"):
        return "las"
    if head.startswith(b"#") and b"\n~V" in content[:4000]:
        return "las"
    return "ags" if head.startswith(b'"GROUP"') else ""


def _with_frame(table: FieldTable) -> FieldTable:
    """The table with what columns of its frame say, as our own tables of stations have them."""
    said: dict[str, str] = {}
    for name in ("north", "depth_reference"):
        if name in table.header:
            words = {row[table.header.index(name)] for row in table.rows}
            if len(words) == 1:
                said[name] = words.pop()
    table.said.update(said)
    return table
