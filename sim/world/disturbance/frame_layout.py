"""Places of what is summed over the frames of a rough world, and how fine the grid of the sums is."""

from __future__ import annotations

from typing import Final

FINER: Final = 4  # than the frames is the grid of their sums
FELT: Final = 6  # rates (rad/s) and forces without the circle about the axis (m/s^2)
MOVED: Final = 4  # that circle (m/s^2), and rate (rad/s) and angle (rad) by which the string runs ahead of the head
SUMS: Final = FELT + MOVED + 1  # with the torsional vibration, rad/s
CIRCLE, SLACK_RATE, SLACK_ANGLE, TORSIONAL = FELT, FELT + 2, FELT + 3, FELT + MOVED  # places of sums
