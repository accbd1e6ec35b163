"""What tubes have in common in their turns, against sums over the joints above each."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.service.hole.string_prior import Chain, Hanging, causes_of_turns

MOUNT_VAR = 0.04
joints = st.lists(st.floats(0.01, 2.0), min_size=2, max_size=7)


def string_that_grows(count: int) -> list[Chain]:
    """Chains of all tubes at every make-up: tube 1 is the lowest, and one is added on top at a time."""
    return [(tube, tuple(range(tube + 1, top + 1))) for top in range(1, count + 1) for tube in range(1, top + 1)]


@given(joints, st.floats(0.01, 2.0))
def test_turns_share_the_joints_above_both_tubes(stds: list[float], drive: float) -> None:
    """``stds[t]`` is of the joint above tube t + 1; the drive head is joined anew at every make-up."""
    count = len(stds)
    chains = string_that_grows(count)
    above = {chain: sum(std**2 for std in stds[chain[0] - 1 : top_of(chain) - 1]) + drive**2 for chain in chains}
    hanging = Hanging()
    places = {chain: hanging.add_chain(chain) for chain in chains}
    causes = causes_of_turns(hanging, chains, [above[chain] + MOUNT_VAR for chain in chains], MOUNT_VAR)
    columns = np.concatenate([causes.of_tubes, causes.of_make_ups], axis=1).T * causes.stds
    turns = np.array([columns[tube] + columns[len(hanging.tubes) + make_up] for tube, make_up in places.values()])
    found = turns @ turns.T
    for one, chain in enumerate(chains):
        for two, other in enumerate(chains):
            begin, end = max(chain[0], other[0]), min(top_of(chain), top_of(other))
            shared = sum(std**2 for std in stds[begin - 1 : end - 1]) if begin < end else 0.0
            shared += drive**2 if top_of(chain) == top_of(other) else 0.0
            shared += MOUNT_VAR if chain[0] == other[0] else 0.0
            assert found[one, two] == pytest.approx(shared, abs=1e-9)


def top_of(chain: Chain) -> int:
    tube, above = chain
    return above[-1] if above else tube


def test_a_string_that_hangs_otherwise_begins_anew() -> None:
    hanging = Hanging()
    first = hanging.add_chain((1, (2, 3)))
    assert hanging.add_chain((1, (2, 3))) == first
    assert hanging.add_chain((1, (3, 2)))[0] != first[0]


def test_a_tube_whose_order_is_not_known_has_a_turn_of_its_own() -> None:
    hanging = Hanging()
    chains: list[Chain] = [(4, None), (2, (3,))]
    places = [hanging.add_chain(chain) for chain in chains]
    causes = causes_of_turns(hanging, chains, [1.0, 0.5], MOUNT_VAR)
    columns = np.concatenate([causes.of_tubes, causes.of_make_ups], axis=1).T * causes.stds
    turns = np.array([columns[tube] + columns[len(hanging.tubes) + make_up] for tube, make_up in places])
    assert turns @ turns.T == pytest.approx(np.diag([1.0, 0.5]))
    assert math.isfinite(float(causes.stds.sum()))
