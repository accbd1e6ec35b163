"""What commands print, whole: every line and every number of answers in which no two numbers are equal."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from printed_output import cells, printed, run_command, wall_result

from borechain import setup_check
from borechain.cli.ground import check_command
from borechain.cli.rig.shown_result import show_calibration, show_column, show_result
from borechain.cli.survey.clearance_command import show_clearance
from borechain.cli.survey.survey import brought_words, show_survey
from borechain.cli.survey.wall_command import chance_text, show_wall

SITE = {
    "gravity_mps2": 9.81234, "latitude_deg": 52.4, "field_nt": None, "convergence_deg": None,
    "sources": {"gravity": "told", "latitude_deg": "default"},
}  # fmt: skip
SITE_LINE = "site: gravity 9.81234 m/s^2 (told); latitude 52.4 deg (default); no magnetic field stated"


def test_a_wall_line_by_line() -> None:
    joints = wall_result()["joints"]
    states = ("surveyed", "open", "missing", "unsurveyed")
    for k, (row, state) in enumerate(zip(joints, states, strict=True)):
        row |= {"depth_m": 5.0 + k, "thinnest_at_m": 4.25 + k, "moved_apart_cm": 1.25 + k, "direction_deg": 90.4 + k}
        row["state"] = state
    joints[1]["moved_apart_cm"], joints[3]["tight_to_m"] = None, 8.0
    extra = [
        {"joint": name, "extra_column": {"north_m": n, "east_m": e, "from_m": f, "to_m": t, "closes": closes}}
        for name, n, e, f, t, closes in (("B-C", 1.234, 5.678, 2.5, 7.5, True), ("C-D", -1.0, -5.0, 2.0, 3.0, False))
    ]
    day = {"day": "2026-05-03", "closed_percent": 12.34, "open_joints": 7}
    result = wall_result(
        joints=joints, stations_north="true", margin={"shift_cm": 12.34, "deviation_deg": 0.4567}, extra_columns=extra,
        findings=[{"kind": "head", "text": "A touches B"}],
        warnings=[{"kind": "head", "text": "A touches B"}, {"kind": "toe", "text": "C is short"}],
        closing=[day | {"largest_spacing": {"spacing_m": 0.8765, "joint": "D-E"}}],
    )  # fmt: skip
    lines = printed(show_wall, result)
    assert [line for line in lines if "─" not in line and "━" not in line and "│" not in line and "┃" not in line] == [
        "W: not tight (grid north, depth from heads, stations read from true north)",
        "to be tight from the upper head to the lower toe of each joint",
        "WARNING (toe): C is short",
        "  head: A touches B",
        *(line for line in lines if line.strip() == "the 4 most doubtful of 4 joints"),
        "one column alone may be 12.3 cm off at its toe, 0.457 deg",
        "required 0.25 m: 2 of 4 joints are thinner or open, 3 are so with a probability of more than 0.01; "
        "2 columns beyond their tolerance",
        "2026-05-03: 12.3 % closed, 7 joints open, widest 0.876 m (D-E)",
        "anything open or too thin: probability 0.5",
        "worst joint C-D at 5 m",
        "a column at north 1.23 m, east 5.68 m from 2.5 to 7.5 m closes B-C",
        "a column at north -1.00 m, east -5.00 m from 2 to 3 m does not close C-D",
    ]
    assert [cells(line) for line in lines if "│" in line] == [
        ["C-D", "missing", "7.00", "-", "6.25", "0.3", "3.2", "92"],
        ["B-C", "open", "6.00", "0.200", "5.25", "0.3", "-", "91"],
        ["D-E", "unsurveyed", "8.00", "0.100", "7.25", "0.02", "4.2", "93"],
        ["A-B", "surveyed", "5.00", "0.300", "4.25", "0.0001", "1.2", "90"],
    ]
    alike = printed(show_wall, wall_result(columns=[{"used_percent": used} for used in (99.9, 100.0, 100.1)]))
    assert "to be tight from 0 to 9 m" in alike
    assert any(line.endswith("; 2 columns beyond their tolerance") for line in alike)


def survey_result(**change: Any) -> dict[str, Any]:
    stations = [
        {"station": k, "md_m": 1.5 * k, "inclination_deg": 2.5 * k, "azimuth_deg": 3.5 * k, "north_m": 4.5 * k,
         "east_m": 5.5 * k, "tvd_m": 6.5 * k, "dogleg_severity_deg_per_30m": 7.5 * k,
         "uncertainty": {"north_m": 0.085 * k, "east_m": 0.095 * k, "tvd_m": 0.105 * k}}
        for k in (0, 1)
    ]  # fmt: skip
    whole = {
        "read_as": "stations of x.csv", "warnings": [{"kind": "dip", "text": "odd"}], "site": SITE,
        "method": "tangential",
        "instrument": "relay", "north": "grid", "depth_reference": "collar", "height_datum": "NN", "sigma": 2.0,
        "read_from": {"depth_reference": "rotary", "height_m": 4.25}, "file": "x.csv", "stations": stations,
        "at": [{"md_m": 1.25, "north_m": 0.1, "east_m": 0.2, "tvd_m": 0.3}], "closure_m": 7.12345,
        "closure_azimuth_deg": 8.125,
        "sources": [{"source": "N", "north_m": 0.01, "east_m": 0.02, "tvd_m": 0.03}],
    }  # fmt: skip
    return whole | change


def test_a_survey_line_by_line() -> None:
    lines = printed(show_survey, survey_result())
    assert lines[:3] == ["stations of x.csv", "WARNING (dip): odd", SITE_LINE]
    frame = "grid north, depth from collar (read from rotary, 4.25 m above it), height above NN"
    title = f"x.csv: tangential, relay, {frame}, 2 sigma"
    assert title in " ".join(line.strip() for line in lines)
    assert [cells(line) for line in lines if "│" in line] == [
        ["0", "0.00", "0.00", "0.00", "0.0000", "0.0000", "0.0000", "0.00", "0.000", "0.000", "0.000"],
        ["1", "1.50", "2.50", "3.50", "4.5000", "5.5000", "6.5000", "7.50", "8.500", "9.500", "10.500"],
        ["N", "1.0000", "2.0000", "3.0000"],
    ]
    assert "at 1.25 m: 0.1000 0.2000 0.3000 m" in lines
    assert "closure 7.1235 m towards 8.12 deg" in lines
    same = {"depth_reference": "collar", "height_m": 4.25}
    assert brought_words(survey_result(read_from=same)) == ""


def test_a_clearance_line_by_line() -> None:
    row = {
        "md_m": 1.5, "offset_md_m": 2.5, "distance_m": 3.5, "sigma_m": 4.5, "factor": 5.5, "independent_factor": 6.5,
    }  # fmt: skip
    nearest = {key: value + 0.25 for key, value in row.items()}
    result = {"stations": [row], "warnings": [], "site": SITE, "clear": True, "least": row, "nearest": nearest}
    lines = printed(show_clearance, result, "a from b")
    assert [cells(line) for line in lines if "│" in line] == [["1.500", "2.500", "3.500", "4.500", "5.500", "6.500"]]
    assert lines[-3:] == [
        SITE_LINE,
        "clear: least factor 5.50, 3.50 m apart at 1.50 m, 2.50 m of the other hole",
        "nearest: 3.75 m apart at 1.75 m, 2.75 m of the other hole",
    ]


def column_result() -> dict[str, Any]:
    def off(cm: float) -> dict[str, float]:
        return {
            "deviation_cm": cm, "sigma_cm": cm + 0.25, "direction_deg": cm + 1.0, "md_m": cm + 2.0,
            "used_percent": cm + 3.0,
        }  # fmt: skip

    column = {
        "worst": off(1.5),
        "projection": off(7.5),
        "ahead": {"within_percent": 87.6, "half_width_cm": 3.25},
    }
    return {"column": column, "alarms": [{"kind": "deviation", "level_percent": 50, "md_m": 9.25}]}


def test_where_a_column_is_line_by_line() -> None:
    assert printed(show_column, column_result()) == [
        "column worst           1.5 ± 1.75 cm towards 2 deg at 3.5 m, 4 % of the tolerance",
        "column projection      7.5 ± 7.75 cm towards 8 deg at 9.5 m, 10 % of the tolerance",
        "column ends            ± 3.2 cm (95 %), within its limit with 88 %",
        "alarm  deviation       50 % of the tolerance at 9.2 m",
    ]
    nothing = {"column": {"worst": None, "projection": None, "ahead": None}, "alarms": []}
    assert printed(show_column, nothing) == []


def test_a_calibration_in_the_field_names_the_block_of_before_and_the_one_after() -> None:
    tube = {
        "tube": 3, "hash_before": "0123456789", "hash": "abcdefghij", "version": 7, "restarted": True,
        "hash_after_restart": "klmnopqrst",
    }  # fmt: skip
    errors = {"before": 0.12345, "after": None}
    told = {"inclination_rms_deg": errors, "tubes": [tube, tube | {"tube": 12, "restarted": False}]}
    assert printed(show_calibration, told) == [
        "calibration, inclination_rms_deg: before 0.1235, after -",
        "tube 3   block 01234567 -> abcdefgh version 7, after its power cut klmnopqr",
        "tube 12  block 01234567 -> abcdefgh version 7",
    ]


def test_a_run_ends_with_its_figures_alarms_counts_and_files() -> None:
    result = column_result() | {
        "stations": [], "figures": {"azimuth_rms_deg": 0.12345, "nees_by_hop": [1.0, None, 2.5]},
        "rig_alarms": [{"code": "queue", "subject": "tube 3", "detail": "2 dropped"}], "processes": 5,
        "measurements": 17, "rig_s": 123.4, "wall_s": 5.67, "digest": "d1",
        "calibration": {"inclination_rms_deg": {}, "tubes": []},
    }  # fmt: skip
    lines = printed(show_result, result, Path("out/run-1"))
    assert [line.rstrip() for line in lines[lines.index("azimuth_rms_deg        0.1235") :]] == [
        "azimuth_rms_deg        0.1235",
        "nees_by_hop            1.0000 - 2.5000",
        *printed(show_column, result),
        "alarm  queue           tube 3: 2 dropped",
        "calibration, inclination_rms_deg:",
        "0 stations, 17 measurements, 5 processes, 123 s of rig time in 5.7 s",
        "digest d1",
        "files  out/run-1",
    ]
    assert any("0 measurements" not in line and "one process" in line for line in
               printed(show_result, result | {"processes": 1}, Path("f")))  # fmt: skip


def setup_row(item: str, **more: Any) -> dict[str, Any]:
    usual = {
        "item": item, "kind": item, "told": False, "missing": False, "toe_cm": 1.0, "unit": "deg", "way": "across",
        "sigma": 0.5, "detail": "by design", "check": "",
    }  # fmt: skip
    return usual | more


def test_a_check_names_what_is_missing_unchecked_wrong_and_assumed() -> None:
    items = [
        setup_row("north", check="not checked: a second bearing is"),
        setup_row("joint.4-3", missing=True, toe_cm=50.0),
        setup_row("mount.1", kind="mount", toe_cm=3.0, unit="1"),
        setup_row("mount.2", kind="mount", toe_cm=4.0, unit="1"),
        setup_row("length.2", kind="length", toe_cm=2.34, unit="m", way="along", sigma=0.0012345),
        setup_row("stick_up", told=True, toe_cm=9.0),
        setup_row("gravity", toe_cm=0.049),
    ]
    found = setup_check.SetupCheck(False, ["joint.4-3"], ["north"], ["depth stands"], "tell joint", "nothing", items)
    assert check_command.check_text(found).split("\n") == [
        "NOT READY TO DRILL",
        "missing  joint.4-3",
        "check    north, not checked: a second bearing is",
        "wrong    depth stands",
        "assumed  north ± 0.5 deg, by design: 1.0 cm at the toe",
        "assumed  mount of 2 tubes ± 0.5, by design: 5.0 cm at the toe",
        "assumed  length.2 ± 0.0012345 m, by design: 2.3 cm at the toe along the hole",
        "next     tell joint",
        "no sigma nothing",
    ]


@pytest.mark.parametrize(("is_ready", "status"), [(True, 0), (False, 1)])
@pytest.mark.parametrize("form", [[], ["--json"]])
def test_the_status_of_a_check_says_whether_a_rig_is_ready(
    monkeypatch: pytest.MonkeyPatch, is_ready: bool, status: int, form: list[str]
) -> None:
    found = setup_check.SetupCheck(is_ready, [], [], [], "", "", [])
    monkeypatch.setattr(setup_check, "check_scenario", lambda file, seed: found)
    assert run_command(check_command.check, "wellbore-1", *form).exit_code == status


# files that land


# options, and what is reckoned of many


@pytest.mark.parametrize(
    ("probability", "text"),
    [(1.0, "1"), (0.0234, "0.023"), (1e-9, "1e-09"), (0.9999e-9, "<1e-09"), (0.0, "<1e-09")],
)
def test_a_chance_far_below_what_walls_allow_is_told_as_that(probability: float, text: str) -> None:
    assert chance_text(probability) == text
