// Answers of the ground station, made from its classes: python docs/make_page_types.py

/** What every answer begins with. */
export interface AnswerHeader {
  /** grows with everything that the ground station takes in; of two answers the smaller is older */
  revision: number;
  /** when the ground station answered */
  utc: string;
  /** rig time now */
  rig_time_s: number | null;
}

/** Rig time, depth, counts, health. */
export interface StatusAnswer {
  /** name */
  rig: string;
  /** measured depth of the bit */
  bit_md_m: number | null;
  /** in the string */
  tubes: number;
  /** tubes that have been silent for too long */
  stale_tubes: number[];
  /** depths surveyed */
  stations: number;
  /** surveys that belong to a station */
  measurements: number;
  /** surveys without a known depth */
  unplaced_measurements: number;
  /** surveys with invalid numbers */
  refused_measurements: number;
  /** surveys of a faulty sensor, never fused */
  set_aside_measurements: number;
  /** surveys whose yaw is taken for unknown */
  untrusted_measurements: number;
  /** the worst of the rig's alarms; unknown where it cannot be told */
  health: "good" | "degraded" | "unknown" | "bad";
  /** of rig time: starts of the encoder so far, 0 unknown */
  epoch: number;
  /** kinds that stand */
  alarms: string[];
}

/** How far off the hole is, at which measured depth, and towards which azimuth. */
export interface Off {
  /** measured depth */
  md_m: number;
  /** from the design axis */
  deviation_cm: number;
  /** standard deviation of it */
  sigma_cm: number;
  /** it is within this of the deviation with 95 % */
  half_width_cm: number;
  /** chance that it is within the limit */
  within_percent: number;
  /** tolerance there */
  limit_cm: number;
  /** of the tolerance; null where none is allowed */
  used_percent: number | null;
  /** towards which the hole is off */
  azimuth_deg: number;
  /** the same as a word */
  wind: "N" | "NNE" | "NE" | "ENE" | "E" | "ESE" | "SE" | "SSE" | "S" | "SSW" | "SW" | "WSW" | "W" | "WNW" | "NW" | "NNW";
}

/** Where to steer to, and the last depth from which that makes it sure that the hole ends within its limit. */
export interface Steer {
  /** towards which to steer */
  azimuth_deg: number;
  /** the same as a word */
  wind: "N" | "NNE" | "NE" | "ENE" | "E" | "ESE" | "SE" | "SSE" | "S" | "SSW" | "SW" | "WSW" | "W" | "WNW" | "NW" | "NNW";
  /** last depth from which a correction makes the end sure */
  before_md_m: number;
  /** of drilling until there; less than 0 once it has been passed */
  left_m: number | null;
  /** whether it has been passed */
  missed: boolean;
  /** chance of ending within that a correction is to bring */
  sure_percent: number;
  /** chance that a correction from now on brings */
  best_percent: number;
  /** most by which the rig bends the hole back, as it was stated */
  bend_deg_per_m: number;
}

/** on_target, watch, steer, out or dont_know, with its reasons; good for good_for_s after its arrival. */
export interface Verdict {
  /** name */
  rig: string;
  /** after its arrival; who has heard no later verdict by then knows nothing */
  good_for_s: number;
  /** what the crew needs to know first */
  verdict: "on_target" | "watch" | "steer" | "out" | "dont_know";
  /** what the surveys alone say, fresh or not */
  by_surveys: "on_target" | "watch" | "steer" | "out" | "dont_know";
  /** all of it in a line */
  line: string;
  /** what to do, in a line */
  todo: string;
  /** what it rests on, or why it is not known */
  why: string[];
  /** why it is not known, as words */
  doubts: ("no_survey" | "stale" | "depth" | "clock" | "yaw" | "uncertain" | "setup" | "unchecked" | "contradiction")[];
  /** measured depth of the bit */
  bit_md_m: number | null;
  /** length of the design axis */
  target_m: number;
  /** which deviation decided */
  what: "deviation" | "projection" | null;
  /** by which the toe may be off if the tube errs that read the last station alone */
  unfound_cm: number;
  /** by which the toe may be off if the encoder slips a little at every stop, too little to be found */
  unfound_drift_cm: number;
  off: Off | null;
  steer: Steer | null;
}

/** One tube of the string. */
export interface StringTube {
  /** number of the tube */
  tube: number;
  /** measured depth of its node */
  md_m: number | null;
  /** since its newest state */
  age_s: number | null;
  /** silent for too long */
  stale: boolean;
}

/** Tubes from top to bottom. */
export interface StringAnswer {
  tubes: StringTube[];
}

