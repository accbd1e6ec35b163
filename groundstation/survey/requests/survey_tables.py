"""Tables of a survey as .csv texts: stations, and the covariance of every source; every row names its frame."""

from __future__ import annotations

import csv
import io
from typing import Any

from groundstation.entry.quoted_cells import quoted_cell
from groundstation.survey.requests.site_place import site_words
from groundstation.survey.well.analysis import Analysis
from groundstation.survey.well.reference_frames import ReferenceFrame

FRAME = ("north", "depth_reference", "height_datum")  # of every row of a table


def source_table_text(found: Analysis) -> str:
    """Covariance of every source at every station, a .csv file as the industry's workbooks print it."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    axes = ("nn", "ee", "vv", "ne", "nv", "ev")
    writer.writerow(["md_m", "source", *(f"{name}_m2" for name in axes), *FRAME])
    places = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    parts, named = found.uncertainty.by_source(), frame_words(found.frame)
    for k, md in enumerate(found.md.tolist()):
        for name, cov in parts.items():
            writer.writerow([md, quoted_cell(name), *(float(cov[(k, *place)]) for place in places), *named])
    return text.getvalue()


def frame_words(frame: ReferenceFrame) -> list[str]:
    """North, depth reference and height datum, as every row of a table names them; no spreadsheet computes them."""
    return [str(quoted_cell(word)) for word in (frame.answer, frame.depths.answer, frame.height_datum)]


def station_table_text(rows: list[dict[str, Any]], frame: ReferenceFrame, site: dict[str, Any] | None = None) -> str:
    """Station table, a .csv file; every row names its frame, and its site where that is given."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    plain = [key for key in rows[0] if key != "uncertainty"]
    half = ("north_m", "east_m", "tvd_m")
    of_grid = [] if frame.grid is None else ["coordinates_north"]
    of_site = [] if site is None else ["site"]
    writer.writerow([*plain, *(f"uncertainty_{key}" for key in half), *FRAME, *of_grid, *of_site])
    named = frame_words(frame) + ([] if frame.grid is None else [frame.grid.north])
    named += [] if site is None else [site_words(site).removeprefix("site: ")]
    writer.writerows(
        [[*(row[key] for key in plain), *(row["uncertainty"][key] for key in half), *named] for row in rows]
    )
    return text.getvalue()
