"""Accuracy and precision from records: published tables through the command, and what is none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from borechain.cli.calibrate.calibrate import calibrate
from groundstation.calibration.accuracy_records import answer_accuracy
from groundstation.calibration.calibration_records import read_attitudes
from telemetry.errors import CalibrationError

MEANS = """preset_deg,mean_deg,std_deg
0.5,0.488,0.027
1.0,1.006,0.022
1.5,1.480,0.038
2.5,2.478,0.025
3.5,3.429,0.141
5.0,4.982,0.014
10.0,9.966,0.029
"""  # as published
SECOND = "preset_deg,mean_deg,std_deg\n1,1.00168,0.0051\n10,10.0168,0.0051\n"  # published: 0.168 %, 0.0051 deg
DATA = Path(__file__).parents[2] / "data" / "calibration"


def files(folder: Path, *texts: str) -> list[Path]:
    paths = [folder / f"{k}.csv" for k in range(len(texts))]
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text)
    return paths


def test_the_command_prints_the_published_figures(tmp_path: Path) -> None:
    done = CliRunner().invoke(calibrate, ["accuracy", *map(str, files(tmp_path, MEANS, SECOND)), "--json"])
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    first = found["sensors"][0]
    assert [row["error_percent"] for row in first["presets"]][:4] == pytest.approx([2.4, 0.6, 1.3333, 0.88], abs=1e-4)
    assert first["error_percent"] == pytest.approx(1.126, abs=0.034)  # means are printed to 0.001
    assert first["std"] == pytest.approx(0.0422, abs=5e-4)
    assert (found["error_percent"], found["std"]) == (
        pytest.approx(0.1818, abs=3e-4),
        pytest.approx(5.063e-3, abs=2e-6),
    )
    shown = CliRunner().invoke(calibrate, ["accuracy", *map(str, files(tmp_path, MEANS, SECOND))]).stdout
    assert "all as one: accuracy 0.18" in shown


def test_readings_give_their_means_and_deviations(tmp_path: Path) -> None:
    text = "preset_g,reading_g\n1,1.01\n2,2.03\n1,1.03\n2,1.99\n"
    (sensor,) = answer_accuracy(files(tmp_path, text))["sensors"]
    rows = [[row[key] for key in ("preset", "mean", "std", "error_percent")] for row in sensor["presets"]]
    np.testing.assert_allclose(rows, [[1, 1.02, 0.02 / 2**0.5, 2.0], [2, 2.01, 0.04 / 2**0.5, 0.5]], rtol=1e-9)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("preset_deg,reading_deg\n0,0.1\n0,0.2\n", "line 2: expected a preset other than 0"),
        ("preset_deg,reading_deg\n1,1.1\n2,2.2\n2,2.1\n", r"expected 2 readings or more of 2 presets, got \[1, 2\]"),
        ("preset_deg,mean_deg,std_deg\n1,1,0\n", "line 2: expected a standard deviation above 0, got 0"),
        ("preset_deg,mean_deg,std_deg\n1,1,1\n1,1,1\n", "line 3: expected one row for each preset, got 1 again"),
        ("preset_deg,mean_deg,std_deg\n1,-999.25,1\n", "line 2: expected a reading in column mean_deg, got -999.25"),
        ("preset_deg,reading_deg\n1,nan\n", "line 2: expected a finite number in column reading_deg, got nan"),
        ("preset_deg,reading_rad\n1,1\n", "line 1: expected the header"),
        ("preset_deg,reading_deg\n1,\n", "line 2: expected a number in column reading_deg"),
    ],
)
def test_a_record_that_is_none_is_refused_by_its_line(tmp_path: Path, text: str, told: str) -> None:
    with pytest.raises(CalibrationError, match=told):
        answer_accuracy(files(tmp_path, text))


def test_sensors_in_two_units_are_refused(tmp_path: Path) -> None:
    with pytest.raises(CalibrationError, match="expected sensors in one unit, got deg and g"):
        answer_accuracy(files(tmp_path, SECOND, SECOND.replace("deg", "g")))


def test_attitudes_in_g_are_those_in_metres(tmp_path: Path) -> None:
    """The published table in its own unit."""
    lines = (DATA / "calibration_vn100_accel.csv").read_text().splitlines()
    k = next(k for k, line in enumerate(lines) if line.startswith("position,"))
    rows = [line.split(",") for line in lines[k + 1 :] if line]
    in_g = [[*row[:3], *(repr(float(x) / 9.80665) for x in row[3:])] for row in rows]
    text = lines[k].replace("_mps2", "_g") + "\n" + "".join(",".join(row) + "\n" for row in in_g)
    (path,) = files(tmp_path, text)
    one, other = read_attitudes(path), read_attitudes(DATA / "calibration_vn100_accel.csv")
    np.testing.assert_allclose(one.readings, other.readings, rtol=1e-12)
    wrong = text.replace(",".join(in_g[1][3:]), ",".join(rows[1][3:]))
    with pytest.raises(CalibrationError, match=r"it looks in m/s\^2 where g belongs"):
        read_attitudes(*files(tmp_path, wrong))
