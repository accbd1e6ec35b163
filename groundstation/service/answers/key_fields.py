"""The fields of every answer of the ground station, with what they mean; the unit stands in the name."""

from __future__ import annotations

from groundstation.service.alarms.crew_alarms import State
from groundstation.service.alarms.rig_alarms import KINDS, Health, Level
from groundstation.service.alarms.verdict import WINDS, Doubt, Word
from groundstation.service.answers.answer_fields import (
    Fields,
    group,
    integer,
    integers,
    mapping,
    number,
    numbers,
    rows,
    text,
    texts,
    truth,
)
from groundstation.service.orders.order_book import OrderState
from groundstation.service.orders.recalibration.recalibration_progress import Phase, Stage
from groundstation.survey.fusion.survey_trust import Trust
from groundstation.survey.wall.as_built import ColumnState
from telemetry.messages import Mode, NodeFlag, Severity

RIG_TIME = number("rig_time_s", "rig time now", null=True)
HEADER: Fields = (
    integer("revision", "grows with everything that the ground station takes in; of two answers the smaller is older"),
    text("utc", "when the ground station answered"),
    RIG_TIME,
)
TUBE = integer("tube", "number of the tube")
MD = number("md_m", "measured depth")
FLAGS = texts("flags", "trust in the own yaw", *(str(flag.name).lower() for flag in NodeFlag if flag))
YAW: Fields = (
    number("yaw_deg", "yaw"),
    number("sigma_yaw_deg", "random standard deviation of the yaw"),
    number("sigma_systematic_deg", "constant errors of joints; never averages away"),
)
ANGLES: Fields = (
    number("inclination_deg", "from the vertical"),
    number("azimuth_deg", "from north, clockwise"),
)
SIGMA_ANGLES: Fields = (
    number("sigma_inclination_deg", "standard deviation"),
    number("sigma_azimuth_deg", "standard deviation"),
)
POSITION: Fields = (
    number("north_m", "from the collar"),
    number("east_m", "from the collar"),
    number("tvd_m", "true vertical depth"),
    number("sigma_north_m", "standard deviation"),
    number("sigma_east_m", "standard deviation"),
    number("sigma_tvd_m", "standard deviation"),
)
COVARIANCE = numbers("covariance_m2", "of north, east, down", 2)

