"""What is compiled before a ground station says that it lives is all that an adjustment of many unknowns runs."""

import numpy as np
import pytest

from groundstation.survey.adjustment.kernels.observations import mirror_upper
from groundstation.survey.adjustment.linear_solution import InCommon
from groundstation.survey.adjustment.warm_adjustment import warm_adjustment


@pytest.mark.parametrize("unknowns", [1, 71, 157])
def test_a_covariance_is_the_inverse_and_compiles_nothing_that_was_not_warmed(unknowns: int) -> None:
    warm_adjustment()
    before = list(mirror_upper.signatures)
    root = np.random.default_rng(unknowns).standard_normal((unknowns, unknowns))
    information = root @ root.T + unknowns * np.eye(unknowns)
    cov = InCommon(information, np.zeros(unknowns)).cov
    np.testing.assert_allclose(cov @ information, np.eye(unknowns), atol=1e-12)
    np.testing.assert_allclose(cov, cov.T, atol=1e-15)
    assert mirror_upper.signatures == before
