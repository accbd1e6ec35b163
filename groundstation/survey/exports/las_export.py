"""LAS 2.0: stations, position and its standard deviations as curves of one hole."""

from __future__ import annotations

import numpy as np

from groundstation.errors import SurveyError
from groundstation.survey.exports.export_hole import ExportSite

NULL = -999.25


def las_bytes(site: ExportSite) -> bytes:
    """Log of a hole.

    Raises
    ------
    SurveyError
        When there are several: a log has one.
    """
    if len(site.holes) != 1:
        raise SurveyError(f"las: expected one hole, got {len(site.holes)}; name it by --hole")
    (hole,) = site.holes
    stds = None if hole.covs is None else np.sqrt(np.maximum(np.diagonal(hole.covs, axis1=1, axis2=2), 0.0))
    curves = [
        ("DEPT", "M", "measured depth", hole.md), ("INCL", "DEG", "inclination", hole.inclination_deg),
        ("AZIM", "DEG", f"azimuth from {hole.north} north", hole.azimuth_deg), ("TVD", "M", "depth", hole.local[:, 2]),
        ("NORTH", "M", "north of the collar", hole.local[:, 0]), ("EAST", "M", "east of the collar", hole.local[:, 1]),
    ]  # fmt: skip
    for k, name in enumerate(("NORTH", "EAST", "TVD") if stds is not None else ()):
        assert stds is not None
        curves.append((f"S{name}", "M", f"one standard deviation, {name.lower()}", stds[:, k]))
    step = float(hole.md[1] - hole.md[0]) if len(hole.md) > 1 else 0.0
    even = len(hole.md) > 1 and bool(np.allclose(np.diff(hole.md), step, rtol=1e-9))
    head = [
        "~Version", "VERS. 2.0 : CWLS log ASCII standard", "WRAP. NO : one line a depth", "~Well",
        f"STRT.M {hole.md[0]:.6f} : first depth", f"STOP.M {hole.md[-1]:.6f} : last depth",
        f"STEP.M {step if even else 0.0:.6f} : step", f"NULL. {NULL} : no value",
        f"COMP. {_plain(site.client)} : company", f"WELL. {_plain(hole.name)} : hole",
        f"FLD. {_plain(site.project)} : project",
        f"DATE. {site.day} : date", "~Curve", *(f"{name}.{unit} : {words}" for name, unit, words, _ in curves),
        "~Other", *site.remarks, "~ASCII",
    ]  # fmt: skip
    columns = np.column_stack([values for *_, values in curves])
    lines = [" ".join(f"{value:.9f}" for value in row) for row in columns.tolist()]
    return ("\n".join([*head, *lines]) + "\n").encode()


def _plain(text: str) -> str:
    """Text of a header line, which ends at a colon."""
    return text.replace(":", " ")
