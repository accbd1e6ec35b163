"""What one execution cycle of a node takes in."""

from __future__ import annotations

from node.kernels.sensors.correction import USUAL
from telemetry.frozen import Frozen
from telemetry.messages import EPOCH_UNKNOWN


class ImuReading(Frozen):
    """Mean of one cycle as the sensor gives it, before any correction, on the node's own clock."""

    start: float  # s
    end: float  # s
    rate: tuple[float, float, float]  # rad/s
    force: tuple[float, float, float]  # m/s^2
    temperature: float = USUAL  # C
    saturated: int = 0  # bits of what was at its range within the cycle, as the driver saw it: 1 gyroscope, 2 force
    late: float = 0.0  # s, by which the window that was measured ended before the cycle
    late_std: float = 0.0  # s, of that
    # rad/s, nine mean rates about z: of what that window shows of the cycle before, and of the eighths of this one as
    # far as it shows them; nothing: not known
    parts: tuple[float, ...] = ()
    others: tuple[ImuReading, ...] = ()  # of the further IMUs of a cluster, in the same cycle


class RigContext(Frozen):
    """What the firmware gets from the telemetry at a cycle: its place in the string and the time."""

    joined: bool  # the upper joint is closed
    hops: int
    rig_now: float  # s, rig time of the cycle's end
    clock_var: float  # s^2
    synchronised: bool
    epoch: int = EPOCH_UNKNOWN  # of rig_now
    stepped: float = 0.0  # s, by which the clock dates later than in the last cycle for it was put right; NaN: unknown
    drift_std: float = 0.0  # s/s, by which its rate may be off
