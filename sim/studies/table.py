"""Table of studies: the command ``experiment``, ``make study`` and the tests know a study from its line here alone.

A study more is a package with ``run`` and, if it draws, ``figure`` (see `sim.studies.study`), and a line here.
"""

from __future__ import annotations

from sim.named import by_name
from sim.studies import columns
from sim.studies.field.cases import ALL, KEYS
from sim.studies.study import MODULES, Option, Study, Table

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
            (Table("Relay over {hops} hops, {seeds} seeds", columns.RELAY, columns.RELAY),),
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
            (Table("MWD calibration, {tools} tools a design", columns.MWD, columns.MWD, sideways=True),),
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
            (Table("Allan analysis of {records} records", columns.ALLAN, columns.ALLAN),),
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
            (Table("Coverage over {wells} wells", columns.COVERAGE, columns.COVERAGE),),
            (Option("wells", 2000, 100, 1_000_000), Option("strings", 100, 2, 10_000, help="Whose filters are run.")),
            counts="strings, then wells",
            full=("--wells 2000",),
            short="--wells 100 --strings 2",
        ),
        Study(
            "region-of-uncertainty",
            "Regions of uncertainty of wellbore 1 for five instruments, the printed tables beside ours.",
            f"{MODULES}.region_of_uncertainty",
            (
                Table("Region of uncertainty of wellbore 1", columns.REGION, columns.REGION),
                Table("Lateral error: gyro against a held azimuth", shown=columns.FILTERED, rows="filtered"),
                Table("Azimuth error of a magnetic survey", shown=columns.MAGNETIC, rows="magnetic"),
            ),
        ),
        Study(
            "soil-link",
            "Radio through soil beside the published figures, and the delivery of surveys through wet clay.",
            f"{MODULES}.soil_link",
            (
                Table("Received power over all textures", columns.SOIL_LINK, columns.SOIL_LINK),
                Table("Feasibility", columns.SOIL_MAP, columns.SOIL_MAP, rows="map", suffix="-map"),
                Table(
                    "Delivery of {surveys} surveys, wellbore 1 in wet clay",
                    columns.SOIL_DELIVERY,
                    columns.SOIL_DELIVERY,
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
                Table("Pipe of 3 cm radius", columns.PIPE_LINK, columns.PIPE_LINK),
                Table(
                    "Grades of API 5L at 5 GHz",
                    columns.PIPE_GRADES,
                    columns.PIPE_GRADES,
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
                Table("Remaining error at the fourth stop", columns.CASES, columns.CASES),
                Table("Errors of every change", columns.SWEEPS, rows="sweeps", suffix="-sweeps"),
            ),
        ),
        *(
            Study(
                name,
                words,
                f"{MODULES}.modes",
                (Table("{experiment}, {seeds} seeds", columns.INTERVALS, columns.INTERVALS_SHOWN),),
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
            (Table("Tuning, {seeds} seeds", columns.TUNING, columns.TUNING),),
            (SEEDS,),
            full=("--seeds 100",),
            short="--seeds 2",
        ),
        Study(
            "delay",
            "Yaw error over the delay of the aiding, with its time of validity and with that of its arrival.",
            f"{MODULES}.delay",
            (Table("Delay, {seeds} seeds", columns.INTERVALS, columns.INTERVALS_SHOWN),),
            (SEEDS,),
            full=("--seeds 25",),
            short="--seeds 2",
        ),
        Study(
            "consistency",
            "Consistency (NEES) to hop 50 under clock errors, loss, outages, joint and mount errors, by relay scheme.",
            f"{MODULES}.consistency",
            (Table("NEES to hop 50, {kernel}, {seeds} seeds", columns.CONSISTENCY, columns.CONSISTENCY),),
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
            "NEES and coverage to hop 50 over thousands of strings, by a campaign, with their intervals.",
            f"{MODULES}.honesty",
            (Table("{hops} nodes, {runs} strings", columns.HONESTY, columns.HONESTY),),
            (
                Option("runs", 1000, 2, 1_000_000, help="Strings, each a seed."),
                Option("hops", 50, 1, 50, help="Nodes of a string."),
            ),
            counts="strings",
            full=("--runs 10000",),
            short="--runs 2 --hops 2",
        ),
        Study(
            "outage",
            "Consistency (NEES) of a string of five over the length of outages and the loss of every hop.",
            f"{MODULES}.outage",
            (Table("NEES of five hops, {seeds} seeds", columns.OUTAGE, columns.OUTAGE_SHOWN),),
            (SEEDS,),
            full=("--seeds 240",),
            short="--seeds 2",
        ),
        Study(
            "field",
            "What a node makes of a field's world, disturbance by disturbance: honesty, flags, false faults, surveys.",
            f"{MODULES}.field",
            (Table("Field, {seeds} seeds", columns.FIELD, columns.FIELD),),
            (Option("disturbance", ALL, choices=KEYS), Option("seeds", 20, 2, 10_000)),
            drawn=False,
            full=("--seeds 100",),
            short="--seeds 2 --disturbance random-phase",
        ),
        Study(
            "limits",
            "How near a node comes to the best filter and the best smoother on the same data: at rest and at surveys.",
            f"{MODULES}.limits",
            (Table("Limits, {seeds} seeds", columns.LIMITS, columns.LIMITS),),
            (SEEDS,),
            drawn=False,
            full=("--seeds 200",),
            short="--seeds 2",
        ),
        Study(
            "bridging",
            "What gyroscopes that bridge outages together could gain at most, and what a string's play takes from it.",
            f"{MODULES}.bridging",
            (Table("Bridging, {together} gyroscopes, {seeds} seeds", columns.BRIDGING, columns.BRIDGING),),
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
                Table("Two worlds, {seeds} seeds, {string_seeds} of {hops} nodes", columns.WORLDS, columns.WORLDS),
                Table(
                    "NEES to hop {hops}, {string_seeds} seeds",
                    columns.WORLDS_CONSISTENCY,
                    columns.WORLDS_CONSISTENCY,
                    rows="consistency",
                    suffix="-consistency",
                ),
            ),
            (
                Option("part", "all", choices=("all", *MODES, "consistency"), help="One table of both, or all."),
                Option("string-seeds", 6, 2, 10_000, help="Seeds of the long string."),
                Option("hops", 50, 2, 50, help="Nodes of the long string."),
                Option("seeds", 20, 2, 10_000),
            ),
            drawn=False,
            full=("--seeds 40 --string-seeds 8",),
            short="--hops 2 --seeds 2 --string-seeds 2",
        ),
        Study(
            "force-bias",
            "Biases of accelerometers of 1 mg from the surveys of a string, stop by stop, and the azimuth under them.",
            f"{MODULES}.force_bias",
            (Table("Accelerometer biases, {seeds} seeds", columns.FORCE_BIAS, columns.FORCE_BIAS),),
            (Option("seeds", 20, 2, 10_000),),
            drawn=False,
            full=("--seeds 40",),
            short="--seeds 2",
        ),
        Study(
            "bent-holes",
            "Azimuth and toe of a bent hole: what the string does there, and what the ground station was told of it.",
            f"{MODULES}.bent",
            (Table("Bent holes, {seeds} seeds", columns.BENT, columns.BENT),),
            (Option("seeds", 20, 2, 10_000),),
            drawn=False,
            full=("--seeds 40",),
            short="--seeds 2",
        ),
        Study(
            "alignment",
            "Mount of an IMU from two slow turns: a circle fit beside (max + min) / 2, and the survey after.",
            f"{MODULES}.alignment",
            (Table("Alignment, {seeds} seeds", columns.ALIGNMENT, columns.ALIGNMENT_SHOWN),),
            (SEEDS,),
            full=("--seeds 100",),
            short="--seeds 2",
        ),
        Study(
            "ingredients",
            "Yaw at rest and rotating with one ingredient of the filter or of its sensors switched off at a time.",
            f"{MODULES}.ingredients",
            (Table("Ingredients, {seeds} seeds", columns.INGREDIENTS, columns.INGREDIENTS_SHOWN),),
            (SEEDS,),
            full=("--seeds 40",),
            short="--seeds 2",
        ),
        Study(
            "fixed-point",
            "Compare the integer kernel with the float64 kernel on the same inputs, cycle by cycle, and their NEES.",
            f"{MODULES}.fixed_point",
            (
                Table("Fixed point against float64, {cycles} cycles", columns.FIXED_POINT, columns.FIXED_POINT),
                Table(
                    "NEES of 5 hops, {seeds} seeds",
                    columns.FIXED_POINT_NEES,
                    columns.FIXED_POINT_NEES,
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