STATUS: Fields = (
    text("rig", "name"),
    number("bit_md_m", "measured depth of the bit", null=True),
    integer("tubes", "in the string"),
    integers("stale_tubes", "tubes that have been silent for too long"),
    integer("stations", "depths surveyed"),
    integer("measurements", "surveys that belong to a station"),
    integer("unplaced_measurements", "surveys without a known depth"),
    integer("refused_measurements", "surveys with invalid numbers"),
    integer("set_aside_measurements", "surveys of a faulty sensor, never fused"),
    integer("untrusted_measurements", "surveys whose yaw is taken for unknown"),
    text("health", "the worst of the rig's alarms; unknown where it cannot be told", *(h.name.lower() for h in Health)),
    integer("epoch", "of rig time: starts of the encoder so far, 0 unknown"),
    texts("alarms", "kinds that stand"),
)
SOME_WORDS = tuple(word.value for word in Word)
VERDICT: Fields = (
    text("rig", "name"),
    number("good_for_s", "after its arrival; who has heard no later verdict by then knows nothing"),
    text("verdict", "what the crew needs to know first", *SOME_WORDS),
    text("by_surveys", "what the surveys alone say, fresh or not", *SOME_WORDS),
    text("line", "all of it in a line"),
    text("todo", "what to do, in a line"),
    texts("why", "what it rests on, or why it is not known"),
    texts("doubts", "why it is not known, as words", *(doubt.value for doubt in Doubt)),
    number("bit_md_m", "measured depth of the bit", null=True),
    number("target_m", "length of the design axis"),
    text("what", "which deviation decided", "deviation", "projection", null=True),
    group(
        "off",
        (
            MD,
            number("deviation_cm", "from the design axis"),
            number("sigma_cm", "standard deviation of it"),
            number("limit_cm", "tolerance there"),
            number("used_percent", "of the tolerance; null where none is allowed", null=True),
            number("azimuth_deg", "towards which the hole is off"),
            text("wind", "the same as a word", *WINDS),
        ),
        null=True,
    ),
    group(
        "steer",
        (
            number("azimuth_deg", "towards which to steer"),
            text("wind", "the same as a word", *WINDS),
            number("before_md_m", "last depth from which a correction still helps", null=True),
            number("left_m", "of drilling until there", null=True),
        ),
        null=True,
    ),
)
STRING: Fields = (
    rows(
        "tubes",
        (
            TUBE,
            number("md_m", "measured depth of its node", null=True),
            number("age_s", "since its newest state", null=True),
            truth("stale", "silent for too long"),
        ),
    ),
)
NODE: Fields = (
    TUBE,
    number("at_s", "rig time of this state"),
    number("age_s", "since then", null=True),
    truth("stale", "silent for too long"),
    integer("hops", "distance from the encoder in tubes, -1 unknown"),
    text("mode", "execution state", *(mode.name.lower() for mode in Mode)),
    *YAW,
    numbers("gyro_bias_dps", "estimated bias of the gyroscope, x y z"),
    number("scale_factor", "estimated error of the gyroscope's z scale"),
    number("innovation_deg", "of the last aiding"),
    number("sigma_innovation_deg", "standard deviation of the innovation"),
    number("aiding_age_s", "since the last aiding used", null=True),
    number("sigma_clock_s", "of the node's rig time"),
    FLAGS,
    integer("cycles", "since its start"),
    integer("overruns", "cycles that ended too late"),
    number("upper_margin_db", "of the frames from above over the radio's threshold; null without a radio", null=True),
    number("lower_margin_db", "the same from below", null=True),
    integer("parameters_version", "of the parameter block in use, 0 is the identity"),
    text("parameters_hash", "first 8 bytes of its SHA-256, hexadecimal"),
    group(
        "alignment",
        (
            number("pitch_deg", "offset of the mount"),
            number("roll_deg", "offset of the mount"),
            number("sigma_deg", "of both"),
        ),
        null=True,
    ),
)
STATION: Fields = (
    integer("station", "number, from the collar down"),
    MD,
    *ANGLES,
    *SIGMA_ANGLES,
    number("transport_deg", "by which the string turns in the bent hole above: in the azimuth, not in measurements"),
    number("sigma_transport_deg", "standard deviation of that"),
    integer("measurements", "clusters measured here"),
    integer("dropped_measurements", "of them from before the hole moved"),
    integer("untrusted_measurements", "of them with a yaw that is taken for unknown"),
    number("sigma_yaw_deg", "root mean square of those that count"),
    number("sigma_systematic_deg", "root mean square of those that count"),
    number("sigma_force_mps2", "root mean square of those that count, one axis"),
    *POSITION,
)
STATIONS: Fields = (rows("stations", STATION),)
SEQ = integer("seq", "place in the stream since the ground station started, for `since`")
NEWEST = integer("newest", "`seq` of the newest row")
MEASUREMENT: Fields = (
    SEQ,
    integer("station", "number, from the collar down"),
    MD,
    TUBE,
    integer("sequence", "the tube's number of it"),
    integer("replaces", "the tube's number of the same survey before its yaw was known better", null=True),
    number("station_at_s", "rig time, end of the average"),
    integer("hops", "distance from the encoder in tubes"),
    *ANGLES,
    *SIGMA_ANGLES,
    *YAW,
    numbers("forces_mps2", "mean specific force of each IMU", 2),
    integer("samples", "in the mean"),
    number("settle_s", "between the stop and the end of the average"),
    FLAGS,
    text("trust", "what the flags make of it", *(trust.name.lower() for trust in (Trust.FULL, Trust.UNKNOWN_YAW))),
    texts("quality", "checks that it failed"),
)
MEASUREMENTS: Fields = (NEWEST, rows("measurements", MEASUREMENT))
STATION_MEASUREMENTS: Fields = (integer("station", "number"), rows("measurements", MEASUREMENT))
TRAJECTORY: Fields = (
    text("method", "how the stations are joined", "balanced-tangential"),
    rows("points", (MD, *ANGLES, *POSITION, COVARIANCE)),
)
EVENTS: Fields = (
    NEWEST,
    rows(
        "events",
        (
            SEQ,
            TUBE,
            integer("sequence", "the tube's number of it"),
            number("at_s", "rig time"),
            text("severity", "", *(severity.name.lower() for severity in Severity)),
            text("code", "what happened"),
            mapping("arguments", "of the event"),
        ),
    ),
)
STATIC_RECORDS: Fields = (
    NEWEST,
    rows(
        "static_records",
        (
            SEQ,
            TUBE,
            integer("sequence", "the tube's number of it"),
            integer("order", "number of the order that asked for it"),
            number("begun_at_s", "rig time"),
            number("ended_at_s", "rig time"),
            integer("samples", "in the means"),
            numbers("rate_rad_s", "mean, raw"),
            numbers("rate_cov_rad2_s2", "of one sample", 2),
            numbers("force_m_s2", "mean, raw"),
            numbers("force_cov_m2_s4", "of one sample", 2),
            number("temperature_c", "mean"),
            truth("moved", "it was not at rest all the time"),
        ),
    ),
)
STDS: Fields = POSITION[3:]
UNCERTAINTY: Fields = (
    number("confidence", "share of true positions inside"),
    number("sigma_plane", "standard deviations to the ellipse"),
    number("sigma_space", "standard deviations to the ellipsoid"),
    rows(
        "stations",
        (
            MD,
            COVARIANCE,
            group(
                "plan_ellipse",
                (
                    number("major_m", "semi-axis"),
                    number("minor_m", "semi-axis"),
                    number("azimuth_deg", "of the major one"),
                ),
            ),
            rows("ellipsoid", (number("semi_axis_m"), numbers("direction", "unit vector: north, east, down"))),
            mapping("sources", fields=STDS),
        ),
    ),
)
DEVIATION: Fields = (
    MD,
    number("along_m", "along the design axis"),
    number("north_cm", "from the design axis"),
    number("east_cm", "from the design axis"),
    number("deviation_cm", "from the design axis"),
    number("sigma_cm", "standard deviation of the deviation"),
    number("deviation_percent", "of the length"),
    number("direction_deg", "azimuth of the deviation"),
    number("limit_cm", "tolerance at this depth"),
    number("used_percent", "of the tolerance"),
    number("level_percent", "highest alarm level reached"),
)
COLUMN: Fields = (
    group(
        "design",
        (
            number("inclination_deg", "of the axis"),
            number("azimuth_deg", "of the axis"),
            number("target_m", "length of the axis"),
            number("radius_m", "of the finished column"),
            text("tolerance", "preset"),
        ),
    ),
    rows("stations", DEVIATION),
    group("worst", DEVIATION),
    group("projection", DEVIATION, null=True),
    group(
        "dominant",
        (
            text("angle", "which matters more for the position of the toe"),
            number("by_inclination_m", "part of the uncertainty"),
            number("by_azimuth_m", "part of the uncertainty"),
        ),
        null=True,
    ),
)
HISTORY: Fields = (
    rows(
        "moments",
        (
            integer("moment", "number, for `column?moment=`"),
            number("at_s", "rig time of its newest survey"),
            number("md_m", "measured depth of its newest station"),
            number("deviation_cm", "of the end, or before that is known of the worst station"),
            number("limit_cm", "tolerance there"),
            number("used_percent", "of the tolerance"),
        ),
    ),
)
ALARM: Fields = (
    text("kind", "", "deviation", "projection"),
    number("level_percent", "of the tolerance"),
    number("raised_at_s", "rig time of the survey that raised it"),
    MD,
    number("deviation_cm", "then"),
    number("sigma_cm", "standard deviation of the deviation"),
    number("threshold_cm", "passed"),
    number("cleared_at_s", "rig time", null=True),
)
RIG_ALARM: Fields = (
    text("code", "kind of alarm, see [operating](operate.md#what-the-crew-is-told)", *(kind.code for kind in KINDS)),
    text("level", "how much it matters", *(level.name.lower() for level in Level)),
    text("subject", "what it is about"),
    text("detail", "what is known of it"),
    number("raised_at_s", "rig time", null=True),
    number("cleared_at_s", "rig time; null while it stands", null=True),
    integer("count", "times it was raised"),
)
CREW_ALARM: Fields = (
    integer("number", "of the alarm, never used twice"),
    text("state", "", *State),
    text("code", "kind: of the rig's, or deviation, projection", *(k.code for k in KINDS), "deviation", "projection"),
    text("level", "how much it matters", *(level.name.lower() for level in Level)),
    text("subject", "what it is about"),
    text("detail", "what is known of it"),
    text("threshold", "that was passed"),
    number("md_m", "measured depth, where it is at one", null=True),
    number("azimuth_deg", "towards which the hole is off", null=True),
    text("wind", "the same as a word", *WINDS, null=True),
    number("since_s", "rig time at which it was raised", null=True),
    text("since_utc", "the same in UTC", null=True),
    integer("times", "that it was raised"),
    integer("count", "times that its cause was noticed"),
    text("acknowledged_by", "who", null=True),
    text("acknowledged_utc", "when", null=True),
    text("shelved_by", "who", null=True),
    text("shelved_until_utc", "when it is back", null=True),
    number("cleared_at_s", "rig time at which its cause was gone", null=True),
)
ALARMS: Fields = (
    rows("open", CREW_ALARM),
    rows("closed", CREW_ALARM),
    integer("raised_last_hour", "alarms, ten at most in a good run"),
    truth("flood", "more than ten were raised within ten minutes, and not yet fewer than five"),
    integer("left_out", "conditions for which there was no room among the open ones, milder than those"),
    numbers("levels_percent", "of the tolerance"),
    rows("active", ALARM),
    rows("cleared", ALARM),
    rows(
        "moved",
        (
            MD,
            number("at_s", "rig time"),
            integer("dropped_measurements", "that no longer count"),
            number("departure_sigma", "of the new survey from those before"),
            numbers("neighbours_sigma", "of the stations beside it"),
        ),
    ),
    rows("rig", RIG_ALARM),
    rows("rig_cleared", RIG_ALARM),
)
SENSOR: Fields = (numbers("matrix", "row = sensor axis", 2), numbers("bias_mps2", "at the reference temperature"))
RECALIBRATION: Fields = (
    text("state", "", *Stage),
    text("proposal", "hash to confirm"),
    rows(
        "attitudes",
        (
            integer("attitude", "number, from 1"),
            number("pitch_deg", "of the tubes' axis"),
            number("roll_deg", "about the tubes' axis"),
            number("told_at_s", "rig time at which it was entered"),
            number("left_at_s", "rig time; null while the tubes are there", null=True),
        ),
    ),
    rows(
        "tubes",
        (
            TUBE,
            text("phase", "", *Phase),
            text("detail", "why it is refused, or what is missing"),
            integer("records", "at rest so far"),
            integer("asked", "records asked for"),
            integer("version_before", "of the block in use at the beginning", null=True),
            text("hash_before", "of that block"),
            group("accelerometer_before", SENSOR, null=True),
            integer("version", "of the proposed block", null=True),
            text("hash_proposed", "of the proposed block"),
            group("accelerometer", SENSOR, null=True),
            integer("uploads", "begun"),
            truth("restarted", "while the block was on its way"),
            text("hash_after_restart", "of the block in use then"),
            text("hash", "that the tube reported at the end"),
            group(
                "solution",
                (
                    number("residual_rms_mps2", "of the fit"),
                    numbers("bias_std_mps2", "standard deviation, x y z"),
                    number("matrix_std", "largest of the nine"),
                    number("condition", "of the fit"),
                    group(
                        "inclination_rms_deg",
                        (number("before", "over the attitudes"), number("after", "over the attitudes")),
                    ),
                ),
                null=True,
            ),
        ),
    ),
)
ORDER: Fields = (
    integer("order", "number, never used twice"),
    number("at_s", "rig time at which it was accepted", null=True),
    text("ordered_utc", "the same in UTC"),
    text("by", "who ordered"),
    integer("tube", "null for an order to the ground station", null=True),
    text("command", "name"),
    text("action", "step of a command that has several"),
    mapping("arguments", "as they were ordered"),
    text("state", "", *OrderState),
    truth("done", "whether it was obeyed; null before the answer", null=True),
    text("detail", "why it was refused, or what happens now"),
    mapping("values", "of the reply, see the table of commands"),
)
ORDERS: Fields = (rows("orders", ORDER),)
WALL: Fields = (
    group(
        "wall",
        (
            text("name", "of the wall"),
            text("hole", "that is drilled here"),
            number("required_thickness_m", "of a joint"),
            number("allowed_probability", "of anything too thin"),
            text("verdict", "on these joints", "tight", "not_proven", "not_tight", null=True),
            text("problem", "why they cannot be judged", null=True),
            texts("findings", "what is open or doubtful"),
            rows(
                "holes",
                (
                    text("hole", "name; the first is the one that is drilled, the others are its neighbours"),
                    number("north_m", "of its head"),
                    number("east_m", "of its head"),
                    number("length_m", "of its design"),
                    number("drilled_to_m", "depth of its end", null=True),
                    number("surveyed_to_m", "depth of its last survey", null=True),
                ),
            ),
            rows(
                "joints",
                (
                    text("joint", "names of the two"),
                    text("state", "the worst along it", *(state.name.lower() for state in ColumnState)),
                    number("surveyed_percent", "of its depths, those at which both are surveyed"),
                    number("probability", "of being too thin, the largest; 1 where a hole is missing"),
                    number("depth_m", "where that is"),
                    number("probability_where_surveyed", "the largest where both are surveyed", null=True),
                    number("thickness_m", "the least, as surveyed", null=True),
                    number("thinnest_at_m", "where that is"),
                ),
            ),
            rows(
                "extra_columns",
                (
                    text("joint", "that would be closed"),
                    number("north_m", "of its head"),
                    number("east_m", "of its head"),
                    number("from_m", "where the joint is open"),
                    number("to_m", "where the joint is open"),
                    truth("closes", "whether one column is enough"),
                ),
            ),
        ),
        null=True,
    ),
)
CHANGES: Fields = (
    rows(
        "changes",
        (
            text("path", "below ground/, without those of a number"),
            integer("changed_at", "revision of its newest change"),
        ),
    ),
)
SCHEMA: Fields = (mapping("schemas", "JSON schema of the answer of each path, made from the code that answers"),)
