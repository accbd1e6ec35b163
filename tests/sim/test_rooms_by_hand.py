"""What a jig, a whirl, sums of frames and the figures of a realtime run are, by closed forms and unequal numbers."""

from __future__ import annotations

import csv
import math
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from sim.errors import RigError
from sim.instruments import mwd_jig
from sim.instruments.mwd_jig import Heating, JigDesign, control_design, draw_tool, make_design, measure_tool
from sim.rig.rig_progress import give_up
from sim.rig.site_files import hole_rows, write_stations, write_wall
from sim.world.disturbance.frame_layout import FINER, SUMS
from sim.world.disturbance.frame_sums import frame_sums, rows_of
from sim.world.disturbance.frame_vibration import Vibration, folded_amplitude
from sim.world.disturbance.one_tube import is_later
from sim.world.disturbance.row import ImuSamples, OneImu
from sim.world.disturbance.whirl import whirl_around
from sim.world.disturbance.window import add_shaking, cut_window, set_felt, shown_of, sum_until
from sim.world.scenario import scenario_of

HALF = math.sqrt(0.5)


@pytest.mark.parametrize(
    ("tilt_deg", "face_deg", "azimuth_deg", "gravity", "field"),
    [  # of the specific force A and B take -down, C takes +down; the field dips by 65 deg, 50 uT
        (0.0, 0.0, 0.0, (0.0, 0.0, 1.0), (21.1309, 0.0, 45.3154)),
        (0.0, 90.0, 0.0, (0.0, 0.0, 1.0), (0.0, -21.1309, 45.3154)),
        (0.0, 0.0, 90.0, (0.0, 0.0, 1.0), (0.0, -21.1309, 45.3154)),
        (90.0, 0.0, 0.0, (1.0, 0.0, 0.0), (-45.3154, 0.0, 21.1309)),
        (90.0, 90.0, 0.0, (0.0, -1.0, 0.0), (0.0, 45.3154, 21.1309)),
        (90.0, 0.0, 90.0, (1.0, 0.0, 0.0), (-45.3154, -21.1309, 0.0)),
        (180.0, 0.0, 0.0, (0.0, 0.0, -1.0), (-21.1309, 0.0, -45.3154)),
        (45.0, 0.0, 0.0, (HALF, 0.0, HALF), ((21.1309 - 45.3154) * HALF, 0.0, (21.1309 + 45.3154) * HALF)),
    ],
)
def test_a_jig_shows_gravity_and_field_in_the_frame_of_its_tool(
    tilt_deg: float, face_deg: float, azimuth_deg: float, gravity: Any, field: Any
) -> None:
    attitude = (np.radians([angle]) for angle in (tilt_deg, face_deg, azimuth_deg))
    g, b = mwd_jig.true_vectors(*attitude)
    assert g[0] == pytest.approx(gravity, abs=1e-12)
    assert b[0] == pytest.approx(field, abs=1e-4)


COURSES: dict[Heating, tuple[int, list[float]]] = {  # faces a tilt; temperatures of reading 0, 1, of tilt 1, the last
    Heating.ROOM: (12, [25.0, 25.0, 25.0, 25.0]),
    Heating.SINGLE_RAMP: (24, [25.0, 25.0 + 55.0 / 167.0, 25.0 + 55.0 * 24.0 / 167.0, 80.0]),
    Heating.SAME_RAMPS: (24, [25.0, 25.0 + 55.0 / 23.0, 25.0, 80.0]),
    Heating.ALTERNATING: (24, [25.0, 25.0 + 55.0 / 23.0, 80.0, 80.0]),
    Heating.SHUFFLED: (24, [25.0, 25.0 + 55.0 / 23.0, 25.0, 80.0]),
    Heating.SOAK: (12, [25.0, 25.0, 25.0, 80.0]),
}


