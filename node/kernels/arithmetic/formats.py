"""Formats of the integers and units of the floats: what one unit of each number of a kernel stands for.

A number in ``Qn`` is an integer that stands for itself times 2^-n. Biases, scale and stamp are counted in units of 2^-6
of their SI unit, so that every variance fits one format, ``Q56`` of unit^2: see docs/decisions/0011-fixed-point.md.
"""

from __future__ import annotations

from typing import Any, Final, TypeAlias

import numpy as np

Array: TypeAlias = "np.ndarray[Any, np.dtype[Any]]"
CYCLE_RATE_HZ: Final = 1.9
PERIOD: Final = 1.0 / CYCLE_RATE_HZ
DEG: Final = float(np.pi / 180.0)
TIME_Q: Final = 28  # s, 3.7 ns
RATE_Q: Final = 46  # rad/s, also of the scale (1) and the stamp (s): read as Q40 they count units of 2^-6
VECTOR_Q: Final = 30  # of the unit vector down
FORCE_Q: Final = 26  # g
ANGLE_Q: Final = 40  # rad, residuals and corrections; whole yaws are binary angles
STEP_Q: Final = RATE_Q + TIME_Q - 31  # rad, a rate times a time
VAR_Q: Final = 56  # unit^2
FACTOR_Q: Final = 24  # of the squares of the factors A and B, at most 128
TAU_Q: Final = 20  # s, of twice the time constant of a bias, at most 2048
UNIT: Final = 6  # of biases, scale and stamp: 2^-6 rad/s, 2^-6, 2^-6 s; tilts and yaw count rad
ONE_SECOND: Final = 1 << TIME_Q
LONGEST_STEP: Final = 8 << TIME_Q  # a factor of 31 bits
FAST: Final = 8 << RATE_Q  # rad/s, above which a step is one second at most
LONGEST_GAP: Final = 4096 << TIME_Q  # of lost cycles that is integrated
CEILING: Final = 12 << VAR_Q  # of any variance
NEVER: Final = -(1 << 62)  # a time before all others
FASTEST: Final = 32 << RATE_Q  # rad/s in a reading
STRONGEST: Final = 32 << FORCE_Q  # g in a reading
LEVEL_Q: Final = 31  # of factors between -1 and 1
WEIGHT_Q: Final = 24  # of a weight and a noise, relative to the configuration's, in integers
MEAN_Q: Final = RATE_Q  # of the means of rates and of forces: far finer than the noise of a reading
RATE_PART, FORCE_PART = 25, 22  # Q of a product of deviations is the sum of its two
PRODUCT_Q: Final = 46  # of products of directions, in integers
SQUARE_Q: Final = 32  # of squares of angles, rad^2
TORQUE_Q: Final = 20  # N m, in integers
STIFFNESS_Q: Final = TORQUE_Q + 30 - ANGLE_Q  # N m/rad
TURNS_Q: Final = 24  # of a number of turns, in integers: at most 128
