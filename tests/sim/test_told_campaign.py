"""A campaign of what is told wrongly: its yaws and directions are off by what was asked, and by no more."""

import math
from typing import Any

import numpy as np
import pytest

from sim.campaign.chunk import Campaign, Columns
from sim.studies.scenarios import Tables, change_sections
from sim.world.scenario import scenario_of

pytestmark = pytest.mark.slow

SEED = 5
STRING: Tables = {
    "rig": {"tubes": 3, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": 6.0, "azimuth_deg": 100.0}},
    "schedule": {"add_s": 58.0, "stop_s": 28.0},
    "rotation": {"turns": 3.3},
    "medium": {"link": "off", "loss": 0.0},
}
BIT, TOP = 1, 3  # tubes


def surveys_of(tables: Tables) -> Columns:
    return Campaign(scenario_of(dict(tables))).chunk(SEED, SEED).surveys


def told(**keys: Any) -> Columns:
    return surveys_of(change_sections(STRING, told=keys))


def off_deg(one: Columns, other: Columns, of: str = "yaw_error") -> np.ndarray:
    """By how much a quantity of two campaigns of the same surveys differs."""
    for name in ("tube", "hop", "at"):
        np.testing.assert_array_equal(one[name], other[name])
    return np.degrees([math.remainder(angle, math.tau) for angle in one[of] - other[of]])


def test_north_turns_every_yaw_and_every_azimuth() -> None:
    honest, turned = surveys_of(STRING), told(north_deg=7.0)
    np.testing.assert_allclose(off_deg(turned, honest), -7.0, atol=0.02)
    np.testing.assert_allclose(off_deg(turned, honest, "azimuth_error"), -7.0, atol=0.02)
    np.testing.assert_allclose(off_deg(turned, honest, "inclination_error"), 0.0, atol=1e-4)
    np.testing.assert_allclose(off_deg(turned, honest, "systematic_error"), -7.0, atol=1e-9)


def test_a_joint_turns_the_yaws_below_it_and_a_mark_at_the_head_those_of_its_time() -> None:
    honest = surveys_of(STRING)
    top = honest["tube"] + honest["hop"] - 1
    joint, drive = told(joint_tube=2, joint_deg=5.0), told(joint_tube=2, drive_deg=5.0)
    np.testing.assert_allclose(off_deg(joint, honest), np.where((honest["tube"] < 2) & (top >= 2), 5.0, 0.0), atol=0.05)
    np.testing.assert_allclose(off_deg(drive, honest), np.where(top == 2, 5.0, 0.0), atol=0.05)


def test_a_longer_tube_goes_deeper_below_those_above_it() -> None:
    honest, longer = surveys_of(STRING), told(lengths_off_m=[0.25])
    np.testing.assert_allclose(longer["md"] - honest["md"], np.where(honest["tube"] > BIT, 0.0, 0.25), atol=1e-9)


def test_a_mount_that_is_tilted_is_read_as_a_rig_reads_it() -> None:
    """In a plumb hole the lean that is read is the tilt of the mount, whatever the yaw."""
    plumb = change_sections(STRING, path={"straight": {"inclination_deg": 0.0}})
    quiet = change_sections(plumb, accelerometer={"bias_std_deg": 0.0, "noise_deg": 1e-6, "vibration_mps2": 0.0})
    leans = []
    for seed in range(1, 31):
        campaign = Campaign(scenario_of(dict(change_sections(quiet, joints={"mount_tilt_std_deg": 0.4}))))
        found = campaign.chunk(seed, seed).surveys
        for tube in (BIT, TOP):
            own = found["inclination_error"][found["tube"] == tube]
            assert np.ptp(own) < 1e-6
            leans.append(np.degrees(own[0]))
    assert np.mean(np.square(leans)) == pytest.approx(2.0 * 0.4**2, rel=0.35)


def test_play_is_another_lean_at_every_stop() -> None:
    plumb = change_sections(STRING, path={"straight": {"inclination_deg": 0.0}})
    quiet = change_sections(plumb, accelerometer={"bias_std_deg": 0.0, "noise_deg": 1e-6, "vibration_mps2": 0.0})
    campaign = Campaign(scenario_of(dict(change_sections(quiet, disturbance={"play": {"sigma_deg": 0.2}}))))
    found = campaign.chunk(1, 40).surveys
    leans = np.degrees(found["inclination_error"])
    assert np.mean(leans**2) == pytest.approx(2.0 * 0.2**2, rel=0.2)
    bit = leans[found["tube"] == BIT].reshape(40, 3)
    assert np.abs(np.diff(bit, axis=1)).min() > 1e-4
