"""Rigs of the set-up study: how each is drawn and stated, and what a row of them says, by formulas."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2
from small_hole import HOLE

from borechain.studies.drawn_rigs import KnownSetUp, RigDraw, change_tables, drawn_errors, drawn_rigs, rms_of, tables_of
from borechain.studies.judged_hole import (
    INSIDE_1,
    INSIDE_2,
    INSIDE_3,
)
from borechain.studies.set_up.run import SetUpRun, SketchCase, share_inside, sketch_row, station_row
from borechain.studies.set_up.run import count_steps as set_up_steps
from borechain.studies.set_up.run import verdict_lines as set_up_verdict
from sim.world.path_section import HOLE_KINDS

KNOWN = KnownSetUp(2.0, 0.3, 0.07, 0.11, 0.13, 0.17, 0.019, 0.0023, 2.9e-4, 0.031, 0.0037)
DRAW = RigDraw(KNOWN, 7, "straight" if "straight" in HOLE_KINDS else HOLE_KINDS[0], True, 3.0, 41.0)


def test_what_a_crew_tells_wrongly_is_drawn_in_this_order() -> None:
    from sim.world.random_streams import RandomStream

    draws = np.random.Generator(np.random.Philox(np.random.SeedSequence((7, int(RandomStream.SET_UP)))))
    z = draws.standard_normal(17).tolist()
    assert drawn_errors(KNOWN, 7) == {
        "north_deg": 0.13 * z[0], "collar_north_deg": 0.17 * z[1], "collar_east_deg": 0.17 * z[2],
        "depth_scale": 2.9e-4 * z[3], "depth_offset_m": 0.031 * z[4], "depth_std_m": 0.0037,
        "lengths_off_m": tuple(0.0023 * one for one in z[5:15]),
        "north_check_deg": 0.13 * z[15], "stick_up_check_m": 0.031 * z[16],
    }  # fmt: skip


def test_a_scenario_states_what_it_is_drawn_by() -> None:
    path = {"kind": DRAW.kind, "seed": 7, "inclination_deg": 3.0, "azimuth_deg": 41.0}
    whole = {
        "rough": {"samples_hz": 50.0, "drive": {"stop_spread_deg": 360.0}},
        "rig": {"tubes": 10, "tube_length_m": 2.0},
        "path": {"drawn": path},
        "schedule": {"add_s": 58.0, "stop_s": 26.0, "finish_s": 10.0},
        "rotation": {"turns": 5.0},
        "joints": {"reading_std_deg": 0.11, "mount_std_deg": 0.07, "mount_tilt_std_deg": 0.3},
        "accelerometer": {"bias_std_deg": pytest.approx(math.degrees(2e-3), rel=1e-12)},
        "design": {"inclination_deg": 3.0, "azimuth_deg": 41.0},
        "medium": {"link": "off"},
        "encoder": {"phase": "locked"},
        "disturbance": {"play": {"sigma_deg": 0.019}},
        "told": drawn_errors(KNOWN, 7),
        "setup": {"north_std_deg": 0.13, "collar_std_deg": 0.17, "stick_up_std_m": 0.031},
    }
    assert tables_of(DRAW) == whole
    assert tables_of(replace(DRAW, stops_anywhere=False)) == {k: v for k, v in whole.items() if k != "rough"}


def test_rigs_of_as_many_numbers_from_the_first_on() -> None:
    rigs = drawn_rigs(KNOWN, 9, 5, stops_anywhere=False)
    assert [rig.seed for rig in rigs] == [5, 6, 7, 8, 9, 10, 11, 12, 13]
    assert [rig.kind for rig in rigs] == [HOLE_KINDS[k % len(HOLE_KINDS)] for k in range(5, 14)]
    assert {(rig.known, rig.stops_anywhere, rig.inclination_deg, rig.azimuth_deg) for rig in rigs} == {
        (KNOWN, False, 2.0, -110.0)
    }
    assert [(rig.seed, rig.stops_anywhere) for rig in drawn_rigs(KNOWN, 1)] == [(1, True)]
    tables: dict[str, dict[str, Any]] = {"a": {"x": 1, "y": 2}, "disturbance": {"play": {"sigma_deg": 3}}}
    changed = change_tables(tables, a={"y": 5}, b={"z": 6}, disturbance={"slip": {"tube": 4}})
    assert changed == {
        "a": {"x": 1, "y": 5}, "b": {"z": 6}, "disturbance": {"play": {"sigma_deg": 3}, "slip": {"tube": 4}},
    }  # fmt: skip
    assert tables["a"] == {"x": 1, "y": 2}
    assert rms_of([3.0, -4.0, 5.0]) == pytest.approx(math.sqrt(50.0 / 3.0))
    assert math.isnan(rms_of([]))


def set_up_run(scale: float) -> SetUpRun:
    judged = replace(HOLE, md=HOLE.md * scale, lean_cov=HOLE.lean_cov * scale, error=HOLE.error * scale)
    return SetUpRun(judged, np.array([0.5 * scale, 0.25]))


def test_a_station_of_the_set_up_study_by_its_formulas() -> None:
    first, second = station_row(1, [set_up_run(1.0), set_up_run(2.0)]), station_row(0, [set_up_run(1.0)])
    # squares of the axes 1, 4, 1 and 4, 16, 4; of the direction 1.25 and 0.625; of the ellipsoid 6 and 24
    stated = [math.sqrt(8.5), math.sqrt(17.0)]  # half the traces 17 and 34
    assert first == {
        "case": "station 2", "md_m": 6.0, "north": 50.0, "east": 0.0, "vertical": 50.0, "direction": 100.0,
        "ellipsoid": 50.0, "direction_nees": pytest.approx(0.46875), "ellipsoid_nees": pytest.approx(5.0),
        "stated_deg": pytest.approx(math.degrees(math.sqrt((8.5 + 17.0) / 2.0))),
        "best_deg": pytest.approx(math.degrees(0.25)),
        "ratio": pytest.approx(math.sqrt((stated[0] ** 2 + stated[1] ** 2) / 2.0) / 0.25),
    }  # fmt: skip
    assert (second["case"], second["md_m"], second["vertical"], second["ellipsoid"]) == ("station 1", 2.0, 0.0, 100.0)
    limits = ((1, "3.841"), (2, "5.991"), (3, "7.815"))
    for freedom, limit in limits:
        assert f"{chi2.ppf(0.95, freedom):.3f}" == limit
    assert [share_inside(np.array([1.0, float(limit), 9.0]), float(limit)) for _, limit in limits] == [
        pytest.approx(200.0 / 3.0)
    ] * 3
    assert (INSIDE_1, INSIDE_2, INSIDE_3) == (3.841, 5.991, 7.815)


def test_a_sketch_of_the_set_up_study_by_its_formulas() -> None:
    case = SketchCase("5 mg", 0.05, "same tool face", KNOWN)
    found = sketch_row(case, [set_up_run(1.0), set_up_run(2.0)])
    lean = (4.0 + 36.0 + 0.25 + 16.0) / 4.0
    assert found == {
        "case": "5 mg", "faces": "same tool face", "play_deg": 0.05,
        "toe_mm": pytest.approx(1e3 * math.sqrt((25.0 + 64.0 + 100.0 + 256.0) / 4.0)),
        "toe_stated_mm": pytest.approx(1e3 * math.sqrt(20.5)),
        "direction_deg": pytest.approx(math.degrees(math.sqrt(lean))),
        "direction_stated_deg": pytest.approx(math.degrees(math.sqrt((6.5 + 8.5 + 13.0 + 17.0) / 4.0))),
        "direction_best_deg": pytest.approx(math.degrees(math.sqrt((0.25 + 0.0625 + 1.0 + 0.0625) / 4.0))),
    }  # fmt: skip


def test_the_verdict_over_a_set_up_word_by_word() -> None:
    good = {"north": 93.0, "east": 97.0, "vertical": 95.0, "direction": 94.04, "ellipsoid": 96.0, "ratio": 1.2}
    other = good | {"north": 97.0, "east": 92.99, "vertical": 97.01, "direction": 95.0, "ratio": 1.1}
    assert set_up_verdict({"cases": [good, other]}) == [
        "north: 95 % regions hold the truth in 93.0 to 97.0 % at a station; as they are to",
        "east: 95 % regions hold the truth in 93.0 to 97.0 % at a station; expected 93 to 97",
        "vertical: 95 % regions hold the truth in 95.0 to 97.0 % at a station; expected 93 to 97",
        "direction: 95 % regions hold the truth in 94.0 to 95.0 % at a station; as they are to",
        "ellipsoid: 95 % regions hold the truth in 96.0 to 96.0 % at a station; as they are to",
        "directions: stated at most 1.20 times the best possible; 1.2 holds",
    ]
    assert set_up_verdict({"cases": [good | {"ratio": 1.21}]})[-1].endswith(
        "1.21 times the best possible; 1.2 is missed"
    )
    assert set_up_steps(3, 2, 99) == 3 + 2 * 16
