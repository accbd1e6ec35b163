"""The two forms of the filter side by side: where each function stands, and what it takes in floats and in integers.

A rule of the filter is written twice, in ``float64`` and in ``fixed``. A change of one form changes this table, and
with it sees the other: tests/node/test_two_filters.py compares the table with the functions of both, so that none of
them gains or loses a function or an argument by itself. An argument is written as ``name`` or ``name:format``, where it
is not called as its format is.
"""

from __future__ import annotations

from typing import Final, NamedTuple

from node.kernels.arithmetic.formats import (
    ANGLE_Q,
    FORCE_Q,
    LEVEL_Q,
    RATE_Q,
    TIME_Q,
    VAR_Q,
    VECTOR_Q,
)


class NumberFormat(NamedTuple):
    """Unit of the floats and of the integers, and the Q of these; None: the same whole number, or record, in both."""

    floats: str
    integers: str
    q: int | None


class TwoForms(NamedTuple):
    """A function of both forms: the module of each, its arguments and what it returns.

    ``integers_take`` is empty where the integers take what the floats do.
    """

    name: str
    floats_in: str
    integers_in: str
    takes: str
    integers_take: str = ""
    gives: str = ""


UNITS: Final = "of the states"  # rad, rad/s and what they have of it: integers count biases, scale and stamp in 2^-6
FORMATS: Final = {
    "state": NumberFormat("STATE", "FIXED_STATE", None),
    "config": NumberFormat("CONFIG", "FIXED_CONFIG", None),
    "count": NumberFormat("1", "1", None),
    "flag": NumberFormat("0 or 1", "0 or 1", None),
    "status": NumberFormat("bits", "bits", None),
    "binary": NumberFormat("2^-32 turns", "2^-32 turns", None),
    "switch": NumberFormat("0.0 or 1.0", "0 or 1", 0),
    "time": NumberFormat("s", "s", TIME_Q),
    "rate": NumberFormat("rad/s", "rad/s", RATE_Q),
    "force": NumberFormat("m/s^2", "g", FORCE_Q),
    "yaw": NumberFormat("rad", "2^-32 turns", 0),
    "residual": NumberFormat("rad", "rad", ANGLE_Q),
    "var": NumberFormat("rad^2", "rad^2", VAR_Q),
    "covariance": NumberFormat(UNITS, UNITS, VAR_Q),
    "row": NumberFormat("1", "1", LEVEL_Q),  # of H
    "decay": NumberFormat("1", "1", LEVEL_Q),
    "down": NumberFormat("1", "1", VECTOR_Q),
    "gain": NumberFormat("1", "1", None),  # 31 bits and an exponent, in the record of the integers
    "mantissa": NumberFormat("", "1", None),  # of 1 / S, likewise
}
ROW: Final = "a:count ha:row b:count hb:row"  # H of the integers: its one or two terms
PAIRS: Final = (
    TwoForms(
        "run_cycle",
        "float64.cycle",
        "fixed.cycle",
        "state config rate force start:time end:time joined:flag",
        gives="status",
    ),
    TwoForms("filter_due_cycles", "float64.fixed_lag", "fixed.fixed_lag", "state config", gives="status"),
    TwoForms(
        "take_pending",
        "float64.fixed_lag",
        "fixed.fixed_lag",
        "state config cycle:count until:time",
        gives="status",
    ),
    TwoForms(
        "aid_late",
        "float64.fixed_lag",
        "fixed.fixed_lag",
        "state config yaw var at:time",
        gives="status",
    ),
    TwoForms(
        "apply_aiding",
        "float64.fixed_lag",
        "fixed.aiding",
        "state config yaw r_var:var rate at:time",
        gives="status",
    ),
    TwoForms("reset_yaw", "float64.fixed_lag", "fixed.aiding", "state config yaw var"),
    TwoForms("advance_epoch", "float64.fixed_lag", "fixed.fixed_lag", "state config cycle:count until:time"),
    TwoForms(
        "integrate_cycle",
        "float64.fixed_lag",
        "fixed.fixed_lag",
        "state config cycle:count begin:time end:time yaw:binary down P:covariance",
        gives="binary",
    ),
    TwoForms(
        "mean_spin",
        "float64.fixed_lag",
        "fixed.fixed_lag",
        "state cycle:count begin:time end:time",
        gives="rate",
    ),
    TwoForms("missed_var", "float64.fixed_lag", "fixed.fixed_lag", "state cycle:count gap:time", gives="var"),
    TwoForms(
        "interpolation_var",
        "float64.fixed_lag",
        "fixed.fixed_lag",
        "state cycle:count at:time",
        gives="var",
    ),
    TwoForms("predict_to_now", "float64.fixed_lag", "fixed.fixed_lag", "state config"),
    TwoForms(
        "propagate_covariance",
        "float64.propagation",
        "fixed.propagation",
        "P:covariance wz:rate dt:time turning:switch config",
        "state P:covariance wz:rate dt:time turning:switch config",
    ),
    TwoForms(
        "add_process_noise",
        "float64.propagation",
        "fixed.propagation",
        "P:covariance dt:time turning:switch fx:decay fy:decay fz:decay config",
        "P:covariance dt:time turning:switch f:decay config",
    ),
    TwoForms(
        "rotate_down",
        "float64.strapdown",
        "fixed.strapdown",
        "down wx:rate wy:rate wz:rate dt:time",
        "down ax:down ay:down az:down s:down c:down",
    ),
    TwoForms(
        "yaw_rate",
        "float64.strapdown",
        "fixed.strapdown",
        "down wx:rate wy:rate wz:rate",
        gives="rate",
    ),
    TwoForms(
        "innovation_var",
        "float64.update",
        "fixed.update",
        "P:covariance h:row r_var:var ph:covariance",
        f"state {ROW} r_var:var",
        gives="var",
    ),
    TwoForms(
        "joseph_update",
        "float64.update",
        "fixed.update",
        "P:covariance ph:covariance s:var gain",
        "state s:var",
    ),
    TwoForms(
        "correct_states",
        "float64.update",
        "fixed.update",
        "state s:var residual",
        f"state {ROW} s:var residual",
    ),
    TwoForms("feed_back", "float64.update", "fixed.update", "state residual"),
    TwoForms("zero_rate", "float64.update", "fixed.update", "state rate dt:time config"),
    TwoForms("level_by_force", "float64.update", "fixed.update", "state force config"),
    TwoForms(
        "propagate_survey_covariance", "smoothing", "fixed.propagation", "state wz:rate dt:time turning:switch config"
    ),
    TwoForms(
        "look_back",
        "smoothing",
        "fixed.update",
        "state s:var residual",
        "state shared:count mantissa exponent:count residual",
    ),
)
ALONE: Final = {  # functions of one form, and why the other has none
    "float64.fixed_lag.spin_slope": "the integers take it by the length of a cycle, inside ``mean_spin``",
    "float64.propagation.symmetrise_covariance": "the integers compute one triangle: ``mirror_upper_triangle``",
    "float64.update.clear_row": "the integers give H by its terms",
    "float64.update.intersect_covariance": "a node in integers refuses the scheme",
    "smoothing.begin_smoothing": "it copies, so it serves both",
    "fixed.fixed_lag.true_rate_z": "a quotient of the floats",
    "fixed.fixed_lag.gap_held": "a gap of any length fits the floats",
    "fixed.fixed_lag.carry_survey": "a step of any length fits the floats",
    "fixed.fixed_lag.gap_angle": "a product of the floats",
    "fixed.fixed_lag.curvature_var": "a term of ``interpolation_var`` of the floats",
    "fixed.fixed_lag.lag_var": "a line of ``aid_late`` of the floats",
    "fixed.propagation.update_bias_decays": "three exponentials of the floats",
    "fixed.propagation.transform_covariance": "two loops in ``propagate_covariance`` of the floats",
    "fixed.propagation.mirror_upper_triangle": "``symmetrise_covariance`` of the floats",
    "fixed.propagation.limit_variance": "a variance of any size fits the floats",
    "fixed.propagation.mirror_of": "part of ``limit_variance``",
    "fixed.propagation.widen_variance": "a sum of the floats",
    "fixed.strapdown.half_turn": "inside ``rotate_down`` of the floats",
    "fixed.strapdown.normalise_down": "inside ``rotate_down`` of the floats",
    "fixed.update.state_correction": "a product of the floats",
}
