"""The calibration commands as their user meets them: published records, files, refusals."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from forked_commands import run

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
DATA, BENCH = ROOT / "tests" / "data" / "calibration", ROOT / "scenarios" / "instruments"
NODE_A1, VN100_GYRO = DATA / "calibration_node_a1_gyro.csv", DATA / "calibration_vn100_gyro.csv"
VN100_ACCEL = DATA / "calibration_vn100_accel.csv"
OVEN, ROOM, CONTROL = (BENCH / f"mwd-{name}.csv" for name in ("oven", "room", "control"))
TRUTH = json.loads((BENCH / "truth.json").read_text())
RATE = 65.0


def answer(*words: object) -> dict:
    done = run(*words, "--json")
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("\n") == 1
    return json.loads(done.stdout)


def refused(*words: object) -> str:
    done = run(*words)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert done.stderr.count("\n") == 1
    return done.stderr


@pytest.fixture(scope="module")
def tool(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, dict, dict]:
    """Files and answers of both triads of the synthetic tool, from the heated record."""
    folder = tmp_path_factory.mktemp("tool")
    gravity, field = folder / "accelerometers.json", folder / "magnetometers.json"
    first = answer("calibrate", "mwd", OVEN, "--parameters", 30, "--out", gravity, "--tool-face")
    site = ("--field-ut", TRUTH["field_ut"], "--dip-deg", TRUTH["dip_deg"])
    second = answer(
        "calibrate", "magnetometer", OVEN, "--parameters", 30, *site, "--accelerometers", gravity, "--out", field
    )
    return gravity, field, first, second


@pytest.fixture(scope="module")
def static(tmp_path_factory: pytest.TempPathFactory) -> np.ndarray:
    folder = tmp_path_factory.mktemp("static")
    assert run("experiment", "records", "--out", folder).returncode == 0
    for name in (OVEN.name, ROOM.name, CONTROL.name, "truth.json"):
        assert (folder / name).read_text() == (BENCH / name).read_text()  # the committed example is what it says
    return np.load(folder / "static.npy")


def test_node_a1_comes_out_to_every_printed_digit() -> None:
    found = answer("calibrate", "turntable", NODE_A1, "--reference", 720)
    matrix = [
        [0.9945843, -0.017076546, -0.003499657],
        [0.014795547, 0.996093741, -0.004001168],
        [-0.001135443, -0.007539215, 0.996815294],
    ]
    assert np.abs(np.array(found["matrix"]) - matrix).max() < 1e-9
    assert np.abs(np.array(found["bias"]) - [0.167255742, 3.803049838, 1.007222273]).max() < 1e-8
    assert found["unit"] == "deg/s"
    assert found["residual_rms"] == pytest.approx(0.08685, abs=1e-5)
    assert np.shape(found["standard_errors"]["matrix"]) == (3, 3)


def test_the_drill_head_s_gyroscope_comes_out_to_three_decimals() -> None:
    found = answer("calibrate", "turntable", VN100_GYRO, "--reference", 200)
    matrix = [[-0.929, -0.360, -0.013], [0.371, -0.932, 0.004], [0.001, -0.001, 0.998]]
    assert np.abs(np.array(found["matrix"]) - matrix).max() < 1.01e-3
    assert np.abs(np.array(found["bias"]) - [-0.046, -0.190, -0.008]).max() < 1.01e-3


def test_the_drill_head_s_accelerometer_is_exact_and_warns_of_its_lever() -> None:
    found = answer("calibrate", "attitudes", VN100_ACCEL)
    matrix = [[-3.69569, 9.05279, 0.83102], [-9.05855, -3.69281, -0.86393], [-0.01440, 0.29226, 9.86523]]
    assert np.abs(np.array(found["matrix"]) - matrix).max() < 1e-5
    assert np.abs(np.array(found["bias"]) - [-1.07602, 0.97293, 0.41077]).max() < 1e-5
    assert found["rank"] == 4
    assert found["attitudes"][0]["lever"] == pytest.approx(66, abs=0.5)
    assert "moves a parameter by up to 66" in run("calibrate", "attitudes", VN100_ACCEL).stdout


def test_a_free_yaw_is_found_beside_the_print_and_beside_an_earlier_file(tmp_path: Path) -> None:
    found = answer("calibrate", "attitudes", VN100_ACCEL, "--free-yaw", DATA / "vn100_printed.toml")
    assert found["yaw_deg"] == pytest.approx(0.8, abs=0.05)
    beside = found["reference_difference"]
    assert max(abs(beside[0][0]), abs(beside[1][0]), abs(beside[1][1])) < 0.005
    assert beside[0][1] is None
    out = tmp_path / "earlier.json"
    answer("calibrate", "attitudes", VN100_ACCEL, "--out", out)
    assert answer("calibrate", "attitudes", VN100_ACCEL, "--free-yaw", out)["yaw_deg"] == pytest.approx(0.0, abs=1e-9)


def test_the_file_of_a_calibration_is_the_block_of_its_hash_in_si(tmp_path: Path) -> None:
    from groundstation.calibration.block import read_calibration

    out = tmp_path / "gyro.json"
    found = answer("calibrate", "turntable", NODE_A1, "--reference", 720, "--out", out, "--date", "2024-05-31")
    block = read_calibration(out)
    assert block.sha256() == found["block_sha256"]
    assert block.sensor == "gyroscope"
    assert block.provenance.day == "2024-05-31"
    assert np.allclose(np.degrees(block.bias), found["bias"], rtol=1e-12)


def test_the_coefficients_of_the_tool_come_back(tool: tuple[Path, Path, dict, dict]) -> None:
    for found, name in ((tool[2], "accelerometers"), (tool[3], "magnetometers")):
        assert len(found["coefficients"]) == 30
        assert found["iterations"] <= 8
        for key, value in found["coefficients"].items():
            assert abs(value - TRUTH[name][key]) < 5.0 * found["standard_errors"][key], key
    assert max(tool[2]["standard_errors"][f"SF_{axis}0"] for axis in "ABC") < 6e-4
    assert max(tool[2]["standard_errors"][f"B_{axis}0"] for axis in "ABC") < 1e-4
    assert tool[2]["before"]["size_max_g"] > 0.03
    assert tool[2]["after"]["size_max_g"] < 6e-4
    assert tool[2]["after"]["tilt_rms_deg"] < 0.03
    assert tool[3]["after"]["size_max_ut"] < 50.0 * 6e-4


def test_twelve_parameters_take_the_cold_record_and_warn_of_the_heated() -> None:
    found = answer("calibrate", "mwd", ROOM, "--parameters", 12)
    assert len(found["coefficients"]) == 12
    assert found["coefficients"]["m_AB"] == found["coefficients"]["m_BA"]
    assert found["warnings"] == []
    assert "30 coefficients" in refused("calibrate", "mwd", ROOM, "--parameters", 30)


def test_the_control_fails_before_and_passes_after(tool: tuple[Path, Path, dict, dict]) -> None:
    before = answer("calibrate", "qc", CONTROL)
    after = answer("calibrate", "qc", CONTROL, "--accelerometers", tool[0], "--magnetometers", tool[1])
    assert not before["passed"]
    assert after["passed"]
    assert [v["limit"] for v in after["verdicts"]] == pytest.approx([0.1, 1.0, 0.003])
    assert tool[2]["block_sha256"] in after["accelerometers"]


def test_allan_finds_the_noise_of_the_synthetic_gyroscope(static: np.ndarray, tmp_path: Path) -> None:
    np.save(tmp_path / "static.npy", static)
    found = answer("allan", tmp_path / "static.npy", "--rate", RATE)
    for k, axis in enumerate("xyz"):
        low, high = found["axes"][axis]["confidence"]["random_walk"]
        assert low < found["axes"][axis]["random_walk"] < high
        assert found["axes"][axis]["random_walk"] == pytest.approx((8.9e-3, 6.9e-3, 7.38e-3)[k], rel=0.02)
        assert found["axes"][axis]["bias_instability"] == pytest.approx((7.9e-3, 3.83e-3, 3.33e-3)[k], rel=0.12)
    rows = "\n".join(",".join(map(str, row)) for row in static.tolist())
    (tmp_path / "static.csv").write_text(f"x,y,z\n{rows}\n")
    again = answer("allan", tmp_path / "static.csv", "--rate", RATE)
    assert again["axes"]["z"]["random_walk"] == pytest.approx(found["axes"]["z"]["random_walk"], rel=1e-9)


@pytest.mark.parametrize(
    ("words", "heading"),
    [
        (("turntable", NODE_A1, "--reference", 720), "Calibration of gyroscope"),
        (("attitudes", VN100_ACCEL), "Calibration of accelerometer"),
        (("mwd", OVEN, "--parameters", 30), "Calibration of MWD accelerometers"),
        (("qc", CONTROL), "MWD quality control"),
    ],
)
def test_people_get_tables_a_plot_and_a_certificate_that_comes_out_the_same_twice(
    words: tuple, heading: str, tmp_path: Path
) -> None:
    made = []
    for k in range(2):
        files = [tmp_path / f"{k}.{suffix}" for suffix in ("json", "svg", "pdf")]
        options = zip(("--out", "--plot", "--certificate"), files, strict=True)
        done = run("calibrate", *words, *(w for pair in options for w in pair), "--date", "2024-05-31")
        assert done.returncode == 0, done.stderr
        assert done.stdout.startswith(heading)
        assert "\N{BOX DRAWINGS HEAVY VERTICAL}" in done.stdout
        made.append([file.read_bytes() for file in files])
    assert made[0] == made[1]
    assert made[0][1].startswith(b"<?xml")
    assert b"<dc:date>" not in made[0][1]
    assert made[0][2].startswith(b"%PDF")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["0.json", "0.pdf", "0.svg", "1.json", "1.pdf", "1.svg"]


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_plots_come_in_three_formats_and_no_other(suffix: str, tmp_path: Path) -> None:
    answer("calibrate", "turntable", NODE_A1, "--reference", 720, "--plot", tmp_path / f"a.{suffix}")
    assert (tmp_path / f"a.{suffix}").stat().st_size > 5000
    assert ".svg, .png, .pdf" in refused(
        "calibrate", "turntable", NODE_A1, "--reference", 720, "--plot", tmp_path / "a.gif"
    )


def changed(text: str, line: int, new: str) -> str:
    lines = text.splitlines()
    lines[line - 1] = new
    return "\n".join(lines) + "\n"


def scaled(text: str, columns: slice, factor: float) -> str:
    rows = []
    for line in text.splitlines():
        cells = line.split(",")
        if re.match(r"[-\d]|home", line):
            cells[columns] = [f"{float(cell) * factor:.9g}" for cell in cells[columns]]
        rows.append(",".join(cells))
    return "\n".join(rows) + "\n"


TABLE, ARM, JIG = NODE_A1.read_text(), VN100_ACCEL.read_text(), OVEN.read_text()
JIG_LINE = JIG.splitlines()[49]
TURN = ("turntable", "--reference", "720")
MWD = ("mwd", "--parameters", "30")


@pytest.mark.parametrize(
    ("words", "text", "reason"),
    [
        (
            TURN,
            changed(TABLE, 4, "y,nan,12.5,720.9,-713.3,-4.5,6.2"),
            r"line 4: expected a finite number in column x_pos",
        ),
        (TURN, changed(TABLE, 4, "y,-12,12.5,720.9,-713.3,-4.5"), r"line 4: expected 7 values, got 6"),
        (TURN, changed(TABLE, 5, ""), r"line 4: expected a row for turned axis z"),
        (
            TURN,
            TABLE.replace("\nx,", "\n,"),
            r"line 3: expected one row for each",
        ),
        ((*TURN[:2], "12.566"), TABLE, r"line 3: .*in deg where rad belongs"),
        ((*TURN, "--full-scale", "700"), TABLE, r"line 3: .*saturated"),
        (TURN, "", r"line 1: expected a record, got an empty file"),
        (("attitudes",), scaled(ARM, slice(3, 6), 1 / 9.80665), r"line 4: .*in g where m/s\^2 belongs"),
        (("attitudes",), scaled(ARM, slice(1, 3), math.pi / 180), r"in rad where deg belongs"),
        (
            ("attitudes",),
            changed(ARM, 4, "home,10,0,-0.883,-1.466,10.123"),
            r"rank 4, got 3 of 4: add the attitude home",
        ),
        (("attitudes",), "\n".join(ARM.splitlines()[:6]) + "\n", r"line 6: expected at least 4 attitudes, got 3"),
        (
            MWD,
            changed(JIG, 50, JIG_LINE.replace(",", ",nan,", 1).rsplit(",", 1)[0]),
            r"line 50: .*column tool_face_deg",
        ),
        (MWD, scaled(JIG, slice(0, 2), math.pi / 180), r"in rad where deg belongs"),
        (MWD, scaled(JIG, slice(3, 9), 1e3), r"line 3: reading 1: voltages do not add up"),
        (MWD, changed(JIG, 50, JIG_LINE.replace("30.000", "31.000", 1)), r"line 50: reading 48: its angle is off"),
        (
            MWD,
            changed(JIG, 2, "tilt_deg,temperature_c,a_v,b_v,c_v"),
            r"line 2: expected the header tilt_deg,tool_face_deg",
        ),
        (MWD, "\n".join(JIG.splitlines()[:9]) + "\n", r"expected at least 15 readings"),
        (MWD, "\n".join(JIG.splitlines()[:26]) + "\n", r"cannot tell its 30 coefficients apart"),
        (MWD, changed(JIG, 3, JIG.splitlines()[2].replace("25.000", "298.15", 1)), r"line 3: .*kelvin\?"),
        ((*MWD, "--full-scale", "2.9"), JIG, r"saturated"),
        (("magnetometer", "--parameters", "30"), JIG, r"expected --field-ut and --dip-deg, or the columns"),
        (("qc",), JIG, r"expected 12 readings, got 168"),
        (("qc",), CONTROL.read_text().replace("-2.", "-2.x"), r"line 3: expected a number in column c_v"),
    ],
)
def test_what_is_no_record_is_refused_with_its_line_and_nothing_is_written(
    words: tuple[str, ...], text: str, reason: str, tmp_path: Path
) -> None:
    path, folder = tmp_path / "record.csv", tmp_path / "out"
    path.write_text(text)
    folder.mkdir()
    files = ("--out", folder / "a.json", "--plot", folder / "a.svg", "--certificate", folder / "a.pdf")
    line = refused("calibrate", words[0], path, *words[1:], *files)
    assert line.startswith("Error: record.csv")
    assert re.search(reason, line), line
    assert list(folder.iterdir()) == []


def test_a_static_record_that_moved_is_short_or_saturated_is_refused(static: np.ndarray, tmp_path: Path) -> None:
    path, out = tmp_path / "static.npy", tmp_path / "allan.json"
    moved, stuck = static.copy(), static.copy()
    moved[60_000:, 1] += 0.5
    stuck[:, 0] = np.clip(stuck[:, 0], -0.05, 0.05)
    cases = (
        (moved, "moved"),
        (stuck, "axis x is saturated"),
        (static[:2000], "too short"),
        (static[:, :2], "expected names of its 2 columns"),
    )
    for samples, reason in cases:
        np.save(path, samples)
        line = refused("allan", path, "--rate", RATE, "--out", out)
        assert line.startswith("Error: static.npy")
        assert reason in line
        assert not out.exists()


def test_a_row_without_numbers_leaves_the_longest_stretch(static: np.ndarray, tmp_path: Path) -> None:
    broken = static.copy()
    broken[77, 2] = np.nan
    np.save(tmp_path / "static.npy", broken)
    found = answer("allan", tmp_path / "static.npy", "--rate", RATE)
    assert found["lines"] == [79, len(static)]
    assert found["record"]["faults"] == ["1 rows without numbers, the first in line 78"]
    np.save(tmp_path / "rest.npy", static[78:])
    again = answer("allan", tmp_path / "rest.npy", "--rate", RATE)
    assert found["axes"]["x"]["curve"] == again["axes"]["x"]["curve"]


def test_a_logger_s_record_gives_the_noise_of_its_sensor_in_any_unit(static: np.ndarray, tmp_path: Path) -> None:
    """Counts of 0.004 deg/s, polled at twice the sensor's rate, stamped in microseconds that wrap, ten seconds lost."""
    counts = np.repeat(np.round(static / 0.004).astype(np.int64), 2, axis=0)
    stamps = (4_000_000_000 + np.round(np.arange(len(counts)) / (2.0 * RATE) * 1e6).astype(np.int64)) % 2**32
    rows = np.column_stack([stamps, counts])
    rows = np.delete(rows, slice(2000, 2000 + round(20.0 * RATE)), axis=0)
    np.savetxt(tmp_path / "log.csv", rows, "%d", ",", header="t_us,gx_raw,gy_raw,gz_raw", comments="")
    found = answer("allan", tmp_path / "log.csv", "--gyro", "0.004 deg/s", "--unit", "deg/h")
    assert found["rate_hz"] == pytest.approx(RATE, rel=1e-4)
    for k, axis in enumerate("xyz"):
        noise = (8.9e-3, 6.9e-3, 7.38e-3)[k] * 3600.0
        assert found["axes"][axis]["random_walk"] == pytest.approx(noise, rel=0.03)
    assert "gap of 10" in found["record"]["faults"][0]
    assert "are counts" in refused("allan", tmp_path / "log.csv")
    assert "expected one of the gyroscope" in refused(
        "allan", tmp_path / "log.csv", "--gyro", "0.004 deg/s", "--unit", "g"
    )
    assert "expected readings of the accelerometer" in refused(
        "allan", tmp_path / "log.csv", "--gyro", "0.004 deg/s", "--sensor", "accelerometer"
    )


