"""A rig whose encoder is not heard while it comes to rest: its surveys are untrusted, and then said again."""

from pathlib import Path

import pytest

from borechain.gauntlet.gauntlet_rig import GauntletRig, new_rig
from borechain.gauntlet.oracles import Observer, find_violations
from telemetry.messages import BASE, ENCODER

UNHEARD_FROM, SURVEYED = -8.0, 23.0  # s from the stop on


def untrusted(rig: GauntletRig) -> list[str]:
    return [row["subject"] for row in rig.inline.ask("alarms")["rig"] if row["code"] == "survey_untrusted"]


@pytest.mark.parametrize("restarts", [False, True])
def test_a_survey_is_said_again_when_the_encoder_is_heard_in_the_same_rest(tmp_path: Path, restarts: bool) -> None:
    rig = new_rig("minute", 1, tmp_path)
    observer = Observer(rig)
    stop = next(phase.start for phase in rig.world.phases if phase.kind == "stop")
    rig.advance(stop + UNHEARD_FROM, observer.look)
    rig.freeze(ENCODER)
    rig.advance(stop + SURVEYED, observer.look)
    rig.thaw(ENCODER)
    rig.advance(rig.world.end, observer.look)
    if restarts:
        rig.cut(BASE)
        rig.start(BASE)
    rows = rig.inline.ask("measurements")["measurements"]
    assert sorted(row["tube"] for row in rows) == [1, 2]
    for row in rows:
        assert row["replaces"] is not None
        assert row["replaces"] < row["sequence"]
        assert row["trust"] == "full"
        assert row["sigma_yaw_deg"] < 0.05
    assert untrusted(rig) == []
    assert not observer.found
    assert not find_violations(rig)
    rig.close()