/** One station of the hole, fused. */
export interface Station {
  /** number, from the collar down */
  station: number;
  /** measured depth */
  md_m: number;
  /** from the vertical */
  inclination_deg: number;
  /** from north, clockwise */
  azimuth_deg: number;
  /** standard deviation */
  sigma_inclination_deg: number;
  /** standard deviation */
  sigma_azimuth_deg: number;
  /** by which the string turns in the bent hole above: in the azimuth, not in measurements */
  transport_deg: number;
  /** standard deviation of that */
  sigma_transport_deg: number;
  /** clusters measured here */
  measurements: number;
  /** of them from before the hole moved */
  dropped_measurements: number;
  /** of them with a yaw that is taken for unknown */
  untrusted_measurements: number;
  /** root mean square of those that count */
  sigma_yaw_deg: number;
  /** root mean square of those that count */
  sigma_systematic_deg: number;
  /** root mean square of those that count, one axis */
  sigma_force_mps2: number;
  /** from the collar */
  north_m: number;
  /** from the collar */
  east_m: number;
  /** true vertical depth */
  tvd_m: number;
  /** standard deviation */
  sigma_north_m: number;
  /** standard deviation */
  sigma_east_m: number;
  /** standard deviation */
  sigma_tvd_m: number;
}

/** All stations, fused. */
export interface StationsAnswer {
  stations: Station[];
}

/** One survey of one node. */
export interface MeasurementRow {
  /** place in the stream since the ground station started, for `since` */
  seq: number;
  /** number, from the collar down */
  station: number;
  /** measured depth */
  md_m: number;
  /** number of the tube */
  tube: number;
  /** the tube's number of it */
  sequence: number;
  /** the tube's number of the same survey before its yaw was known better */
  replaces: number | null;
  /** rig time, end of the average */
  station_at_s: number;
  /** distance from the encoder in tubes */
  hops: number;
  /** from the vertical */
  inclination_deg: number;
  /** from north, clockwise */
  azimuth_deg: number;
  /** standard deviation */
  sigma_inclination_deg: number;
  /** standard deviation */
  sigma_azimuth_deg: number;
  /** yaw */
  yaw_deg: number;
  /** random standard deviation of the yaw */
  sigma_yaw_deg: number;
  /** constant errors of joints; never averages away */
  sigma_systematic_deg: number;
  /** mean specific force of each IMU */
  forces_mps2: number[][];
  /** in the mean */
  samples: number;
  /** between the stop and the end of the average */
  settle_s: number;
  /** trust in the own yaw */
  flags: ("yaw_untrusted" | "aiding_old" | "innovation_rejected" | "rate_exceeded" | "restored" | "clock_unsynchronised" | "bias_unknown" | "sensor_fault" | "not_saved" | "drive_untold" | "lower_untold")[];
  /** what the flags make of it */
  trust: "full" | "unknown_yaw";
  /** checks that it failed */
  quality: string[];
}

/** Every survey that belongs to a station. */
export interface MeasurementsAnswer {
  /** `seq` of the newest row */
  newest: number;
  measurements: MeasurementRow[];
}

/** One point of the trajectory. */
export interface TrajectoryRow {
  /** measured depth */
  md_m: number;
  /** from the vertical */
  inclination_deg: number;
  /** from north, clockwise */
  azimuth_deg: number;
  /** from the collar */
  north_m: number;
  /** from the collar */
  east_m: number;
  /** true vertical depth */
  tvd_m: number;
  /** standard deviation */
  sigma_north_m: number;
  /** standard deviation */
  sigma_east_m: number;
  /** standard deviation */
  sigma_tvd_m: number;
  /** of north, east, down */
  covariance_m2: number[][];
}

/** Positions with covariance. */
export interface TrajectoryAnswer {
  /** how the stations are joined */
  method: "minimum-curvature";
  points: TrajectoryRow[];
}

/** One event of a node. */
export interface EventRow {
  /** place in the stream since the ground station started, for `since` */
  seq: number;
  /** number of the tube */
  tube: number;
  /** the tube's number of it */
  sequence: number;
  /** rig time */
  at_s: number;
  /** how grave */
  severity: "info" | "warning" | "error";
  /** what happened */
  code: string;
  /** of the event */
  arguments: Record<string, unknown>;
}

/** Events of the nodes. */
export interface EventsAnswer {
  /** `seq` of the newest row */
  newest: number;
  events: EventRow[];
}