def test_a_record_is_described_in_a_line_and_written_for_a_node(tmp_path: Path) -> None:
    lines = [f"{20 * k},{0.5 if k % 3 else 0.7},0,0,0,0,{1.0 + 0.001 * (k % 5)}" for k in range(500)]
    (tmp_path / "log.csv").write_text("\n".join(["t_ms,gx_dps,gy_dps,gz_dps,ax_g,ay_g,az_g", *lines]))
    done = run("calibrate", "record", tmp_path / "log.csv", "--out", tmp_path / "log.npy")
    assert done.stdout == (
        "log.csv: 500 rows; 10.0 s at 50 Hz by t_ms in ms; gyroscope gx_dps,gy_dps,gz_dps in deg/s; "
        "accelerometer ax_g,ay_g,az_g in g; no gap, no fault\n"
    )
    rows = np.load(tmp_path / "log.npy")
    assert rows[1] == pytest.approx([0.02, math.radians(0.5), 0.0, 0.0, 0.0, 0.0, 1.001 * 9.80665])
    assert answer("calibrate", "record", tmp_path / "log.npy")["rate_hz"] == pytest.approx(50.0)
    assert "expected another file that ends in .npy" in refused(
        "calibrate", "record", tmp_path / "log.csv", "--out", tmp_path / "log.json"
    )


