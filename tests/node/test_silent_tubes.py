"""Aiding over the heads of silent tubes: the very yaw that would have come through them."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node.errors import NodeConfigurationError
from node.firmware.silent_tubes import aiding_across_silent
from node.firmware.tube import Tube
from node.firmware.tube_settings import MAX_REACH, MakeUpAngle, PassedTube, TubeSettings
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from telemetry.messages import Aiding

JOINTS = st.builds(MakeUpAngle, st.floats(-math.pi, math.pi), st.floats(0.0, 0.01))
PASSED = st.builds(PassedTube, JOINTS, JOINTS)
STIFFNESS = 2e4  # N m/rad


@st.composite
def aidings(draw: st.DrawFn) -> Aiding:
    return Aiding(
        yaw=draw(st.floats(0.0, 6.28)),
        yaw_var=1e-6,
        systematic_var=draw(st.floats(0.0, 1e-4)),
        offset=draw(st.floats(-3.14, 3.14)),
        rate=0.0,
        valid_at=1000.0,
        sequence=7,
        hops=draw(st.integers(0, 5)),
        torque=draw(st.floats(0.0, 900.0)),
        torsion_var=draw(st.floats(0.0, 1e-2)),
        under_torque=draw(st.booleans()),
    )


def through(aiding: Aiding, number: int, passed: PassedTube) -> Aiding:
    """What a living tube hands down of an aiding."""
    settings = TubeSettings(number, drive_joint=passed.drive_joint, lower_joint=passed.lower_joint, stiffness=STIFFNESS)
    config = default_config()
    tube = Tube(settings, config, new_node(config), lambda: 1, restored=False)
    onward = tube.on_aiding(aiding, aiding.valid_at)
    assert onward is not None
    return onward


@settings(max_examples=30)
@given(aidings(), st.lists(PASSED, max_size=3))
def test_over_silent_tubes_comes_what_comes_through_living_ones(aiding: Aiding, silent: list[PassedTube]) -> None:
    over = aiding_across_silent(aiding, silent, STIFFNESS)
    living = aiding
    for number, passed in enumerate(reversed(silent)):
        living = through(living, 9 - number, passed)
    assert over.hops == living.hops == aiding.hops + len(silent)
    assert math.remainder(over.offset - living.offset, math.tau) == pytest.approx(0.0, abs=1e-12)
    for name in ("yaw", "yaw_var", "rate", "valid_at", "sequence", "torque", "under_torque"):
        assert getattr(over, name) == getattr(living, name)
    assert over.systematic_var == pytest.approx(living.systematic_var, rel=1e-12)
    assert over.torsion_var == pytest.approx(living.torsion_var, rel=1e-12)


@pytest.mark.parametrize("reach", [0, MAX_REACH + 1])
def test_a_reach_that_no_node_has_is_refused(reach: int) -> None:
    with pytest.raises(NodeConfigurationError, match=f"reach: expected 1..{MAX_REACH} tubes, got {reach}"):
        TubeSettings(1, reach=reach)