/** One average at rest. */
export interface StaticRecordRow {
  /** place in the stream since the ground station started, for `since` */
  seq: number;
  /** number of the tube */
  tube: number;
  /** the tube's number of it */
  sequence: number;
  /** number of the order that asked for it */
  order: number;
  /** rig time */
  begun_at_s: number;
  /** rig time */
  ended_at_s: number;
  /** in the means */
  samples: number;
  /** mean, raw */
  rate_rad_s: number[];
  /** of one sample */
  rate_cov_rad2_s2: number[][];
  /** mean, raw */
  force_m_s2: number[];
  /** of one sample */
  force_cov_m2_s4: number[][];
  /** mean */
  temperature_c: number;
  /** it was not at rest all the time */
  moved: boolean;
}

/** Raw readings averaged at rest. */
export interface StaticRecordsAnswer {
  /** `seq` of the newest row */
  newest: number;
  static_records: StaticRecordRow[];
}

/** Ellipse of a region of uncertainty, seen from above. */
export interface PlanEllipse {
  /** semi-axis */
  major_m: number;
  /** semi-axis */
  minor_m: number;
  /** of the major one */
  azimuth_deg: number;
}

/** One of three of the ellipsoid of a region of uncertainty. */
export interface SemiAxis {
  /** its length */
  semi_axis_m: number;
  /** unit vector: north, east, down */
  direction: number[];
}

/** What one source of errors makes of the uncertainty of a position. */
export interface PositionSigmas {
  /** standard deviation */
  sigma_north_m: number;
  /** standard deviation */
  sigma_east_m: number;
  /** standard deviation */
  sigma_tvd_m: number;
}

/** Region of uncertainty of one station. */
export interface StationRegion {
  /** measured depth */
  md_m: number;
  /** of north, east, down */
  covariance_m2: number[][];
  plan_ellipse: PlanEllipse;
  ellipsoid: SemiAxis[];
  sources: Record<string, PositionSigmas>;
}

/** Regions of uncertainty and what they are made of. */
export interface UncertaintyAnswer {
  /** share of true positions inside */
  confidence: number;
  /** standard deviations to the ellipse */
  sigma_plane: number;
  /** standard deviations to the ellipsoid */
  sigma_space: number;
  stations: StationRegion[];
}

/** Something that is wrong with the hole or its string. */
export interface BlunderRow {
  /** what explains the contradiction best */
  kind: "bias_stepped" | "bias_creeps" | "bias_wrong" | "tilt_slipped" | "tilt_wrong" | "mount_turned" | "mount_misread" | "joint_slipped" | "joint_misread" | "encoder_slipped" | "encoder_drifts" | "hole_moved" | "depth_wrong_once" | "depth_wrong_from" | "axes_exchanged" | "tubes_exchanged" | "look_wrong" | "collar_wrong";
  /** what it is of, such as a tube; empty of all */
  subject: string;
  /** depth of the bit at the stop from which on, or at which, it is wrong */
  from_md_m: number;
  /** whether the second best explains nearly as much; then both are left open */
  is_doubt: boolean;
  /** in words, of a doubt both explanations */
  text: string;
  /** decimal places of the chance that an honest hole shows as much: 3 is one in a thousand */
  evidence: number;
  /** second best explanation */
  second_kind: string | null;
  /** of the second best */
  second_evidence: number | null;
  /** of all surveys without it, 1 is as it should be */
  misfit_before: number;
  /** of all surveys with it */
  misfit_after: number;
  /** best explanation in words */
  best: string;
  /** second best in words, and how likely it is beside the best */
  second: string | null;
  /** by which the toe would be elsewhere without it put right; null if not known */
  moved_cm: number | null;
  /** standard deviation that it adds at the toe, since its size is not known exactly */
  sigma_cm: number | null;
  /** what to do about it */
  todo: string;
}

/** What one source gives to the sigma at the toe. */
export interface ToeShare {
  /** kind of error */
  source: string;
  /** what it is of, such as a tube; empty of all */
  subject: string;
  /** standard deviation at the toe that it makes, the larger of north and east */
  sigma_cm: number;
}

/** What all errors of one source give to the sigma at the toe together. */
export interface ToePart {
  /** kind of error, as of `toe` */
  source: string;
  /** the same for people, with the tube that gives most */
  words: string;
  /** standard deviation that it makes of `sigma_toe_cm`, whose square theirs add up to */
  sigma_cm: number;
  /** of the variance at the toe to north and east */
  percent: number;
}

