"""A node's whole step in integers and in floats, on the same readings and aidings: what it says, tells and does."""

import numpy as np
import pytest
from one_node import events_since, node_of
from rough_node import RoughNode

from node.kernels.record.node_record import AIDING, MOMENT, READING
from node.kernels.step.fixed_node import FixedNode
from node.kernels.step.node_step import node_aiding, node_step
from sim.studies.fixed_point.run import LIMITS

CYCLES = 3000


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "imus", "joints"), [(2, 3, 2), (3, 2, 0), (8, 1, 2), (5, 3, 1), (6, 1, 0), (7, 1, 1)])
def test_a_node_does_the_same_in_integers(seed: int, imus: int, joints: int) -> None:
    """Where no scale is learnt anew: the prior of one is 0.1, the range of the integers 0.054 (decision 11)."""
    rig = RoughNode(imus, np.random.default_rng(seed))
    floats, fixed = node_of(imus, joints, np.random.default_rng(seed)), FixedNode()
    integers = tuple(part.copy() for part in floats)
    seen: set[str] = set()
    assert (rig.step(0)[0].shape, len(rig.step(0)[1]), len(rig.aiding(0))) == ((imus, READING), MOMENT, AIDING)
    for k in range(CYCLES):
        readings, moment = rig.step(k)
        says = node_step(*floats, readings.copy(), moment), fixed.step(*integers, readings.copy(), moment)
        assert says[0] == says[1], k
        assert floats[0][0]["status"] == integers[0][0]["status"], k
        told = [events_since(nodes, int(nodes[0]["events"]["said"])) for nodes in (floats[0], integers[0])]
        assert [event[0] for event in told[0]] == [event[0] for event in told[1]], k
        for (name, *one), (_, *other) in zip(*told, strict=True):
            np.testing.assert_allclose(other, one, rtol=3e-3, atol=1e-3, err_msg=f"{k} {name}")
            seen.add(name)
        turned = int(floats[0][0]["filter"]["now_yaw"]) - int(integers[0][0]["filter"]["now_yaw"])
        assert abs((turned + 2**31) % 2**32 - 2**31) * 360.0 / 2**32 < LIMITS["yaw_deg"], k
        if rig.random.random() < 0.7 and k % 900 < 800:
            aiding = rig.aiding(k)
            gates = node_aiding(*floats[:2], aiding.copy()), fixed.aiding(*integers[:2], aiding.copy())
            assert gates[0] == gates[1], k
    assert len(seen) >= 10
    assert "GYRO_SCALE" not in seen
