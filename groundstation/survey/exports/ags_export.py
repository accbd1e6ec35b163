"""AGS 4.1.1: locations and, of every hole, its orientation and inclination, which the format has in whole degrees.

Source: Association of Geotechnical and Geoenvironmental Specialists, AGS 4.1.1.
"""

from __future__ import annotations

import unicodedata

from groundstation.entry.quoted_cells import quoted_cell
from groundstation.survey.exports.export_hole import ExportHole, ExportSite

Rows = list[tuple[str, ...]]
ROUNDED = "HORN_ORNT and HORN_INCL are rounded to whole degrees, as the format has them"
TYPES = (
    ("ID", "Unique identifier"), ("PA", "Abbreviation"), ("X", "Text"), ("6DP", "Six decimal places"),
    ("0DP", "No decimal place"), ("DT", "Date"),
)  # fmt: skip
UNITS = (("m", "metre"), ("deg", "degree"), ("yyyy-mm-dd", "year month day"))


def ags_bytes(site: ExportSite) -> bytes:
    """All groups: PROJ, TRAN, TYPE, UNIT, ABBR, LOCA, HORN."""
    locations = [_location(hole, site.crs) for hole in site.holes]
    horn = [row for hole in site.holes for row in _intervals(hole)]
    groups = [
        _group("PROJ", ("PROJ_ID", "PROJ_NAME", "PROJ_CLNT", "PROJ_MEMO"), ("",) * 4, ("ID", "X", "X", "X"),
               [(_text(site.name), _text(site.project or site.name), _text(site.client), ROUNDED)]),
        _group("TRAN", ("TRAN_ISNO", "TRAN_DATE", "TRAN_PROD", "TRAN_STAT", "TRAN_DESC", "TRAN_AGS", "TRAN_RECV",
                        "TRAN_DLIM", "TRAN_RCON", "TRAN_REM"), ("", "yyyy-mm-dd", *("",) * 8),
               ("X", "DT", *("X",) * 8),
               [("1", site.day, "borechain", "Final", "As built", "4.1.1", "-", "|", "+", ROUNDED)]),
        _group("UNIT", ("UNIT_UNIT", "UNIT_DESC"), ("", ""), ("X", "X"), list(UNITS)),
        _group("TYPE", ("TYPE_TYPE", "TYPE_DESC"), ("", ""), ("X", "X"),
               list(TYPES)),
        _group("ABBR", ("ABBR_HDNG", "ABBR_CODE", "ABBR_DESC"), ("",) * 3, ("X", "X", "X"),
               [("LOCA_TYPE", "RC", "Rotary cored")]),
        _group("LOCA", ("LOCA_ID", "LOCA_TYPE", "LOCA_NATE", "LOCA_NATN", "LOCA_GREF", "LOCA_GL", "LOCA_REM",
                        "LOCA_FDEP"),
               ("", "", "m", "m", "", "m", "", "m"), ("ID", "PA", "6DP", "6DP", "X", "6DP", "X", "6DP"), locations),
        _group("HORN", ("LOCA_ID", "HORN_TOP", "HORN_BASE", "HORN_ORNT", "HORN_INCL", "HORN_REM"),
               ("", "m", "m", "deg", "deg", ""), ("ID", "6DP", "6DP", "0DP", "0DP", "X"), horn),
    ]  # fmt: skip
    return "\r\n".join(groups).encode("utf-8")


def _location(hole: ExportHole, crs: str) -> tuple[str, ...]:
    east, north, height = hole.axis[0].tolist()
    words = hole.verdict and f"verdict: {hole.verdict}"
    return (
        _text(hole.name), "RC", f"{east:.6f}", f"{north:.6f}", crs or "LOCAL", f"{height:.6f}", words,
        f"{hole.md[-1]:.6f}",
    )  # fmt: skip


def _intervals(hole: ExportHole) -> Rows:
    """Direction from each station to the next; the last station has none below."""
    rows: Rows = []
    for k in range(len(hole.md) - 1):
        azimuth = round(float(hole.azimuth_deg[k])) % 360
        dip = 90 - round(float(hole.inclination_deg[k]))
        top, base = f"{hole.md[k]:.6f}", f"{hole.md[k + 1]:.6f}"
        rows.append((_text(hole.name), top, base, str(azimuth), str(dip), ROUNDED))
    return rows


def _group(name: str, heading: tuple[str, ...], units: tuple[str, ...], types: tuple[str, ...], data: Rows) -> str:
    rows = [
        ("GROUP", name),
        ("HEADING", *heading),
        ("UNIT", *units),
        ("TYPE", *types),
        *(("DATA", *row) for row in data),
    ]
    return "".join(",".join(f'"{cell}"' for cell in row) + "\r\n" for row in rows)


def _text(text: str) -> str:
    """What a user wrote; a spreadsheet, which opens such a file as a table, computes none of it.

    The format has 256 letters (its rule 1); any other stands as its number, so that two names stay two.
    """
    plain = unicodedata.normalize("NFC", text).encode("latin-1", "backslashreplace").decode("latin-1")
    return str(quoted_cell(plain)).replace('"', '""')