/** A mistake that may be made at the last stop, of its kind the one that does most at the toe when not found. */
export interface LeastFound {
  /** what would be wrong */
  kind: "bias_stepped" | "bias_creeps" | "bias_wrong" | "tilt_slipped" | "tilt_wrong" | "mount_turned" | "mount_misread" | "joint_slipped" | "joint_misread" | "encoder_slipped" | "encoder_drifts" | "hole_moved" | "depth_wrong_once" | "depth_wrong_from" | "axes_exchanged" | "tubes_exchanged" | "look_wrong" | "collar_wrong";
  /** what it is of, such as a tube; empty of all */
  subject: string;
  /** size from which on it would be found; null if nothing can tell */
  smallest: number | null;
  /** of it: mg, deg or m */
  unit: string;
  /** what one that is not found does at the toe at most */
  unfound_cm: number | null;
  /** all of it for people */
  words: string;
}

/** A tube as all surveys of the hole show it. */
export interface AdjustedTube {
  /** number of the tube */
  tube: number;
  /** of its accelerometer, the tilt of its mount in it: x, y, z */
  bias_mg: number[];
  /** standard deviations of it */
  sigma_bias_mg: number[];
  /** surveys of the tube that count */
  looks: number;
  /** step at its newest stop that would be found; null if nothing can tell */
  smallest_step_mg: number | null;
  /** what a step that is not found does at the toe at most */
  unfound_step_cm: number | null;
}

/** Where to stop next: the turn of the string against this stop after which the toe is known best. */
export interface NextStopAdvice {
  /** by which to turn the string on, against where it stands at the last stop */
  turn_deg: number;
  /** standard deviation of the new toe after it, to north or east in the mean */
  sigma_cm: number;
  /** the same without a turn */
  same_face_cm: number;
  /** the same for people */
  words: string;
}

/** One adjustment of the whole hole: how well all surveys fit, what is wrong, and what each thing costs. */
export interface AdjustmentAnswer {
  /** looks of tubes at stations that are in it */
  surveys: number;
  /** numbers beyond those that the hole and its tubes need */
  redundancy: number;
  /** weighted squares of what is left over what they are to be: 1 is as it should be */
  misfit: number | null;
  /** by which tubes lie askew in the hole from stop to stop, as the surveys show it */
  play_deg: number | null;
  /** directions and sigmas that are shown elsewhere are those of this adjustment */
  counts: boolean;
  /** how well all surveys fit, in words */
  said: string;
  /** depth of the last station, the toe */
  toe_md_m: number | null;
  /** standard deviation at the toe, the larger of north and east */
  sigma_toe_cm: number | null;
  /** surveys by which it was looked for what is wrong; of the newest that may still go on */
  searched: number;
  blunders: BlunderRow[];
  toe: ToeShare[];
  parts: ToePart[];
  /** what is in no sigma, in words */
  left_out: string;
  unfound: LeastFound[];
  tubes: AdjustedTube[];
  next_stop: NextStopAdvice | null;
}

/** Design of the column. */
export interface DesignAxis {
  /** of the axis at its head */
  inclination_deg: number;
  /** of the axis at its head */
  azimuth_deg: number;
  /** length of the axis */
  target_m: number;
  /** of the finished column */
  radius_m: number;
  /** preset, or the limit as a sum */
  tolerance: string;
  /** points of the axis from its head to its end: length, north, east, down; two where straight */
  course_m: number[][];
}

/** Deviation of the hole from the design axis at one depth. */
export interface ColumnDeviation {
  /** measured depth */
  md_m: number;
  /** along the design axis */
  along_m: number;
  /** from the design axis */
  north_cm: number;
  /** from the design axis */
  east_cm: number;
  /** from the design axis */
  deviation_cm: number;
  /** standard deviation of the deviation */
  sigma_cm: number;
  /** of the length */
  deviation_percent: number;
  /** azimuth of the deviation */
  direction_deg: number;
  /** tolerance at this depth */
  limit_cm: number;
  /** of the tolerance */
  used_percent: number;
  /** highest alarm level reached */
  level_percent: number;
}

/** Where the hole will be at one depth, if it goes on as it tends to. */
export interface ConeRow {
  /** measured depth */
  md_m: number;
  /** along the design axis */
  along_m: number;
  /** expected, from the design axis */
  north_cm: number;
  /** expected, from the design axis */
  east_cm: number;
  /** expected, from the design axis */
  deviation_cm: number;
  /** of the deviation: it is within this of what is expected with 95 % */
  half_width_cm: number;
  /** of the cone: the hole is within this of the place expected with 95 % */
  radius_cm: number;
  /** tolerance at this depth */
  limit_cm: number;
}

