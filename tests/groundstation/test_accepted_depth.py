"""What a crew may accept of the depth: one that jumped, is refused or contradicts the tubes, and no other."""

from __future__ import annotations

from pathlib import Path

import pytest
from hand_fed import Rig

from groundstation.errors import SelectorError

ORDER = ("accept_depth", {"action": "confirm"}, "anna")


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    rig = Rig(tmp_path)
    rig.run(12.0)
    rig.speak(1)
    rig.depth(2.0)
    rig.speak(1)
    return rig


def test_a_depth_that_nothing_speaks_against_is_not_accepted_and_nothing_is_entered(rig: Rig) -> None:
    with pytest.raises(SelectorError, match="expected a depth that jumped or is refused, nothing speaks against it"):
        rig.ground.operator.order(*ORDER)
    assert rig.ask("orders")["orders"] == []


def test_before_any_depth_there_is_none_to_accept(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.run(12.0)
    with pytest.raises(SelectorError):
        rig.ground.operator.order(*ORDER)


def test_one_that_jumped_is_accepted_once(rig: Rig) -> None:
    rig.run(0.5)
    rig.read_depth(0.5)
    rig.run(1.0)
    assert "depth_refused" in rig.alarms()
    rig.ground.operator.order(*ORDER)
    rig.run(1.0)
    assert "depth_refused" not in rig.alarms()
    with pytest.raises(SelectorError):
        rig.ground.operator.order(*ORDER)
