"""Columns of the studies' tables: key of a row and its heading."""

from __future__ import annotations

from sim.studies.study import Columns


def plain_columns(*keys: str) -> Columns:
    """Columns headed by their key."""
    return tuple((key, key) for key in keys)


HOPS: Columns = tuple((f"hop_{k}", f"hop {k}") for k in range(1, 6))
CASES = plain_columns("case", "published", "ours", "unit")
INTERVALS = plain_columns("case", "quantity", "published", "ours", "low", "high", "unit", "to_reach", "reached")
INTERVALS_SHOWN: Columns = (
    ("case", "case"),
    ("quantity", "rms, deg, of"),
    ("published", "published"),
    ("ours", "ours"),
    ("interval", "95 %"),
    ("to_reach", "to reach"),
    ("reached", "reached"),
)
RELAY: Columns = (
    ("scheme", "scheme"),
    ("hop", "hop"),
    ("yaw_rms_rest_deg", "yaw rms at rest, deg"),
    ("yaw_rms_turning_deg", "turning, deg"),
    ("nees_rest", "NEES at rest"),
    ("nees_turning", "turning"),
    ("nees_total", "with joints"),
    ("published", "studied, at rest"),
)
MWD: Columns = (
    ("design", "design"),
    ("parameters", "parameters"),
    ("converged", "converged"),
    ("iterations_median", "iterations, median"),
    ("iterations_max", "largest"),
    ("magnetometer_iterations_max", "largest, magnetometers"),
    ("size_before_median", "G_L error before, g"),
    ("size_after_max", "after, worst tool, g"),
    ("published", "asked, g"),
    ("tilt_before_median_deg", "tilt error before, deg"),
    ("tilt_after_max_deg", "after, worst tool, deg"),
    ("within_reach", "tools within reach"),
    ("warned", "warned of the design"),
    ("control_passed_before", "control passed before"),
    ("control_passed_after", "after"),
    ("cost_difference_max", "E beside another solver"),
    ("time_over_other", "time over its, with our Jacobian"),
    ("time_over_other_alone", "without"),
)
ALLAN: Columns = (
    ("axis", "axis"),
    ("quantity", "quantity"),
    ("unit", "unit"),
    ("published", "truth"),
    ("ours", "mean estimate"),
    ("median_error_percent", "median error, %"),
    ("error_95_percent", "95th percentile, %"),
    ("raw_error_percent", "raw reading, mean error, %"),
    ("coverage_95", "95 % intervals that hold"),
)
COVERAGE: Columns = (
    ("case", "case"),
    ("published", "claimed, %"),
    ("ours", "inside, %"),
    ("half_interval", "+- (95 %)"),
    ("unit", "unit"),
)
REGION: Columns = (*CASES, ("ratio", "ratio"))
FILTERED: Columns = (
    ("instrument", "instrument"),
    ("station", "station"),
    ("unfiltered_cm", "gyro, cm"),
    ("filtered_cm", "0.25 deg azimuth, cm"),
)
MAGNETIC: Columns = (
    ("station", "station"),
    ("as_printed_deg", "as printed, deg"),
    ("magnetic_deg", "magnetic, deg"),
    ("filtered_deg", "filtered, deg"),
)
PRINTED = plain_columns("instrument", "station", "axis", "published", "as_printed", "ratio", "ours", "unit")
READINGS: Columns = (
    ("reading", "accelerometers across"),
    ("unfiltered_cm", "gyro, cm"),
    ("filtered_cm", "0.25 deg azimuth, cm"),
    ("ratio", "ratio"),
    ("published", "published"),
)
SWEEPS = plain_columns("changed", "value_deg", "scheme", "station", "north_cm", "east_cm", "tvd_cm")
TUNING: Columns = (
    ("case", "case"),
    ("published", "published"),
    ("ours", "bias converged"),
    ("unit", "unit"),
    ("to_reach", "to reach"),
    ("reached", "reached"),
    ("left_dps", "error left, deg/s"),
    ("scatter_dps", "scatter, deg/s"),
    ("yaw_rms_deg", "yaw rms at rest, deg"),
)
CONSISTENCY: Columns = (
    ("case", "case"),
    ("yaw_rms_deg", "yaw rms, deg"),
    ("yaw_sigma_deg", "stated sigma, deg"),
    ("nees", "NEES"),
    ("nees_total", "with joints and mounts"),
    ("published", "studied"),
    ("ours", "ours"),
    ("unit", "unit"),
)
HONESTY: Columns = (
    ("case", "case"),
    ("count", "epochs"),
    ("yaw_rms_deg", "yaw rms, deg"),
    ("nees", "NEES"),
    ("nees_low", "low"),
    ("nees_high", "high"),
    ("nees_total", "with joints and mounts"),
    ("nees_total_low", "low"),
    ("nees_total_high", "high"),
    ("inside_95_percent", "inside 95 %, %"),
    ("inside_low", "low"),
    ("inside_high", "high"),
)
OUTAGE: Columns = (("case", "case"), *HOPS, *plain_columns("published", "ours", "unit", "to_reach", "reached"))
OUTAGE_SHOWN: Columns = (("case", "case"), *HOPS, ("reached", "reached"))
ALIGNMENT = plain_columns("case", "quantity", "published", "ours", "low", "high", "unit")
ALIGNMENT_SHOWN: Columns = (
    ("case", "case"),
    ("quantity", "quantity"),
    ("published", "published"),
    ("ours", "ours, rms"),
    ("interval", "95 %"),
    ("unit", "unit"),
)
SOIL_LINK = plain_columns(
    "case", "published", "ours", "low", "high", "difference", "holds", "stated_low", "stated_high", "unit"
)
SOIL_MAP = plain_columns("texture", "sand", "clay", "water_percent", "distance_m", "received_dbm", "margin_db")
SOIL_DELIVERY = plain_columns("quantity", "expected", "ours", "unit")
PIPE_LINK = plain_columns("case", "published", "ours", "difference_percent", "unit")
PIPE_GRADES = plain_columns(
    "grade", "carbon_percent", "temperature_c", "resistivity_1e_8_ohm_m", "te11_db_per_m", "reach_m"
)
INGREDIENTS: Columns = (("mode", "mode"), *INTERVALS)
INGREDIENTS_SHOWN: Columns = (
    ("case", "case"),
    ("mode", "aiding"),
    ("quantity", "rms, deg, of"),
    ("ours", "ours"),
    ("interval", "95 %"),
    ("published", "studied"),
)
FIXED_POINT: Columns = (
    ("case", "case"),
    ("cycles", "cycles"),
    ("yaw_max_deg", "yaw, largest, deg"),
    ("yaw_rms_deg", "rms, deg"),
    ("sigma_max", "sigma, largest, of 1"),
    ("overflows", "overflows"),
    ("status_differs", "status differs"),
)
FIXED_POINT_NEES: Columns = (
    ("kernel", "kernel"),
    ("hop", "hop"),
    ("yaw_rms_rest_deg", "yaw rms at rest, deg"),
    ("yaw_rms_turning_deg", "turning, deg"),
    ("nees_rest", "NEES at rest"),
    ("nees_turning", "turning"),
    ("nees_total", "with joints"),
)
LIMITS: Columns = (
    ("case", "case"),
    ("quantity", "quantity"),
    ("ours", "ours, deg"),
    ("low", "low"),
    ("high", "high"),
    ("to_reach", "to reach"),
    ("reached", "reached"),
    ("bound", "bound, deg"),
    ("ratio", "of the bound"),
    ("nees", "NEES"),
)
BRIDGING: Columns = (
    ("case", "case"),
    ("quantity", "quantity"),
    ("alone_deg", "bound of one, deg"),
    ("together_deg", "of ten together"),
    ("play_deg", "play that takes it, deg"),
    ("azimuth_alone_deg", "azimuth of 32 points, one, deg"),
    ("azimuth_together_deg", "ten"),
)
WORLDS: Columns = (
    ("case", "case"),
    ("quantity", "rms, deg, of"),
    ("published", "published"),
    ("to_reach", "to reach"),
    ("assumed", "assumed world"),
    ("assumed_low", "low"),
    ("assumed_high", "high"),
    ("assumed_nees", "NEES"),
    ("rough", "rough world"),
    ("rough_low", "low"),
    ("rough_high", "high"),
    ("rough_nees", "NEES"),
)
WORLDS_CONSISTENCY: Columns = (
    ("case", "case"),
    ("assumed_deg", "assumed world: yaw rms, deg"),
    ("assumed_nees", "NEES"),
    ("rough_deg", "rough world: yaw rms, deg"),
    ("rough_nees", "NEES"),
)
FORCE_BIAS: Columns = (
    ("case", "inclination, stop"),
    ("azimuth_measured_deg", "azimuth rms as measured, deg"),
    ("azimuth_corrected_deg", "under the blocks of the stop before, deg"),
    ("azimuth_nees", "NEES of that"),
    ("bias_xy_mg", "bias rms across, mg"),
    ("stated_xy_mg", "stated"),
    ("bias_z_mg", "along, mg"),
    ("stated_z_mg", "stated"),
    ("bias_nees", "NEES of the bias"),
)
BENT: Columns = (
    ("case", "hole"),
    ("string", "string"),
    ("told", "the ground station was told"),
    ("azimuth_rms_deg", "azimuth rms, deg"),
    ("azimuth_nees", "NEES"),
    ("toe_rms_cm", "toe rms, cm"),
    ("toe_nees", "NEES in plan"),
    ("inside_percent", "toes inside 95 %, %"),
    ("between_cm", "toe between stations, cm"),
)
FIELD: Columns = (
    ("case", "disturbance"),
    ("yaw_rms_turning_deg", "yaw rms turning, deg"),
    ("yaw_rms_rest_deg", "at rest, deg"),
    ("nees_turning", "NEES turning"),
    ("nees_rest", "at rest"),
    ("unflagged_percent", "unflagged beyond 3 sigma, %"),
    ("told_percent", "told of, %"),
    ("gyro_step", "gyro_step a run"),
    ("gyro_scale", "gyro_scale"),
    ("other_faults", "others"),
    ("surveys_percent", "surveys, %"),
    ("azimuth_rms_deg", "azimuth rms, deg"),
    ("reached", "reached"),
)
FIELD_SHOWN: Columns = (
    *FIELD,
    ("sharpness_turning", "sigma over error turning"),
    ("sharpness_rest", "at rest"),
    ("sharp", "sharp"),
)
PROJECTION: Columns = (
    ("case", "from"),
    ("inside_percent", "inside the cone of 95 %, %"),
    ("radius_cm", "median radius, cm"),
    ("rms_cm", "rms on an axis, cm"),
    ("score_cm", "score, cm"),
    ("score_straight_cm", "straight on, cm"),
    ("score_constant_cm", "curvature of now, cm"),
    ("deadline_percent", "within the distance of the deadline, %"),
)
INSIDE: Columns = (
    ("case", "holes"),
    ("holes", "number"),
    ("inside_percent", "inside the cone of 95 %, %"),
    ("least_percent", "at the worst depth, %"),
    ("most_percent", "at the best, %"),
)
RELIABILITY: Columns = (
    ("case", "chance"),
    ("from", "foreseen from"),
    ("holes", "holes"),
    ("stated_percent", "stated, %"),
    ("observed_percent", "observed, %"),
)