/** What is known of where the hole ends, if nothing is steered and it goes on as its own directions say. */
export interface ForeseenEnd {
  /** chance that it ends within the limit */
  within_percent: number;
  /** of the deviation of the projection: 95 % */
  half_width_cm: number;
  /** standard deviation of the end that is of the surveys alone */
  surveyed_sigma_cm: number;
  /** curvature of the hole now, as expected; null at its end */
  bend_deg_per_m: number | null;
  cone: ConeRow[];
}

/** Which of two angles makes more of the uncertainty of the toe. */
export interface DominantAngle {
  /** which matters more for the position of the toe */
  angle: string;
  /** part of the uncertainty */
  by_inclination_m: number;
  /** part of the uncertainty */
  by_azimuth_m: number;
}

/** Deviation from the design axis at every station, and expected at the target; ahead says how sure that is. */
export interface ColumnAnswer {
  design: DesignAxis;
  stations: ColumnDeviation[];
  worst: ColumnDeviation;
  projection: ColumnDeviation | null;
  ahead: ForeseenEnd | null;
  dominant: DominantAngle | null;
}

/** What was known of the column at the end of one stop. */
export interface HistoryMoment {
  /** number, for `column?moment=` */
  moment: number;
  /** rig time of its newest survey */
  at_s: number;
  /** measured depth of its newest station */
  md_m: number;
  /** of the end, or before that is known of the worst station */
  deviation_cm: number;
  /** tolerance there */
  limit_cm: number;
  /** of the tolerance */
  used_percent: number;
}

/** What was known at the end of every stop, thinned. */
export interface HistoryAnswer {
  moments: HistoryMoment[];
}

/** One hole of the neighbourhood. */
export interface WallHole {
  /** name; the first is the one that is drilled, the others are its neighbours */
  hole: string;
  /** of its head */
  north_m: number;
  /** of its head */
  east_m: number;
  /** of its design */
  length_m: number;
  /** depth of its end */
  drilled_to_m: number | null;
  /** depth of its last survey */
  surveyed_to_m: number | null;
}

/** One joint between two columns. */
export interface WallJoint {
  /** names of the two */
  joint: string;
  /** the worst along it */
  state: "surveyed" | "unsurveyed" | "missing" | "outside";
  /** of its depths, those at which both are surveyed */
  surveyed_percent: number;
  /** of being too thin, the largest; 1 where a hole is missing */
  probability: number;
  /** where that is */
  depth_m: number;
  /** the largest where both are surveyed */
  probability_where_surveyed: number | null;
  /** the least, as surveyed */
  thickness_m: number | null;
  /** where that is */
  thinnest_at_m: number;
}

/** One more column, which would close what is open. */
export interface ClosingColumn {
  /** that would be closed */
  joint: string;
  /** of its head */
  north_m: number;
  /** of its head */
  east_m: number;
  /** where the joint is open */
  from_m: number;
  /** where the joint is open */
  to_m: number;
  /** whether one column is enough */
  closes: boolean;
}

/** The hole that is drilled and those beside it. */
export interface WallNeighbourhood {
  /** of the wall */
  name: string;
  /** that is drilled here */
  hole: string;
  /** of a joint */
  required_thickness_m: number;
  /** of anything too thin */
  allowed_probability: number;
  /** on these joints */
  verdict: "tight" | "not_proven" | "not_tight" | null;
  /** why they cannot be judged */
  problem: string | null;
  /** what is open or doubtful */
  findings: string[];
  holes: WallHole[];
  joints: WallJoint[];
  extra_columns: ClosingColumn[];
}

/** The joints of now; null where no wall was named. */
export interface WallAnswer {
  wall: WallNeighbourhood | null;
}

/** One item of the setup. */
export interface SetupRow {
  /** name, such as north, joint.4-3 and mount.3 */
  item: string;
  /** what it is */
  kind: "north" | "collar" | "joint" | "length" | "stick_up" | "mount" | "mount_turn" | "depth_scale" | "accelerometer" | "gyroscope" | "play" | "path" | "gravity" | "doubled" | "same_number";
  /** tube, or joint as upper and lower tube; empty of what the rig has once */
  subject: string;
  /** name for people, such as accelerometer of tube 3 */
  words: string;
  /** one, of the collar inclination and azimuth; empty where it may be any */
  value: number[];
  /** standard deviation of each */
  sigma: number;
  /** of both: deg, m, m/s^2, deg/s, deg/m or 1 */
  unit: string;
  /** where it is from */
  source: "told" | "measured" | "design" | "default";
  /** the same in words */
  detail: string;
  /** it was told or measured */
  told: boolean;
  /** without it the hole is not known, and it was not told */
  missing: boolean;
  /** who told it; empty where no order did */
  by: string;
  /** when that was */
  utc: string;
  /** since then; null where no order told it */
  age_s: number | null;
  /** by orders, also what does not stand any more */
  times_told: number;
  /** what checks it, in words; empty where readings show a slip, or it was not told */
  check: string;
  /** smallest slip that its check shows; null where it has none */
  least_slip: number | null;
  /** standard deviation that it makes at the toe */
  toe_cm: number;
  /** across the hole, or along it where it is one of the depth */
  way: "across" | "along";
}

