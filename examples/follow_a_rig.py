"""Follow a rig from Python: the verdict now, every survey from the first on, and the alarms at the end.

borechain rig wellbore-1 --speed 60          # in one shell
python examples/follow_a_rig.py              # in another
"""

from __future__ import annotations

import sys

from borechain.client import connect_to_ground
from telemetry import keys


def follow(endpoint: str = keys.DEFAULT_ENDPOINT, rig: str = keys.DEFAULT_RIG, silence_s: float = 60.0) -> None:
    """Print what the crew of a rig is told, until no survey has come for ``silence_s``."""
    with connect_to_ground(endpoint, rig) as ground:
        print(ground.verdict().line)
        for survey in ground.stream("measurements", timeout=silence_s):
            print(f"tube {survey['tube']} at {survey['md_m']:.1f} m: {survey['inclination_deg']:.2f} deg")
            print(ground.verdict().line)
        for alarm in ground.alarms():
            print(f"alarm {alarm.number} {alarm.state}: {alarm.code} {alarm.subject} {alarm.detail}")


if __name__ == "__main__":
    follow(*sys.argv[1:3], *map(float, sys.argv[3:4]))
