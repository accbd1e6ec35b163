"""docs/first-sensor.md does what it says: its commands run, and its figures are those that come out."""

import json
import re
import shlex
from pathlib import Path

import pytest
from forked_commands import run

from node.process.cluster_options import own_corrections

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[1]
WRITTEN = (".json", ".svg")
PAGE = (ROOT / "docs" / "first-sensor.md").read_text()


def words_of(command: str, folder: Path) -> list[str]:
    """A command of the page, its record from this checkout and its files into a folder."""
    (line,) = re.findall(rf"^    borechain ({command} .*)$", PAGE, re.MULTILINE)
    words = shlex.split(line)
    return [
        str(ROOT / word) if word.startswith("tests/") else str(folder / word) if word.endswith(WRITTEN) else word
        for word in words
    ]


def test_the_record_is_understood_as_the_page_says(tmp_path: Path) -> None:
    done = run(*words_of("calibrate record", tmp_path))
    assert done.returncode == 0, done.stderr
    said = next(line for line in PAGE.splitlines() if line.startswith("    mpu9150-imu0"))
    assert re.fullmatch(re.escape(said.strip()).replace(r"\.\.", ".*"), done.stdout.strip())


def test_both_sensors_come_out_as_the_page_says_and_a_node_takes_them(tmp_path: Path) -> None:
    done = run(*words_of("calibrate rests", tmp_path), "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert f"It finds {len(found['rests'])} rests." in PAGE
    sizes = [f"{found['before_rms']:.2f}", f"{found['residual_rms']:.3f}", f"{found['left_out_rms']:.3f}"]
    judged = found["gyroscope"]
    angles = [f"{judged['left_out_rms_deg']:.2f}", f"{judged['uncalibrated_rms_deg']:.1f}"]
    says = "Gravity was read {} m/s2 wrong and is {} after, {} at rests .* come out to {} deg instead of {}\\."
    assert re.search(says.format(*map(re.escape, [*sizes, *angles])), PAGE, re.DOTALL), (sizes, angles)
    applied = run(*words_of("calibrate apply", tmp_path))
    assert applied.returncode == 0, applied.stderr
    for drawn in ("rests.svg", "both.svg"):
        assert f"](first-sensor-{drawn})" in PAGE
        kept, made = (ROOT / "docs" / f"first-sensor-{drawn}").read_text(), (tmp_path / drawn).read_text()
        assert sorted(re.findall(r'<g id="([a-z_0-9]+)"', kept)) == sorted(re.findall(r'<g id="([a-z_0-9]+)"', made))
    for sensor in ("gyroscope", "accelerometer"):
        (taken,) = own_corrections(sensor, (tmp_path / f"{sensor}.json",), 1)
        assert taken.matrix[0][0] == pytest.approx(1.0, abs=0.02)


def test_what_is_said_to_show_a_promise_is_there() -> None:
    table = (ROOT / "docs" / "calibration.md").read_text().partition("## What shows it")[2]
    named = re.findall(r"`(?:tests/[a-z/]+/)?(test_[a-z_0-9]+\.py)`", table)
    assert len(named) > 15
    assert [name for name in named if not list((ROOT / "tests").rglob(name))] == []
    places = re.findall(r"`((?:tests|docs)/[a-z_/0-9]+\.py)`|`python (docs/[a-z_]+\.py)`", table)
    assert [place for pair in places for place in pair if place and not (ROOT / place).is_file()] == []