/** What is known of the rig: what is missing first, then what costs most at the toe, across the hole, then along. */
export interface SetupAnswer {
  /** nothing is missing, unchecked or contradicted */
  ready: boolean;
  /** items without which the hole is not known */
  missing: string[];
  /** items that were told once, of which no reading shows a slip, and nothing checks */
  unchecked: string[];
  /** why it is not ready, in words; empty where it is */
  hold: string;
  /** what is told one way and checked another, in words */
  contradicted: string[];
  /** the next thing to do */
  todo: string;
  /** item that costs most at the toe, across the hole */
  worst: string;
  /** the same for people, with what it costs */
  costs_most: string;
  /** measured depth of the toe */
  at_m: number;
  /** the costs are of the hole as surveyed; before the first station of its design */
  surveyed: boolean;
  /** what the costs do not hold */
  left_out: string;
  items: SetupRow[];
}

/** One alarm as the crew works with it. */
export interface Alarm {
  /** of the alarm, never used twice */
  number: number;
  /** how far it is */
  state: "raised" | "acknowledged" | "shelved" | "latched" | "cleared";
  /** kind: of the rig's, or deviation, projection */
  code: "survey_untrusted" | "survey_set_aside" | "survey_unplaced" | "survey_refused" | "survey_missing" | "numbers_missing" | "numbers_lost" | "tube_counts_anew" | "tube_restarted" | "same_number" | "tube_silent" | "tube_sensor" | "tube_disk" | "tube_queue" | "clock" | "clock_back" | "epoch" | "reference" | "joint" | "belt" | "blunder" | "depth_refused" | "depth_silent" | "depth_stands" | "depth_contradicts" | "disk" | "lease" | "database" | "queue" | "bad_input" | "wrong_password" | "page_restarted" | "seal_refused" | "key_file" | "certificate" | "deviation" | "projection";
  /** how much it matters */
  level: "notice" | "degraded" | "bad";
  /** what it is about */
  subject: string;
  /** what is known of it */
  detail: string;
  /** that was passed */
  threshold: string;
  /** measured depth, where it is at one */
  md_m: number | null;
  /** towards which the hole is off */
  azimuth_deg: number | null;
  /** the same as a word */
  wind: "N" | "NNE" | "NE" | "ENE" | "E" | "ESE" | "SE" | "SSE" | "S" | "SSW" | "SW" | "WSW" | "W" | "WNW" | "NW" | "NNW" | null;
  /** rig time at which it was raised */
  since_s: number | null;
  /** the same in UTC */
  since_utc: string | null;
  /** that it was raised */
  times: number;
  /** times that its cause was noticed */
  count: number;
  /** who */
  acknowledged_by: string | null;
  /** when */
  acknowledged_utc: string | null;
  /** who */
  shelved_by: string | null;
  /** when it is back */
  shelved_until_utc: string | null;
  /** rig time at which its cause was gone */
  cleared_at_s: number | null;
}

/** One alarm of the deviation or of the projection, with the threshold that it passed. */
export interface ToleranceAlarmRow {
  /** of what */
  kind: "deviation" | "projection";
  /** of the tolerance */
  level_percent: number;
  /** rig time of the survey that raised it */
  raised_at_s: number;
  /** measured depth */
  md_m: number;
  /** then */
  deviation_cm: number;
  /** standard deviation of the deviation */
  sigma_cm: number;
  /** it was within this of the deviation with 95 % */
  half_width_cm: number;
  /** passed */
  threshold_cm: number;
  /** rig time */
  cleared_at_s: number | null;
}

/** A station where a survey contradicted those before it: the hole moved. */
export interface MovedStation {
  /** measured depth */
  md_m: number;
  /** rig time */
  at_s: number;
  /** that no longer count */
  dropped_measurements: number;
  /** of the new survey from those before */
  departure_sigma: number;
  /** of the stations beside it */
  neighbours_sigma: number[];
}