@pytest.mark.parametrize("heating", COURSES)
def test_a_design_goes_through_all_attitudes_while_it_heats(heating: Heating) -> None:
    faces, temperatures = COURSES[heating]
    design, rounds = make_design(heating, 3), 5 if heating is Heating.SOAK else 1
    assert len(design.tilt) == 7 * faces * rounds
    found = [design.temperature[k] for k in (0, 1, faces, -1)]
    assert found == pytest.approx(temperatures)
    once = 7 * faces
    for k in range(7):
        part = slice(k * faces, (k + 1) * faces)
        assert set(np.degrees(design.tilt[part]).round(9)) == {30.0 * k}
        assert set(np.degrees(design.azimuth[part]).round(6)) == {round(360.0 * k / 7.0, 6)}
        wanted = [360.0 * j / faces for j in range(faces)]
        assert sorted(np.degrees(design.tool_face[part])) == pytest.approx(wanted)
        in_order = np.degrees(design.tool_face[part]) == pytest.approx(wanted)
        assert in_order is (heating is not Heating.SHUFFLED)
    if heating is Heating.SOAK:
        assert design.temperature.reshape(5, once).tolist() == [[t] * once for t in (25.0, 38.75, 52.5, 66.25, 80.0)]
        assert design.tilt.reshape(5, once).tolist() == [design.tilt[:once].tolist()] * 5


def test_tools_are_drawn_over_the_whole_range_of_their_figures() -> None:
    """At 25 C: scale +-5 %, bias +-10 mg; their slopes +-180 and +-100 ppm/C; mounts +-2 mrad."""
    scales, biases, slopes, drifts, mounts = [], [], [], [], []
    for seed in range(60):
        tool = draw_tool(seed)
        for triad, volts, unit in ((tool.accelerometers, 3.0, 1.0), (tool.magnetometers, 0.06, 50.0)):
            at = (25.0 - 30.0) ** np.arange(4.0)
            scales += (triad.scale @ at / volts - 1.0).tolist()
            biases += (triad.bias @ at / unit).tolist()
            slopes += (triad.scale[:, 1] / volts).tolist()
            drifts += (triad.bias[:, 1] / unit).tolist()
            mounts += triad.cross.tolist()
            assert np.abs(triad.scale[:, 2] / volts).max() <= 0.1 * 180e-6 / 50.0
            assert np.abs(triad.bias[:, 3] / unit).max() <= 0.1 * 100e-6 / 50.0**2
    for values, bound in ((scales, 0.05), (biases, 0.01), (slopes, 180e-6), (drifts, 100e-6), (mounts, 2e-3)):
        assert 0.97 * bound < max(values) <= bound * (1.0 + 1e-9)
        assert -bound * (1.0 + 1e-9) <= min(values) < -0.97 * bound


def test_readings_scatter_by_noise_and_jig() -> None:
    flat = np.zeros(4000)
    design = JigDesign(flat + 0.5 * math.pi, flat, flat, flat + 30.0)  # C, at which a polynomial is its constant
    tool = draw_tool(1)
    for noise, jig, along, across in ((2e-3, 0.0, 2e-3, 2e-3), (0.0, 1e-3, 0.0, 1e-3)):
        record = measure_tool(tool, design, 5, noise=noise, jig_std=jig)
        volts = record.gravity_volts / tool.accelerometers.scale[:, 0]
        assert volts[:, 0].std() == pytest.approx(along, abs=5e-5, rel=0.1)  # along gravity a small turn shows nothing
        assert volts[:, 2].std() == pytest.approx(across, abs=2e-5, rel=0.1)
        fields = record.field_volts / tool.magnetometers.scale[:, 0]
        assert fields[:, 1].std() == pytest.approx(50.0 * noise if noise else 50.0 * jig, rel=0.2)
    control = control_design()
    assert np.degrees(control.tool_face) == pytest.approx(np.arange(0.0, 360.0, 30.0))
    assert np.degrees(control.tilt) == pytest.approx([45.0] * 12)
    assert control.temperature.tolist() == [25.0] * 12


def test_a_whirling_string_feels_its_cone_and_its_circle_while_it_is_driven() -> None:
    file = scenario_of(
        {
            "rig": {"tubes": 2, "tube_length_m": 2.0},
            "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 0.0}},
            "disturbance": {"whirl": {"lean_deg": 2.0, "force_g": 0.5, "hertz": 4.0}},
        }
    ).file
    t = np.array([0.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 8.0])
    samples = ImuSamples(t, np.ones((4, 3)), np.full((4, 3), 2.0), np.array([1.0, 1.0, 1.0, 0.0]))
    whirl_around(samples, OneImu(file, 1, 1), None)
    lean, around = math.radians(2.0), 8.0 * math.pi
    cone = around * (1.0 - math.cos(lean))
    assert samples.rate - 1.0 == pytest.approx(
        np.array([[-lean * around, 0.0, cone], [0.0, -lean * around, cone], [lean * around, 0.0, cone], [0.0] * 3]),
        abs=1e-12,
    )
    pull = 0.5 * 9.80665
    assert samples.force - 2.0 == pytest.approx(
        np.array([[pull, 0.0, 0.0], [0.0, pull, 0.0], [-pull, 0.0, 0.0], [0.0] * 3]), rel=2e-3, abs=1e-12
    )


