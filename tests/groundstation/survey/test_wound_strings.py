"""A string that was wound up below the encoder, as the looks of all tubes show it: alike at every stop, or not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from blame_table import examined
from drawn_strings import DEG, DrawnString, draw_string
from scipy.spatial.transform import Rotation

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.hypotheses import Hypothesis
from groundstation.survey.adjustment.reliability import measure_reliability
from groundstation.survey.adjustment.toe_weights import toe_weights

Array = npt.NDArray[np.float64]
LEANING = 30.0  # deg, of the collar


def wound(drawn: DrawnString, turns: float | Array) -> DrawnString:
    """The same looks, whose yaws are told too large by ``turns`` (n,), rad."""
    return replace(drawn, looks=replace(drawn.looks, yaw=drawn.looks.yaw + turns))


@pytest.mark.parametrize("deg", [0.3, -20.0])
def test_wound_alike_at_every_stop_it_is_a_hole_turned_about_the_vertical(deg: float) -> None:
    """Why neither node nor ground station can see it: the looks leave the same of one hole as of the other."""
    drawn = draw_string(7, begins_deg=LEANING)
    about = Rotation.from_euler("z", deg, degrees=True).as_matrix()
    turned = replace(drawn.path, collar=about @ drawn.path.collar, collar_cov=about @ drawn.path.collar_cov @ about.T)
    straight = adjust_hole(drawn.looks, drawn.string, drawn.path)
    other = adjust_hole(wound(drawn, deg * DEG).looks, drawn.string, turned)
    np.testing.assert_allclose(other.now.tangents, straight.now.tangents @ about.T, atol=1e-8)
    np.testing.assert_allclose(other.left, straight.left, atol=1e-8)


@pytest.mark.parametrize("kind", [BlunderKind.ENCODER_SLIPPED, BlunderKind.ENCODER_DRIFTS])
def test_wound_otherwise_from_a_stop_on_it_is_found_from_the_size_on_that_is_told(kind: BlunderKind) -> None:
    """A twist that another ground makes, and one that grows with the string."""
    drawn = draw_string(7, begins_deg=LEANING)
    slips = kind is BlunderKind.ENCODER_SLIPPED
    one = Hypothesis(kind, (), 5 if slips else 0)
    amount = np.where(drawn.looks.stop >= 5, 1.0, 0.0) if slips else drawn.looks.stop.astype(np.float64)
    found = adjust_hole(drawn.looks, drawn.string, drawn.path)
    (told,) = measure_reliability(found, drawn.run, [one], toe_weights(found), {})
    assert told.smallest < 0.1 * DEG
    (blunder,) = examined(wound(drawn, 3.0 * told.smallest * amount)).blunders
    assert blunder.best.hypothesis == one
    assert abs(blunder.best.size[0] - 3.0 * told.smallest) < 3.0 * np.sqrt(blunder.best.cov[0, 0])


def test_where_the_hole_hardly_leans_a_third_of_a_degree_is_not_found_and_does_little() -> None:
    """A yaw of 1 deg turns a direction that leans by 2 deg by 0.035 deg."""
    drawn = draw_string(7, begins_deg=2.0)
    found = adjust_hole(drawn.looks, drawn.string, drawn.path)
    one = Hypothesis(BlunderKind.ENCODER_SLIPPED, (), 5)
    (told,) = measure_reliability(found, drawn.run, [one], toe_weights(found), {})
    assert 0.3 * DEG < told.smallest < 1.0 * DEG
    least = wound(drawn, np.where(drawn.looks.stop >= 5, 0.3 * DEG, 0.0))
    with_it = adjust_hole(least.looks, drawn.string, drawn.path)
    off = np.linalg.norm(with_it.now.tangents - found.now.tangents, axis=1)
    stated = np.sqrt(np.einsum("kaa->k", found.covs[:, :2, :2]))
    assert np.all(off < 2.0 * stated)