/** One alarm of the rig itself. */
export interface RigAlarmRow {
  /** kind of alarm, see [operating](operate.md#what-the-crew-is-told) */
  code: "survey_untrusted" | "survey_set_aside" | "survey_unplaced" | "survey_refused" | "survey_missing" | "numbers_missing" | "numbers_lost" | "tube_counts_anew" | "tube_restarted" | "same_number" | "tube_silent" | "tube_sensor" | "tube_disk" | "tube_queue" | "clock" | "clock_back" | "epoch" | "reference" | "joint" | "belt" | "blunder" | "depth_refused" | "depth_silent" | "depth_stands" | "depth_contradicts" | "disk" | "lease" | "database" | "queue" | "bad_input" | "wrong_password" | "page_restarted" | "seal_refused" | "key_file" | "certificate";
  /** how much it matters */
  level: "notice" | "degraded" | "bad";
  /** what it is about */
  subject: string;
  /** what is known of it */
  detail: string;
  /** rig time */
  raised_at_s: number | null;
  /** rig time; null while it stands */
  cleared_at_s: number | null;
  /** times it was raised */
  count: number;
}

/** What the crew works with, and what it is made of. */
export interface AlarmsAnswer {
  open: Alarm[];
  closed: Alarm[];
  /** alarms, ten at most in a good run */
  raised_last_hour: number;
  /** more than ten were raised within ten minutes, and not yet fewer than five */
  flood: boolean;
  /** conditions for which there was no room among the open ones, milder than those */
  left_out: number;
  /** of the tolerance */
  levels_percent: number[];
  active: ToleranceAlarmRow[];
  cleared: ToleranceAlarmRow[];
  moved: MovedStation[];
  rig: RigAlarmRow[];
  rig_cleared: RigAlarmRow[];
}

/** One attitude at which the tubes rest. */
export interface RestAttitude {
  /** number, from 1 */
  attitude: number;
  /** of the tubes' axis */
  pitch_deg: number;
  /** about the tubes' axis */
  roll_deg: number;
  /** rig time at which it was entered */
  told_at_s: number;
  /** rig time; null while the tubes are there */
  left_at_s: number | null;
}

/** What corrects the readings of a sensor. */
export interface SensorModel {
  /** row = sensor axis */
  matrix: number[][];
  /** at the reference temperature */
  bias_mps2: number[];
}

/** Error of the inclination before and after a calibration. */
export interface InclinationRms {
  /** over the attitudes */
  before: number;
  /** over the attitudes */
  after: number;
}

/** How well a calibration fits its records. */
export interface SolutionFigures {
  /** of the fit */
  residual_rms_mps2: number;
  /** standard deviation, x y z */
  bias_std_mps2: number[];
  /** largest of the nine */
  matrix_std: number;
  /** of the fit */
  condition: number;
  inclination_rms_deg: InclinationRms;
}

/** Calibration in the field of one tube. */
export interface TubeCalibration {
  /** number of the tube */
  tube: number;
  /** how far it is */
  phase: "collecting" | "proposed" | "confirmed" | "uploading" | "verifying" | "done" | "refused";
  /** why it is refused, or what is missing */
  detail: string;
  /** at rest so far */
  records: number;
  /** records asked for */
  asked: number;
  /** of the block in use at the beginning */
  version_before: number | null;
  /** of that block */
  hash_before: string;
  accelerometer_before: SensorModel | null;
  /** of the proposed block */
  version: number | null;
  /** of the proposed block */
  hash_proposed: string;
  accelerometer: SensorModel | null;
  /** begun */
  uploads: number;
  /** while the block was on its way */
  restarted: boolean;
  /** of the block in use then */
  hash_after_restart: string;
  /** that the tube reported at the end */
  hash: string;
  solution: SolutionFigures | null;
}

/** Calibration in the field: how far, and what it found. */
export interface RecalibrationAnswer {
  /** how far it is */
  state: "idle" | "collecting" | "solved" | "uploading" | "done";
  /** hash to confirm */
  proposal: string;
  attitudes: RestAttitude[];
  tubes: TubeCalibration[];
}

/** An order and what became of it. */
export interface Order {
  /** number, never used twice */
  order: number;
  /** rig time at which it was accepted */
  at_s: number | null;
  /** the same in UTC */
  ordered_utc: string;
  /** who ordered */
  by: string;
  /** null for an order to the ground station */
  tube: number | null;
  /** name */
  command: string;
  /** step of a command that has several */
  action: string;
  /** as they were ordered */
  arguments: Record<string, unknown>;
  /** how far it is */
  state: "sent" | "acknowledged" | "done" | "failed";
  /** whether it was obeyed; null before the answer */
  done: boolean | null;
  /** why it was refused, or what happens now */
  detail: string;
  /** of the reply, see the table of commands */
  values: Record<string, unknown>;
}

