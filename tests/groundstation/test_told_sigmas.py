"""A sigma that a crew tells is in the ± at the toe, as large as it was told, and gone when it is taken back."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hand_fed import Rig

from groundstation.survey.fusion.fusion import Weighting

LEAN_DEG, STOPS, TUBE_M = 2.0, 4, 2.0
TOE_M = TUBE_M * (STOPS - 1)  # what the second tube has surveyed
LEAN, DEG = math.radians(LEAN_DEG), math.radians(1.0)
EXACTLY = {"stick_up_std_m": 1e-9, "tube_length_std": 0.0, "collar_inclination_deg": LEAN_DEG}
ALONG = np.array([math.sin(LEAN), 0.0, math.cos(LEAN)])
Told = tuple[str, dict[str, object], npt.NDArray[np.float64]]
OF_DEPTH: list[Told] = [
    ("stick_up", {"action": "tell", "height_m": 0, "sigma_m": 0.2}, 0.2 * ALONG),
    ("length", {"tube": 1, "length_m": TUBE_M, "sigma_m": 0.05}, 0.05 * ALONG),
]
TURNED = np.array([0.0, 0.5 * DEG * TOE_M * math.sin(LEAN), 0.0])
NORTH: Told = ("north", {"action": "tell", "angle_deg": 0, "sigma_deg": 0.5}, TURNED)
CASES = [(Weighting.BAYES, one) for one in OF_DEPTH] + [(Weighting.ADJUSTED, one) for one in (*OF_DEPTH, NORTH)]


def drilled(folder: Path, weighting: Weighting) -> Rig:
    """A straight hole that the second tube alone surveys: the length of the lowest is in every depth."""
    rig = Rig(folder, target=20.0, weighting=weighting, **EXACTLY)
    rig.run(5.0)
    rig.speak(1)
    for stop in range(2, STOPS + 1):
        rig.speak(stop)
        rig.depth(TUBE_M * stop)
        rig.survey(2, stop, LEAN_DEG)
    return rig


def cov_of_toe(rig: Rig) -> npt.NDArray[np.float64]:
    point: dict[str, Any] = rig.ask("trajectory")["points"][-1]
    assert point["md_m"] == TOE_M
    return np.array(point["covariance_m2"])


@pytest.mark.parametrize(("weighting", "told"), CASES, ids=[f"{weighting}-{one[0]}" for weighting, one in CASES])
def test_the_toe_has_what_was_told_in_its_sigma(tmp_path: Path, weighting: Weighting, told: Told) -> None:
    name, parameters, moved = told
    rig = drilled(tmp_path, weighting)
    before = cov_of_toe(rig)
    rig.ground.operator.order(name, {key: str(value) for key, value in parameters.items()}, "anna")
    assert cov_of_toe(rig) - before == pytest.approx(np.outer(moved, moved), rel=1e-3, abs=1e-9)
    row = next(row for row in rig.ask("setup")["items"] if row["kind"] == name and row["by"] == "anna")
    assert row["toe_cm"] == pytest.approx(100.0 * float(np.linalg.norm(moved)), rel=0.01)
    rig.ground.operator.order("setup", {"action": "undo"}, "anna")
    assert cov_of_toe(rig) == pytest.approx(before, rel=1e-12, abs=1e-18)


def test_what_is_assumed_of_a_setup_is_what_the_sigma_has_in_it(tmp_path: Path) -> None:
    """The sigma of an item that was not told is that of the configuration, of which depths are made."""
    rig = Rig(tmp_path, depth_offset_std=0.17, tube_length_std=0.004, depth_scale_std=3e-3)
    rig.run(5.0)
    rig.speak(2)
    shown = {row["item"]: row["sigma"] for row in rig.ask("setup")["items"]}
    assert (shown["stick_up"], shown["length.1"], shown["depth_scale"]) == (0.17, 0.004, 3e-3)


@pytest.mark.parametrize(
    ("sigma_deg", "source", "detail"), [(0.06, "design", "bare sensor"), (0.002, "told", "configuration")]
)
def test_an_accelerometer_whose_sigma_was_configured_is_no_bare_sensor(
    tmp_path: Path, sigma_deg: float, source: str, detail: str
) -> None:
    rig = Rig(tmp_path, accelerometer_bias_std_deg=sigma_deg)
    rig.run(5.0)
    rig.speak(1)
    row = next(row for row in rig.ask("setup")["items"] if row["item"] == "accelerometer.1")
    assert (row["source"], row["detail"]) == (source, detail)
    assert row["sigma"] == pytest.approx(math.radians(sigma_deg) * 9.81, rel=1e-5)
