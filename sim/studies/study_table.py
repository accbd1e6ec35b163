"""Table of studies: the command ``experiment``, ``make study`` and the tests know a study from its line here alone.

A study more is a package with ``run`` and, if it draws, ``figure`` (see `sim.studies.study`), and a line here.
"""

from __future__ import annotations

from sim.named import by_name
from sim.studies import table_columns
from sim.studies.field.cases import ALL
from sim.studies.field.field_rows import KEYS
from sim.studies.study import MODULES, Option, ResultTable, Study

SEEDS = Option("seeds", 40, 2, 10_000)
SEED = Option("seed", 1, 0, 2**31 - 1, help="One seed, one result.")
MODES = {
    "update-modes": "Yaw and azimuth at rest under continuous aiding and under 20 s on and 5 to 60 s off.",
    "single-updates": "Yaw and azimuth at rest under single updates from one a second to one a minute.",
    "two-nodes": "Yaw and azimuth at rest of two nodes, the second aided through the first.",
    "fifty-nodes": "Yaw of the last of fifty nodes: clocks off by 5 ms a joint, 30 % lost, 20 s on and 30 s off.",
}

STUDIES = by_name(
    "studies",
    [
        Study(
            "relay",
            "Judge at every hop whether a node's own variance is the truth about its error (NEES, 1 is honest).",
            f"{MODULES}.relay",
            (ResultTable("Relay over {hops} hops, {seeds} seeds", table_columns.RELAY, table_columns.RELAY),),
            (Option("hops", 10, 1, 50), SEEDS),
            counts="seeds",
            drawn=False,
            full=("--hops 10 --seeds 40",),
            short="--hops 2 --seeds 2",
        ),
        Study(
            "mwd",
            "Calibrate synthetic MWD tools at five designs of tilts, tool faces and temperatures.",
            f"{MODULES}.mwd",
            (
                ResultTable(
                    "MWD calibration, {tools} tools a design", table_columns.MWD, table_columns.MWD, sideways=True
                ),
            ),
            (Option("tools", 200, 1, 10_000, help="Synthetic tools."),),
            counts="tools",
            drawn=False,
            full=("--tools 200",),
            short="--tools 1",
        ),
        Study(
            "allan",
            "Recover the published noise of the node's sensor from synthetic records of 2 h at 65 Hz.",
            f"{MODULES}.allan",
            (ResultTable("Allan analysis of {records} records", table_columns.ALLAN, table_columns.ALLAN),),
            (Option("records", 20, 1, 10_000, help="Records of 2 h."),),
            counts="records",
            drawn=False,
            full=("--records 20",),
            short="--records 1",
        ),
        Study(
            "coverage",
            "How often the claimed ellipse holds the true position, over wells drilled with the rig's own numbers.",
            f"{MODULES}.coverage",
            (ResultTable("Coverage over {wells} wells", table_columns.COVERAGE, table_columns.COVERAGE),),
            (
                Option("wells", 2000, 100, 1_000_000),
                Option("strings", 100, 2, 10_000, help="Strings whose filter is run."),
            ),
            counts="strings, then wells",
            full=("--wells 2000",),
            short="--wells 100 --strings 2",
        ),
        Study(
            "region-of-uncertainty",
            "Regions of uncertainty of wellbore 1 for five instruments, the printed tables beside ours.",
            f"{MODULES}.region_of_uncertainty",
            (
                ResultTable("Region of uncertainty of wellbore 1", table_columns.REGION, table_columns.REGION),
                ResultTable(
                    "Lateral error: gyro against a held azimuth", shown=table_columns.FILTERED, rows="filtered"
                ),
                ResultTable(
                    "Azimuth error of a magnetic survey",
                    table_columns.MAGNETIC,
                    table_columns.MAGNETIC,
                    rows="magnetic",
                    suffix="-magnetic",
                ),
                ResultTable(
                    "By the accumulation of the print",
                    table_columns.PRINTED,
                    table_columns.PRINTED,
                    rows="printed",
                    suffix="-as-printed",
                ),
                ResultTable(
                    "MPU-6500 at the toe, by either figure of its datasheet",
                    table_columns.READINGS,
                    table_columns.READINGS,
                    rows="readings",
                    suffix="-mpu6500",
                ),
            ),
        ),
        Study(
            "soil-link",
            "Radio through soil beside the published figures, and the delivery of surveys through wet clay.",
            f"{MODULES}.soil_link",
            (
                ResultTable("Received power over all textures", table_columns.SOIL_LINK, table_columns.SOIL_LINK),
                ResultTable("Feasibility", table_columns.SOIL_MAP, table_columns.SOIL_MAP, rows="map", suffix="-map"),
                ResultTable(
                    "Delivery of {surveys} surveys, wellbore 1 in wet clay",
                    table_columns.SOIL_DELIVERY,
                    table_columns.SOIL_DELIVERY,
                    rows="delivery",
                    suffix="-delivery",
                ),
            ),
            (Option("tubes", 10, 1, 10, help="Of wellbore 1 that are drilled in wet clay."),),
            counts="parts",
            full=("--tubes 10",),
            short="--tubes 1",
        ),
        Study(
            "pipe-link",
            "Radio inside the pipe as a waveguide: modes, attenuation and reach beside the published figures.",
            f"{MODULES}.pipe_link",
            (
                ResultTable("Pipe of 3 cm radius", table_columns.PIPE_LINK, table_columns.PIPE_LINK),
                ResultTable(
                    "Grades of API 5L at 5 GHz",
                    table_columns.PIPE_GRADES,
                    table_columns.PIPE_GRADES,
                    rows="grades",
                    suffix="-grades",
                ),
            ),
        ),
        Study(
            "weighting",
            "Weights of the readings of one station when the hole moves, the published reductions beside ours.",
            f"{MODULES}.weighting",
            (
                ResultTable("Remaining error at the fourth stop", table_columns.CASES, table_columns.CASES),
                ResultTable("Errors of every change", table_columns.SWEEPS, rows="sweeps", suffix="-sweeps"),
            ),
        ),
        *(
            Study(
                name,
                words,
                f"{MODULES}.modes",
                (ResultTable("{experiment}, {seeds} seeds", table_columns.INTERVALS, table_columns.INTERVALS_SHOWN),),
                (SEEDS,),
                fixed={"name": name},
                full=("--seeds 200",),
                short="--seeds 2",
            )
            for name, words in MODES.items()
        ),
        Study(
            "tuning",
            "Time from the stop until the bias is found, over the tuning factors A and B.",
            f"{MODULES}.tuning",
            (ResultTable("Tuning, {seeds} seeds", table_columns.TUNING, table_columns.TUNING),),
            (SEEDS,),
            full=("--seeds 100",),
            short="--seeds 2",
        ),
        Study(
            "delay",
            "Yaw error over the delay of the aiding, with its time of validity and with that of its arrival.",
            f"{MODULES}.delay",
            (ResultTable("Delay, {seeds} seeds", table_columns.INTERVALS, table_columns.INTERVALS_SHOWN),),
            (SEEDS,),
            full=("--seeds 25",),
            short="--seeds 2",
        ),
        Study(
            "consistency",
            "Consistency (NEES) to hop 50 under clock errors, loss, outages, joint and mount errors, by relay scheme.",
            f"{MODULES}.consistency",
            (
                ResultTable(
                    "NEES to hop 50, {kernel}, {seeds} seeds", table_columns.CONSISTENCY, table_columns.CONSISTENCY
                ),
            ),
            (
                Option("control-seeds", None, 2, 10_000, help="Of the other schemes; as many if absent."),
                Option("kernel", "float64", choices=("float64", "fixed")),
                SEEDS,
            ),
            full=("--seeds 500 --control-seeds 100", "--seeds 500 --kernel fixed"),
            short="--seeds 2 --kernel fixed",
        ),
        Study(
            "honesty",
            "NEES and coverage to hop 50 over thousands of strings in either world, by a campaign, with intervals.",
            f"{MODULES}.honesty",
            (ResultTable("{hops} nodes, {world} world, {runs} strings", table_columns.HONESTY, table_columns.HONESTY),),
            (
                Option("runs", 1000, 2, 1_000_000, help="Strings, each a seed."),
                Option("hops", 50, 1, 50, help="Nodes of a string."),
                Option("world", "assumed", choices=("assumed", "rough"), help="That of the filter, or a rough one."),
            ),
            counts="strings",
            full=("--runs 10000", "--runs 10000 --world rough"),
            short="--runs 2 --hops 2",
        ),
        Study(
            "outage",
            "Consistency (NEES) of a string of five over the length of outages and the loss of every hop.",
            f"{MODULES}.outage",
            (ResultTable("NEES of five hops, {seeds} seeds", table_columns.OUTAGE, table_columns.OUTAGE_SHOWN),),
            (SEEDS,),
            full=("--seeds 240",),
            short="--seeds 2",
        ),
        Study(
            "field",
            "What a node makes of a field's world, disturbance by disturbance: honesty, flags, false faults, surveys.",
            f"{MODULES}.field",
            (
                ResultTable("Field, {seeds} seeds", table_columns.FIELD, table_columns.FIELD_SHOWN),
                ResultTable(
                    "Field with drawn constants, {seeds} seeds",
                    table_columns.FIELD_SHOWN,
                    table_columns.FIELD_SHOWN,
                    rows="third",
                    suffix="-drawn",
                ),
            ),
            (Option("disturbance", ALL, choices=KEYS), Option("seeds", 20, 2, 10_000)),
            drawn=False,
            full=("--seeds 100",),
            short="--seeds 2 --disturbance random-phase",
        ),
        Study(
            "limits",
            "How near a node comes to the best filter and the best smoother on the same data: at rest and at surveys.",
            f"{MODULES}.limits",
            (ResultTable("Limits, {seeds} seeds", table_columns.LIMITS, table_columns.LIMITS),),
            (SEEDS,),
            drawn=False,
            full=("--seeds 200",),
            short="--seeds 2",
        ),
        Study(
            "bridging",
            "What gyroscopes that bridge outages together could gain at most, and what a string's play takes from it.",
            f"{MODULES}.bridging",
            (
                ResultTable(
                    "Bridging, {together} gyroscopes, {seeds} seeds", table_columns.BRIDGING, table_columns.BRIDGING
                ),
            ),
            (SEEDS,),
            drawn=False,
            full=("--seeds 40",),
            short="--seeds 2",
        ),
        Study(
            "worlds",
            "Every figure asked of the filter in the world it assumes and in a rough one, beside each other.",
            f"{MODULES}.worlds",
            (
                ResultTable(
                    "Two worlds, {seeds} seeds, {string_seeds} of {hops} nodes",
                    table_columns.WORLDS,
                    table_columns.WORLDS,
                ),
                ResultTable(
                    "NEES to hop {hops}, {strings} strings",
                    table_columns.WORLDS_CONSISTENCY,
                    table_columns.WORLDS_CONSISTENCY,
                    rows="consistency",
                    suffix="-consistency",
                ),
            ),
            (
                Option("part", "all", choices=("all", *MODES, "consistency"), help="One table of both, or all."),
                Option("string-seeds", 6, 2, 10_000, help="Seeds of the long string."),
                Option("strings", 100, 2, 10_000, help="Seeds of its NEES, by a campaign."),
                Option("hops", 50, 2, 50, help="Nodes of the long string."),
                Option("seeds", 20, 2, 10_000),
            ),
            drawn=False,
            full=("--seeds 40 --string-seeds 8 --strings 500",),
            short="--hops 2 --seeds 2 --string-seeds 2 --strings 2",
        ),
        Study(
            "force-bias",
            "Biases of accelerometers of 1 mg from the surveys of a string, stop by stop, and the azimuth under them.",
            f"{MODULES}.force_bias",
            (ResultTable("Accelerometer biases, {seeds} seeds", table_columns.FORCE_BIAS, table_columns.FORCE_BIAS),),
            (Option("seeds", 20, 2, 10_000),),
            drawn=False,
            full=("--seeds 40",),
            short="--seeds 2",
        ),
        Study(
            "bent-holes",
            "Azimuth and toe of a bent hole: what the string does there, and what the ground station was told of it.",
            f"{MODULES}.bent",
            (ResultTable("Bent holes, {seeds} seeds", table_columns.BENT, table_columns.BENT),),
            (Option("seeds", 20, 2, 10_000),),
            drawn=False,
            full=("--seeds 40",),
            short="--seeds 2",
        ),
        Study(
            "alignment",
            "Mount of an IMU from two slow turns: a circle fit beside (max + min) / 2, and the survey after.",
            f"{MODULES}.alignment",
            (ResultTable("Alignment, {seeds} seeds", table_columns.ALIGNMENT, table_columns.ALIGNMENT_SHOWN),),
            (SEEDS,),
            full=("--seeds 100",),
            short="--seeds 2",
        ),
        Study(
            "projection",
            "Where holes of seven kinds end, foreseen from every depth: inside the cone, score, and chances.",
            f"{MODULES}.projection",
            (
                ResultTable("Ends of {holes} holes", table_columns.PROJECTION, table_columns.PROJECTION),
                ResultTable(
                    "By kind of hole", table_columns.INSIDE, table_columns.INSIDE, rows="kinds", suffix="-kinds"
                ),
                ResultTable(
                    "In other grounds", table_columns.INSIDE, table_columns.INSIDE, rows="grounds", suffix="-grounds"
                ),
                ResultTable(
                    "Chance of ending within, in bins",
                    table_columns.RELIABILITY,
                    table_columns.RELIABILITY,
                    rows="reliability",
                    suffix="-reliability",
                ),
            ),
            (Option("holes", 1000, 7, 1_000_000, help="Of all kinds together."), SEED),
            counts="parts",
            full=("--holes 1000",),
            short="--holes 7",
        ),
        Study(
            "ingredients",
            "Yaw at rest and rotating with one ingredient of the filter or of its sensors switched off at a time.",
            f"{MODULES}.ingredients",
            (ResultTable("Ingredients, {seeds} seeds", table_columns.INGREDIENTS, table_columns.INGREDIENTS_SHOWN),),
            (SEEDS,),
            full=("--seeds 40",),
            short="--seeds 2",
        ),
        Study(
            "fixed-point",
            "Compare the integer kernel with the float64 kernel on the same inputs, cycle by cycle, and their NEES.",
            f"{MODULES}.fixed_point",
            (
                ResultTable(
                    "Fixed point against float64, {cycles} cycles", table_columns.FIXED_POINT, table_columns.FIXED_POINT
                ),
                ResultTable(
                    "NEES of 5 hops, {seeds} seeds",
                    table_columns.FIXED_POINT_NEES,
                    table_columns.FIXED_POINT_NEES,
                    rows="nees",
                    suffix="-nees",
                ),
            ),
            (
                Option("cycles", 1_000_000, 2000, 100_000_000),
                Option("seeds", 24, 2, 10_000, help="Of the NEES."),
                SEED,
            ),
            drawn=False,
            full=("--cycles 1000000",),
            short="--cycles 2000 --seeds 2",
        ),
    ],
)