def test_a_certificate_has_number_serial_number_and_next_due_day(tmp_path: Path) -> None:
    made = tmp_path / "gyro.pdf"
    words = ("calibrate", "turntable", NODE_A1, "--reference", 720, "--certificate", made, "--date", "2024-05-31")
    plain = run(*words)
    assert plain.returncode == 0, plain.stderr
    bare = made.read_bytes()
    assert run(*words, "--serial", "A1-0042", "--number", "K-17", "--due", "2025-05-31").returncode == 0
    assert made.read_bytes() != bare
    late = refused(*words, "--due", "2024-05-31")
    assert "--due: expected a day after that of the calibration, 2024-05-31, got 2024-05-31" in late


def test_a_forced_calibration_says_so_in_its_file(tmp_path: Path) -> None:
    from groundstation.calibration.block import read_calibration

    record, out = tmp_path / "table.csv", tmp_path / "block.json"
    rows = [row.split(",") for row in TABLE.splitlines() if row[:2] in ("x,", "y,", "z,")]
    exchanged = [",".join([*row[:1], *row[3:5], *row[1:3], *row[5:]]) for row in rows]
    record.write_text("\n".join(["axis,x_pos,x_neg,y_pos,y_neg,z_pos,z_neg", *exchanged]) + "\n")
    words = ("calibrate", "turntable", record, "--reference", 720, "--out", out)
    assert "refused by right-handed: the axes are left-handed" in refused(*words)
    assert not out.exists()
    found = answer(*words, "--force")
    assert found["forced"][0].startswith("right-handed: ")
    assert "; forced past right-handed: " in read_calibration(out).provenance.design


