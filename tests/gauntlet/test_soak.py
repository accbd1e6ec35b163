"""Hours of one rig under faults: nothing grows but what its disks hold, and nothing is wrong."""

import pytest

from borechain.gauntlet.soak import soak


@pytest.mark.statistical
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("hours", [3.0])
def test_a_rig_under_faults_for_hours_does_not_grow(hours: float) -> None:
    samples = list(soak(hours, 1))
    first, last = samples[len(samples) // 3], samples[-1]
    assert last.violations == ()
    assert last.objects < 1.05 * first.objects
    assert last.handles <= first.handles
    assert last.surveys > 0
