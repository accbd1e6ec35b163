"""A scale error that all gyroscopes share is the encoder's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.fusion.shared_scale import FEWEST, SCALE_STD, shared_scale


@pytest.mark.parametrize("nodes", [FEWEST, 10, 50])
def test_gyroscopes_that_err_each_by_its_own_accuse_nobody(nodes: int) -> None:
    random = np.random.default_rng(nodes)
    assert not any(shared_scale((SCALE_STD * random.standard_normal(nodes)).tolist()) for _ in range(2000))


@pytest.mark.parametrize(("nodes", "slip"), [(10, 4e-3), (50, 2e-3), (50, -2e-3)])
def test_a_belt_that_slips_is_seen_and_measured(nodes: int, slip: float) -> None:
    random = np.random.default_rng(3)
    found = [shared_scale((slip + SCALE_STD * random.standard_normal(nodes)).tolist()) for _ in range(300)]
    seen = [one for one in found if one is not None]
    assert len(seen) > 0.95 * len(found)
    off = np.array([(one.by - slip) / one.std for one in seen])
    assert np.mean(off**2) == pytest.approx(1.0, abs=0.4)


def test_one_gyroscope_that_has_failed_changes_nothing() -> None:
    scales = (3e-3 + SCALE_STD * np.random.default_rng(5).standard_normal(20)).tolist()
    plain, spoilt = shared_scale(scales), shared_scale([*scales, 0.3])
    assert plain is not None
    assert spoilt is not None
    assert abs(spoilt.by - plain.by) < plain.std


@given(st.lists(st.floats(-0.1, 0.1) | st.just(float("nan")), max_size=FEWEST - 1), st.integers(0, 20))
def test_of_few_nodes_nothing_is_said(scales: list[float], idle: int) -> None:
    assert shared_scale(scales + idle * [0.0]) is None
