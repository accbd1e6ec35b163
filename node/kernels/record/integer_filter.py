"""Memory of the filter in integers: records of its state and its configuration.

Formats and units are those of ``node.kernels.arithmetic.formats``.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import VAR_Q
from node.kernels.record.filter_record import PARTS, PENDING, RECENT, RING, STATES, UNKNOWN_YAW_VAR

UNKNOWN_VAR: Final = round(UNKNOWN_YAW_VAR * 2.0**VAR_Q)  # rad^2

FIXED_STATE: Final = np.dtype(
    [
        ("overflows", "i8"),  # results that did not fit and were held at the end of their range
        # the filter, at its own epoch
        ("epoch", "i8"),  # s, Q28
        ("yaw", "u4"),  # binary angle, 2^32 is one turn
        ("yaw_known", "i8"),
        ("down", "i8", (3,)),  # Q30
        ("static_bias", "i8", (3,)),  # rad/s, Q46
        ("static_bias_var", "i8", (3,)),  # unit^2, Q56
        ("bias", "i8", (3,)),  # rad/s, Q46
        ("scale", "i8"),  # Q46
        ("stamp", "i8"),  # s, Q46
        ("P", "i8", (STATES, STATES)),  # unit^2, Q56
        # the same, predicted to the end of the newest cycle
        ("now", "i8"),
        ("now_yaw", "u4"),
        ("now_down", "i8", (3,)),
        ("now_rate", "i8"),
        ("now_P", "i8", (STATES, STATES)),
        # aiding
        ("reference_hops", "i8"),
        ("reference_offset", "u4"),  # binary angle
        ("systematic_var", "i8"),  # rad^2, Q56
        ("last_sequence", "i8"),
        ("last_aided", "i8"),  # s, Q28
        ("innovation", "i8"),  # rad, Q40
        ("innovation_var", "i8"),  # rad^2, Q56
        ("rejected", "i8"),
        ("pending", "i8"),
        ("pending_at", "i8", (PENDING,)),
        ("pending_yaw", "u4", (PENDING,)),
        ("pending_var", "i8", (PENDING,)),
        ("pending_sequence", "i8", (PENDING,)),
        # the increments of the last RING cycles
        ("cycles", "i8"),
        ("consumed", "i8"),
        ("ring_start", "i8", (RING,)),
        ("ring_end", "i8", (RING,)),
        ("ring_rate", "i8", (RING, 3)),  # rad/s, Q46
        ("ring_force", "i8", (RING, 3)),  # g, Q26
        ("ring_quiet", "i8", (RING,)),
        ("ring_split", "i8", (RECENT,)),
        ("ring_parts", "i8", (RECENT, PARTS)),  # rad/s, Q46
        # modes
        ("mode", "i8"),
        ("still_cycles", "i8"),
        ("stopped_at", "i8"),
        ("surveyed", "i8"),
        ("rate_exceeded", "i8"),
        ("bias_count", "i8"),
        ("bias_sum", "i8", (3,)),  # rad/s, Q46
        # the last survey
        ("survey_force", "i8", (3,)),  # g, Q26
        ("survey_force_cov", "i8", (3, 3)),  # g^2, Q52
        ("smoothing", "i8"),
        ("surveyed_yaw", "u4"),  # binary angle
        ("surveyed_var", "i8"),  # rad^2, Q56
        ("surveyed_with", "i8", (STATES,)),  # rad units, Q56
        # work space of the updates
        ("ph", "i8", (STATES,)),  # P H^T, Q56
        ("rest", "i8", (STATES,)),  # P H^T - S K, what rounding left
        ("gain", "i8", (STATES,)),  # K 2^gain_q
        ("gain_q", "i8"),
        ("decay", "i8", (3,)),  # Q31
    ],
    align=True,
)

FIXED_CONFIG: Final = np.dtype(
    [
        ("changes", "i8"),  # how often it changed while the node ran
        ("rate_noise", "i8", (3,)),  # N^2, unit^2 s, Q56
        ("attitude_var", "i8"),  # A^2, Q24
        ("bias_factor_var", "i8"),  # B^2, Q24
        ("twice_tau", "i8", (3,)),  # s, Q20
        ("boot_bias_var", "i8"),  # unit^2, Q56
        ("scale_var", "i8"),  # unit^2, Q56
        ("stamp_std", "i8"),  # s, Q28
        ("gravity", "i8"),  # g, Q26
        ("walk", "i8", (3,)),  # (A N)^2, rad^2/s, Q56
        ("rate_walk", "i8", (3,)),  # (A N)^2, unit^2 s, Q56
        ("noise_var", "i8", (3,)),  # N^2, rad^2/s, Q56
        ("bias_var", "i8", (3,)),  # sigma_b^2, unit^2, Q56
        ("bias_drive", "i8", (3,)),  # (B sigma_b)^2, unit^2, Q56
        ("bias_area", "i8", (3,)),  # N^2 + 2 sigma_b^2 tau, unit^2 s, Q56
        ("bias_decay", "i8", (3,)),  # log2(e) / tau, 1/s, Q42
        ("still_walk_var", "i8"),  # rad^2/s, Q56
        ("stamp_on", "i8"),  # 1 when the time-stamp state is estimated
        ("stamp_var", "i8"),  # unit^2, Q56
        ("stamp_walk_var", "i8"),  # unit^2/s, Q56
        ("aiding_floor_var", "i8"),  # rad^2, Q56
        ("force_var", "i8"),  # g^2, Q56
        ("gate_inverse", "i8"),  # 1 / gate^2, Q31
        ("reject_limit", "i8"),
        ("rate_limit", "i8"),  # rad/s, Q46
        ("still_rate", "i8"),  # rad/s, Q46
        ("lag_cycles", "i8"),
        ("survey_samples", "i8"),
        ("settle_cycles", "i8"),
        ("static_cycles", "i8"),
    ],
    align=True,
)