def test_one_tube_is_hit_and_only_later() -> None:
    imu: Any = SimpleNamespace(tube=2, file=SimpleNamespace(schedule=SimpleNamespace(begin_s=10.0)))
    t = np.array([14.9, 15.0, 15.1])
    assert is_later(imu, SimpleNamespace(tube=2, after_s=5.0), t).tolist() == [False, False, True]  # type: ignore[arg-type]
    assert not is_later(imu, SimpleNamespace(tube=1, after_s=5.0), t).any()  # type: ignore[arg-type]


def test_sums_of_frames_are_those_of_a_line() -> None:
    """Values a + b k at sample k: frame f of phase r lies at sample (f + r / 4) frame hertz."""
    hertz, frame, n = 100.0, 0.03, 32
    values = np.stack([2.0 + 3.0 * np.arange(n), 5.0 - 7.0 * np.arange(n)], axis=1)
    sums = frame_sums(values, hertz, frame)
    assert len(sums) == rows_of(n, hertz, frame) == FINER * (1 + 10 + 0)
    for row in range(len(sums)):
        f, r = divmod(row, FINER)
        at = [(k + r / FINER) * frame * hertz for k in range(f)]
        assert sums[row] == pytest.approx([sum(2.0 + 3.0 * x for x in at), sum(5.0 - 7.0 * x for x in at)])


@pytest.mark.parametrize(
    ("found", "late", "is_told", "parts"),
    [
        (60, 0.0, True, PARTS + 1), (60, PERIOD / PARTS, True, 1), (60, 0.0, False, 1), (50, 0.0, True, PARTS + 1),
        (49, 0.0, True, 1),
    ],
)  # fmt: skip
def test_a_window_is_cut_into_eighths_where_it_reaches_over_its_cycle(
    found: int, late: float, is_told: bool, parts: int
) -> None:
    frame, borders = PERIOD / 50.0, np.full(PARTS + 2, -1.0)
    assert cut_window(borders, 7, found, late, frame, is_told) == parts
    if parts == 1:
        assert borders[:2].tolist() == [7.0, 7.0 + found]
    else:
        before = found - 50.0  # frames
        assert borders == pytest.approx([7.0, *(7.0 + before + 50.0 * k / PARTS for k in range(PARTS)), 7.0 + found])


def test_what_is_felt_is_the_mean_between_two_sums_turned_into_the_tube() -> None:
    before, after = np.arange(SUMS, dtype=float), np.arange(SUMS, dtype=float) ** 2 + 3.0
    moved, turn, found = after - before, math.radians(30.0), 5
    tube = SimpleNamespace(cos=math.cos(turn), sin=math.sin(turn))
    row = np.zeros(6)
    set_felt.py_func(row, tube, before, after, found)  # type: ignore[attr-defined]
    c, s, mean = math.cos(turn), math.sin(turn), moved / found
    x, y = c * mean[3] + s * mean[4] + mean[6], c * mean[4] - s * mean[3] + mean[7]
    assert row[:3] == pytest.approx(
        [c * mean[0] + s * mean[1], c * mean[1] - s * mean[0], mean[2] + mean[8] + mean[10]]
    )
    assert row[3:] == pytest.approx([x + mean[9] * y, y - mean[9] * x, mean[5]])
    shaken = np.arange(40.0) ** 2
    fifo = SimpleNamespace(shaken=(1, 3, 6))
    row[:] = 0.0
    add_shaking.py_func(row, shaken, fifo, 10, 5, 12, 30)  # type: ignore[attr-defined]
    assert row.tolist() == pytest.approx([0.0] * 3 + [((k + 15) ** 2 - (k + 12) ** 2) / 5.0 for k in (1, 3, 6)])
    row[:] = 0.0
    add_shaking.py_func(row, shaken, fifo, 10, 5, 0, 12)  # type: ignore[attr-defined]
    assert row[3] == pytest.approx((13**2 - 11**2) / 5.0)
    assert shown_of(np.arange(float(SUMS)), np.full(SUMS, 2.0)) == pytest.approx(2.0 * sum(range(SUMS)))


