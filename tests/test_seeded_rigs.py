"""Rigs under the gauntlet's faults send and show what they did: traffic of each end, every event, all that is answered.

The figures say that nothing has changed, not that it is right: that the oracles of the gauntlet and the tests of each
room do. Where a rig is to do otherwise, ``python tests/tools/seeded_rigs.py`` writes them anew, and the change is read.
"""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from seeded_rigs import FIGURES, RIGS, figures_of, sealed_figures

from borechain.gauntlet.gauntlet_run import ALL
from sim.gauntlet.fault_kinds import SEALED

KEPT = json.loads(FIGURES.read_text(encoding="utf-8"))
SUMS = 1e-6  # of the sum of all sizes


def test_every_fault_is_in_one_of_the_rigs() -> None:
    assert sorted(kind for kinds in RIGS.values() for kind in kinds) == sorted(set(ALL) - SEALED)
    assert {*map(str, RIGS), "sealed"} == KEPT.keys()


def compare(found: dict[str, Any], kept: dict[str, Any]) -> None:
    assert [event[:3] for event in found["events"]] == [event[:3] for event in kept["events"]]
    for one, other in zip(found["events"], kept["events"], strict=True):
        assert one[3] == pytest.approx(other[3], abs=0.011)
    for part, counted in (("sent", slice(0, 1)), ("shown", slice(2, 3))):
        assert found[part].keys() == kept[part].keys()
        for name, sums in kept[part].items():
            one = found[part][name]
            assert one[counted] == sums[counted], name
            numbers = slice(1, 3) if part == "sent" else slice(0, 2)
            assert math.dist(one[numbers], sums[numbers]) <= SUMS * sums[numbers][1] + 1e-12, name


@pytest.mark.slow
@pytest.mark.parametrize("seed", RIGS)
def test_a_rig_sends_and_shows_what_it_did(seed: int) -> None:
    compare(figures_of(seed), KEPT[str(seed)])


@pytest.mark.slow
def test_a_rig_under_keys_sends_and_shows_what_it_did() -> None:
    compare(sealed_figures(), KEPT["sealed"])