def test_outputs_land_together_or_not_at_all(tmp_path: Path) -> None:
    out = tmp_path / "a.json"
    done = run(
        "calibrate", "turntable", NODE_A1, "--reference", 720, "--out", out, "--plot", tmp_path / "nowhere" / "a.svg"
    )
    assert done.returncode == 1
    assert "nothing was written" in done.stderr
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_record_is_never_overwritten(tmp_path: Path) -> None:
    record = tmp_path / "gyro.csv"
    record.write_text(TABLE)
    assert "expected different files" in refused("calibrate", "turntable", record, "--reference", 720, "--out", record)
    assert record.read_text() == TABLE


def test_a_calibration_that_was_changed_or_is_another_s_is_refused(tool: tuple, tmp_path: Path) -> None:
    path = tmp_path / "changed.json"
    path.write_text(tool[0].read_text().replace('"SF_A0": 3.', '"SF_A0": 2.'))
    assert "sha256" in refused("calibrate", "qc", CONTROL, "--accelerometers", path)
    assert "expected mwd accelerometers" in refused("calibrate", "qc", CONTROL, "--accelerometers", tool[1])
    path.write_text("[]")
    assert "expected the calibration of an MWD triad" in refused("calibrate", "qc", CONTROL, "--accelerometers", path)