def test_sums_between_frames_and_phases_are_those_of_a_plane() -> None:
    """What is linear in frame and phase is found exactly wherever it is asked for; vibration counts within its span."""
    rows = np.arange(40.0)[:, None]
    sums, moved = rows * np.arange(1.0, 7.0), rows * np.arange(7.0, 11.0)
    torsional = np.where(np.arange(30) < 20, np.arange(30.0), 19.0 + 5.0 * (np.arange(30) - 19.0))
    fifo, kept = SimpleNamespace(share=0.25, row=2, torsional=4), np.zeros(SUMS)
    sum_until.py_func(kept, sums, moved, torsional, fifo, 3.5, 1, 8)  # type: ignore[attr-defined]
    place = 3.5 * FINER + 2 + 0.25
    assert kept[:6] == pytest.approx(place * np.arange(1.0, 7.0))
    assert kept[6:10] == pytest.approx(place * np.arange(7.0, 11.0))
    assert kept[10] == pytest.approx(7.5)
    for frame, within in ((0.5, 1.0), (8.5, 8.0)):
        sum_until.py_func(kept, sums, moved, torsional, fifo, frame, 1, 8)  # type: ignore[attr-defined]
        assert kept[10] == pytest.approx(4.0 + within)


def test_a_site_is_written_as_it_is_stated(tmp_path: Path) -> None:
    holes = [{"name": "P1", "north_m": 1.5, "east_m": -2.5}, {"name": "S2", "north_m": 3.5, "east_m": 4.5}]
    world = scenario_of(
        {
            "rig": {"tubes": 3, "tube_length_m": 2.0},
            "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 0.0}},
            "site": {"name": 'Pit "A" \\ é', "radius_m": 0.7, "thickness_m": 0.9, "holes": holes},
        }
    )
    assert tomllib.loads(write_wall(tmp_path, world).read_text(encoding="utf-8")) == {
        "name": 'Pit "A" \\ é', "radius_m": 0.7, "thickness_m": 0.9, "length_m": 6.0, "heads": "heads.csv",
        "stations": "stations.csv",
    }  # fmt: skip
    assert list(csv.reader((tmp_path / "heads.csv").read_text().splitlines())) == [
        ["column", "north_m", "east_m"], ["P1", "1.5", "-2.5"], ["S2", "3.5", "4.5"],
    ]  # fmt: skip
    cov = [[11.0, 12.0, 13.0], [12.0, 22.0, 23.0], [13.0, 23.0, 33.0]]
    point = {"md_m": 2.0, "inclination_deg": 3.0, "azimuth_deg": 4.0, "covariance_m2": cov, "north_m": 9.0}
    rows = hole_rows("P1", {"trajectory": [point], "stations": []})
    write_stations(tmp_path, rows)
    assert list(csv.reader((tmp_path / "stations.csv").read_text().splitlines())) == [
        ["column", "md_m", "inclination_deg", "azimuth_deg", "cov_nn_m2", "cov_ne_m2", "cov_nd_m2", "cov_ee_m2",
         "cov_ed_m2", "cov_dd_m2"],
        ["P1", "2.0", "3.0", "4.0", "11.0", "12.0", "13.0", "22.0", "23.0", "33.0"],
    ]  # fmt: skip


def test_a_process_is_waited_for_ninety_seconds() -> None:
    give_up("node-1", 89.9)
    with pytest.raises(RigError, match="process node-1 did not attach within 90 s"):
        give_up("node-1", 90.0)


