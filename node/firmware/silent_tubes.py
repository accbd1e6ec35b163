"""Aiding that comes over the heads of silent tubes: what they would have added to it on its way down."""

from __future__ import annotations

from collections.abc import Sequence

from node.firmware.tube_settings import MakeUpAngle, PassedTube, bounded_by_circle
from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.string.twist import reaching_var
from telemetry.frozen import replace
from telemetry.messages import Aiding


def aiding_across_silent(aiding: Aiding, silent: Sequence[PassedTube], stiffness: float) -> Aiding:
    """The aiding as the lowest of the ``silent`` tubes would have handed it on.

    A tube between adds its joints and its twist and changes nothing else (``node.kernels.string.relay``, scheme
    ``forward``), so the tube below reaches the same yaw over it as through it.

    Parameters
    ----------
    silent : the tubes between, lowest first
    stiffness : N m/rad, of each
    """
    for tube in reversed(silent):
        drive = tube.drive_joint if aiding.hops == 0 else MakeUpAngle()
        aiding = replace(
            aiding,
            offset=wrap_angle(wrap_angle(aiding.offset + drive.angle) + tube.lower_joint.angle),
            systematic_var=bounded_by_circle(aiding.systematic_var + drive.std**2 + tube.lower_joint.std**2),
            torsion_var=float(reaching_var(aiding.torsion_var, aiding.torque, stiffness)),
            hops=aiding.hops + 1,
        )
    return aiding
