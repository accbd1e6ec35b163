"""All gyroscopes together accuse the encoder's belt, which none can by itself."""

from pathlib import Path

import numpy as np
from hand_fed import Rig

TUBES = 20


def speak(rig: Rig, scales: list[float]) -> None:
    for tube in range(TUBES, 0, -1):
        rig.tell(tube, TUBES - tube + 1, scales[tube - 1])
    rig.run(6.0)


def test_a_scale_that_all_gyroscopes_share_is_an_alarm_of_the_belt_until_it_is_gone(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    own = (1e-3 * np.random.default_rng(2).standard_normal(TUBES)).tolist()
    speak(rig, own)
    assert "belt" not in rig.alarms()
    speak(rig, [3e-3 + scale for scale in own])
    (told,) = [row for row in rig.ask("alarms")["rig"] if row["code"] == "belt"]
    assert (told["subject"], told["level"]) == ("encoder", "bad")
    shared = 100.0 * (3e-3 + np.median(own))
    assert told["detail"] == f"it turns {shared:.2f} % less than {TUBES} gyroscopes say"
    speak(rig, own)
    assert "belt" not in rig.alarms()