def test_figures_of_a_realtime_run_take_the_worst_and_the_sum() -> None:
    from sim.rig.realtime_run import (
        HeardYaw,
        nees_of_pairs,
        rms_deg,
        timing_row,
        total_figures,
        worst_figures,
        yaw_figures,
    )
    from telemetry.messages import ENCODER

    heard = HeardYaw(3, True, [(0.01, 4e-4), (-0.03, 9e-4)], [(0.02, 1e-4)])
    figures = yaw_figures(heard)
    assert figures["yaw_known"] is True
    assert figures["yaw_rest_deg"] == pytest.approx(math.degrees(math.sqrt((1e-4 + 9e-4) / 2.0)))
    assert figures["yaw_rest_nees"] == pytest.approx((0.25 + 1.0) / 2.0)
    turning = next(key for key in figures if key.endswith("_deg") and "rest" not in key)
    assert figures[turning] == pytest.approx(math.degrees(0.02))
    assert figures[turning.replace("deg", "nees")] == pytest.approx(4.0)
    assert set(yaw_figures(None)) == set(figures)
    assert set(yaw_figures(None).values()) == {None}
    assert (rms_deg([]), nees_of_pairs([])) == (None, None)
    stages = {"start": {"median": 1.0, "p99": 2.0, "max": 3.0}, "cycle": {"median": 4.0, "p99": 5.0, "max": 6.0}}
    report = {"stages_ms": stages, "cycles": 7, "overruns": 8}
    assert timing_row("node-2", 2, 5, report, 9.0) == {
        "process": "node-2", "hop": 4, "cycles": 7, "overruns": 8, "start_median_ms": 1.0, "start_p99_ms": 2.0,
        "start_max_ms": 3.0, "cycle_median_ms": 4.0, "cycle_p99_ms": 5.0, "cycle_max_ms": 6.0, "first_cycle_s": 9.0,
    }  # fmt: skip
    assert timing_row("encoder", ENCODER, 5, report, 9.0)["hop"] == 0
    rows: list[dict[str, Any]] = [
        {"process": "a", "hop": 1, "cycles": 10, "yaw_known": True, "overruns": 2, "late": None, "cpu_percent": 1.5},
        {"process": "b", "hop": 2, "cycles": 12, "yaw_known": False, "overruns": 1, "late": None, "cpu_percent": 2.5},
    ]
    assert worst_figures(rows) == {"cycles": 10, "yaw_known": False, "overruns": 2, "late": None, "cpu_percent": 2.5}
    for row in rows:
        row |= {"private_mb": row["hop"], "pss_mb": 10 * row["hop"]}
    assert total_figures(rows) == {"cycles": 22, "overruns": 3, "cpu_percent": 4.0, "private_mb": 3, "pss_mb": 30}


@pytest.mark.parametrize("is_angle", [False, True])
@pytest.mark.parametrize(
    ("lowest", "highest", "frames_hz"), [(20.0, 300.0, 200.0), (60.0, 90.0, 400.0), (5.0, 480.0, 97.0)]
)
def test_vibration_of_the_frames_has_the_power_of_the_filtered_band(
    lowest: float, highest: float, frames_hz: float, is_angle: bool
) -> None:
    """Folding keeps power: 2/N of all squares is the mean over the band of what the filter and the grid let pass.

    A Butterworth of two poles by the bilinear transform has 1 / (1 + (tan(w/2) / tan(wc/2))^4); linear between two
    samples at any place has (2 + cos w) / 3, the mean of two steps cos^2 (w/2).
    """
    hertz, low_pass, count = 1000.0, 42.0, 1 << 13
    file = scenario_of(
        {
            "rig": {"tubes": 2, "tube_length_m": 2.0},
            "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 0.0}},
            "rough": {
                "samples_hz": hertz,
                "sensor": {"frames_hz": frames_hz, "low_pass_hz": low_pass},
                "vibration": {"turning_g": 0.5, "torsional_dps": 3.0, "lowest_hz": lowest, "highest_hz": highest},
            },
        }
    ).file
    assert file.rough is not None
    shape = folded_amplitude(file.rough, 1.0 / frames_hz, count, is_angle=is_angle)
    w = math.tau * np.linspace(lowest, highest, 200_001) / hertz
    passed = 1.0 / (1.0 + (np.tan(0.5 * w) / math.tan(math.pi * low_pass / hertz)) ** 4) * (2.0 + np.cos(w)) / 3.0
    wanted = float(np.mean(passed * (np.cos(0.5 * w) ** 2 if is_angle else 1.0)))
    assert 2.0 / count * float(np.sum(shape**2)) == pytest.approx(wanted, rel=0.01)
    rates, forces = Vibration(file.rough, 1.0 / frames_hz, count).drawn(np.random.default_rng(3))
    drawn = np.diff(rates if is_angle else forces)
    source = math.radians(3.0) if is_angle else 0.5 * 9.80665
    assert drawn.std() == pytest.approx(source * math.sqrt(wanted), rel=0.08)
