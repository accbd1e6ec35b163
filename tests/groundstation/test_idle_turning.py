"""A string that turns for a minute while the depth stands is told, and one that rests, drills or shakes is not."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hand_fed import Rig

from groundstation.service.string.idle_turning import LONGEST_APART, TURNED_S, IdleTurning
from telemetry.frozen import replace
from telemetry.messages import NodeFlag, NodeMode, NodeState

STATE = NodeState(
    1, 1000.0, 1, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, (0.0, 0.0, 0.0), 0.0, 0.0, 1e-6, 0.1, 1e-8, NodeFlag.NONE, 5, 0
)


def turned(
    seconds: float, step_deg: float, rate_mps: float = 0.0, mode: NodeMode = NodeMode.TRACKING, apart: float = 0.5
) -> str:
    """What is told after a tube has turned from a bit at 3 m, by ``step_deg`` from each of its states to the next."""
    idle, bit = IdleTurning(), 3.0
    for k in range(round(seconds / apart) + 1):
        bit = 3.0 + rate_mps * apart * k
        yaw = math.remainder(math.radians(step_deg) * k, math.tau)
        idle.on_state(replace(STATE, at=1000.0 + apart * k, yaw=yaw, mode=mode), bit)
    return idle.told(bit)


@pytest.mark.parametrize("step_deg", [5.1, -5.1, 90.0, 179.0, 300.0])
def test_it_is_told_after_a_minute_and_not_before(step_deg: float) -> None:
    assert turned(TURNED_S - 0.5, step_deg) == ""
    assert turned(TURNED_S, step_deg) == (
        "the string turned for 60 s and more while the bit stood at 3.00 m; does the depth stick?"
    )


@pytest.mark.parametrize(
    ("step_deg", "rate_mps", "mode", "apart"),
    [
        (4.9, 0.0, NodeMode.TRACKING, 0.5),
        (30.0, 2.2e-4, NodeMode.TRACKING, 0.5),
        (30.0, -2.2e-4, NodeMode.TRACKING, 0.5),
        (30.0, 0.0, NodeMode.STILL, 0.5),
        (30.0, 0.0, NodeMode.SURVEY, 0.5),
        (30.0, 0.0, NodeMode.TRACKING, LONGEST_APART + 1.0),
    ],
    ids=["shakes", "drills", "is pulled", "is still", "surveys", "is hardly heard"],
)
def test_what_is_no_idle_turning_is_not_told(step_deg: float, rate_mps: float, mode: NodeMode, apart: float) -> None:
    assert turned(10 * TURNED_S, step_deg, rate_mps, mode, apart) == ""


@pytest.mark.parametrize("change", [{"epoch": 6}, {"mode": NodeMode.STILL}, {"at": 2000.0}], ids=str)
def test_a_rest_an_epoch_or_a_gap_ends_what_was_counted_and_an_old_state_adds_nothing(
    change: dict[str, object],
) -> None:
    idle = IdleTurning()
    half = [replace(STATE, at=1000.0 + k, yaw=0.5 * (k % 10)) for k in range(round(TURNED_S / 2) + 1)]
    for state in half * 3:
        idle.on_state(state, 3.0)
    assert idle.told(3.0) == ""
    at = float(str(change.get("at", half[-1].at)))
    idle.on_state(replace(half[-1], **({"at": half[-1].at + 1.0} | change)), 3.0)
    for k in range(round(TURNED_S / 4)):
        later = replace(STATE, at=at + 2.0 + k, yaw=0.5 * (k % 10), epoch=int(str(change.get("epoch", STATE.epoch))))
        idle.on_state(later, 3.0)
    assert idle.told(3.0) == ""


def test_where_the_depth_is_not_known_nothing_is_told() -> None:
    idle = IdleTurning()
    for k in range(200):
        idle.on_state(replace(STATE, at=1000.0 + k, yaw=0.5 * (k % 10)), None)
    assert (idle.told(None), idle.told(3.0)) == ("", "")


def test_the_alarm_comes_while_the_depth_sticks_and_ends_when_it_moves(tmp_path: Path) -> None:
    rig = Rig(tmp_path, stale_after=120.0)
    rig.drill(1, 0.3)
    assert "depth_stands" not in rig.alarms()
    for k in range(80):
        state = replace(STATE, at=rig.now, yaw=0.5 * (k % 10))
        rig.tube.send_state(state, rig.now)
        rig.run(1.0)
        rig.read_depth(rig.md)
    assert "depth_stands" in rig.alarms()
    rig.depth(rig.md + 0.1)
    rig.speak(1)
    assert "depth_stands" not in rig.alarms()
    rig.ground.close()