@pytest.mark.parametrize(
    "name", ["turntable", "attitudes", "mwd", "magnetometer", "qc", "record", "rests", "temperature"]
)
def test_every_calibration_has_help_with_an_example_on_a_line_of_its_own(name: str) -> None:
    assert f"\n    borechain calibrate {name}" in run("calibrate", name, "--help").stdout


def test_the_experiments_keep_the_tables_that_they_print(tmp_path: Path) -> None:
    listed = run("experiment", "list").stdout
    for name, words in (("mwd", ("--tools", 1)), ("allan", ("--records", 1))):
        assert re.search(rf"^{name} ", listed, re.MULTILINE)
        found = answer("experiment", name, *words, "--out", tmp_path)
        assert {"case", "published", "ours", "unit"} <= set(found["cases"][0])
        kept = (tmp_path / f"{name}.csv").read_text().splitlines()
        assert len(kept) == 1 + len(found["cases"])
        assert kept[0] == (ROOT / "docs" / "results" / f"{name}.csv").read_text().splitlines()[0]


def test_an_experiment_whose_tables_cannot_be_kept_is_not_begun(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = run("experiment", "mwd", "--tools", 10_000, "--out", tmp_path / "file" / "results")
    assert done.returncode == 1, done.stderr
    assert done.stdout == ""
    assert done.stderr.splitlines() == [
        f"Error: {tmp_path / 'file' / 'results'}: Not a directory; choose a writable place"
    ]