/** The newest orders, the oldest of them first. */
export interface OrdersAnswer {
  orders: Order[];
}

/** Newest change of one path. */
export interface PathChange {
  /** below ground/, without those of a number */
  path: string;
  /** revision of its newest change */
  changed_at: number;
}

/** When each path changed last. */
export interface ChangesAnswer {
  changes: PathChange[];
}

/** JSON schema of every answer. */
export interface SchemaAnswer {
  /** JSON schema of the answer of each path, made from the code that answers */
  schemas: Record<string, unknown>;
}

/** Offset of an IMU's mount that a node corrects. */
export interface MountOffset {
  /** offset of the mount */
  pitch_deg: number;
  /** offset of the mount */
  roll_deg: number;
  /** of both */
  sigma_deg: number;
}

/** Last state of one node. */
export interface NodeAnswer {
  /** number of the tube */
  tube: number;
  /** rig time of this state */
  at_s: number;
  /** since then */
  age_s: number | null;
  /** silent for too long */
  stale: boolean;
  /** distance from the encoder in tubes, -1 unknown */
  hops: number;
  /** execution state */
  mode: "boot" | "static_bias" | "alignment" | "tracking" | "still" | "survey" | "held" | "fault";
  /** yaw */
  yaw_deg: number;
  /** random standard deviation of the yaw */
  sigma_yaw_deg: number;
  /** constant errors of joints; never averages away */
  sigma_systematic_deg: number;
  /** estimated bias of the gyroscope, x y z */
  gyro_bias_dps: number[];
  /** estimated error of the gyroscope's z scale */
  scale_factor: number;
  /** of the last aiding */
  innovation_deg: number;
  /** standard deviation of the innovation */
  sigma_innovation_deg: number;
  /** since the last aiding used */
  aiding_age_s: number | null;
  /** of the node's rig time */
  sigma_clock_s: number;
  /** trust in the own yaw */
  flags: ("yaw_untrusted" | "aiding_old" | "innovation_rejected" | "rate_exceeded" | "restored" | "clock_unsynchronised" | "bias_unknown" | "sensor_fault" | "not_saved" | "drive_untold" | "lower_untold")[];
  /** since its start */
  cycles: number;
  /** cycles that ended too late */
  overruns: number;
  /** of the frames from above over the radio's threshold; null without a radio */
  upper_margin_db: number | null;
  /** the same from below */
  lower_margin_db: number | null;
  /** of the parameter block in use, 0 is the identity */
  parameters_version: number;
  /** first 8 bytes of its SHA-256, hexadecimal */
  parameters_hash: string;
  alignment: MountOffset | null;
}

/** Every survey of one station. */
export interface StationMeasurementsAnswer {
  /** number */
  station: number;
  measurements: MeasurementRow[];
}

/** Answer of each path. */
export interface Answers {
  status: AnswerHeader & StatusAnswer;
  verdict: AnswerHeader & Verdict;
  string: AnswerHeader & StringAnswer;
  stations: AnswerHeader & StationsAnswer;
  measurements: AnswerHeader & MeasurementsAnswer;
  trajectory: AnswerHeader & TrajectoryAnswer;
  events: AnswerHeader & EventsAnswer;
  static_records: AnswerHeader & StaticRecordsAnswer;
  uncertainty: AnswerHeader & UncertaintyAnswer;
  adjustment: AnswerHeader & AdjustmentAnswer;
  column: AnswerHeader & ColumnAnswer;
  history: AnswerHeader & HistoryAnswer;
  wall: AnswerHeader & WallAnswer;
  setup: AnswerHeader & SetupAnswer;
  alarms: AnswerHeader & AlarmsAnswer;
  recalibration: AnswerHeader & RecalibrationAnswer;
  orders: AnswerHeader & OrdersAnswer;
  changes: AnswerHeader & ChangesAnswer;
  schema: AnswerHeader & SchemaAnswer;
  [path: `nodes/${number}`]: AnswerHeader & NodeAnswer;
  [path: `stations/${number}`]: AnswerHeader & Station;
  [path: `stations/${number}/measurements`]: AnswerHeader & StationMeasurementsAnswer;
  [path: `orders/${number}`]: AnswerHeader & Order;
}
