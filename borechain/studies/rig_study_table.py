"""Table of the studies of whole rigs: lines as those of ``sim.studies.study_table``, which knows no ground station."""

from __future__ import annotations

from typing import Final

from sim.named import by_name
from sim.studies.study import Columns, Option, ResultTable, Study
from sim.studies.study_table import STUDIES

MODULES: Final = "borechain.studies"
STATIONS: Columns = (
    ("case", "station"),
    ("md_m", "md, m"),
    ("north", "north, % inside 95 %"),
    ("east", "east"),
    ("vertical", "vertical"),
    ("direction", "direction"),
    ("ellipsoid", "ellipsoid"),
    ("direction_nees", "NEES of the direction"),
    ("ellipsoid_nees", "of the ellipsoid"),
    ("stated_deg", "direction stated, deg"),
    ("best_deg", "best possible"),
    ("ratio", "ratio"),
)
SKETCH: Columns = (
    ("case", "what is known of the tubes"),
    ("faces", "stops at"),
    ("play_deg", "play, deg"),
    ("toe_mm", "toe rms, mm"),
    ("toe_stated_mm", "stated"),
    ("direction_deg", "direction rms, deg"),
    ("direction_stated_deg", "stated"),
    ("direction_best_deg", "best possible"),
)
BLUNDERS: Columns = (
    ("case", "blunder"),
    ("size", "size"),
    ("rigs", "rigs"),
    ("named", "named rightly"),
    ("doubted", "told as a doubt"),
    ("below", "below 3 sigma"),
    ("unseen", "beyond, in no reading"),
    ("missed", "beyond, without a word"),
    ("beyond_on_target", "beyond and ON TARGET"),
    ("worst_sigmas", "worst error, sigma"),
    ("direction_sigmas", "of a direction"),
    ("toe_mm", "toe, mm"),
    ("causes", "named"),
    ("seen_by", "seen by alone"),
)
NODE_DAYS: Columns = (
    ("case", "day of one node"),
    ("seeds", "seeds"),
    ("much_untold_percent", "more than 2 % of the time untold, % of seeds"),
    ("much_untold_low", "from"),
    ("much_untold_high", "to"),
    ("untold_percent", "time untold, %"),
    ("surveys", "surveys"),
    ("yaw_beyond_percent", "yaw beyond 3 sigma untold, %"),
    ("yaw_beyond_low", "from"),
    ("yaw_beyond_high", "to"),
    ("azimuth_beyond_percent", "azimuth likewise, %"),
    ("azimuth_beyond_low", "from"),
    ("azimuth_beyond_high", "to"),
)
RIG_DAYS: Columns = (
    ("case", "day of a rig"),
    ("rigs", "rigs"),
    ("stations", "stations"),
    ("beyond_percent", "directions beyond 3 sigma, %"),
    ("untold_percent", "beyond and untold, %"),
    ("untold_low", "from"),
    ("untold_high", "to"),
    ("told_percent", "rigs that are told of something, %"),
)
FIRST: Final = Option("first", 1, 0, 2**31 - 1, help="Number from which the rigs are drawn.")
RIG_STUDIES: Final = by_name(
    "studies",
    [
        Study(
            "set-up",
            "How often what is said of a hole holds, over rigs whose set-up errs as it is stated.",
            f"{MODULES}.set_up",
            (
                ResultTable("Regions of {seeds} rigs", STATIONS, STATIONS),
                ResultTable("{rigs} rigs a row", SKETCH, SKETCH, rows="sketch", suffix="-known"),
            ),
            (
                Option("seeds", 1000, 2, 100_000),
                Option("rigs", 40, 2, 10_000, help="Of each row of the second table."),
                FIRST,
            ),
            counts="rigs",
            full=("--seeds 1000 --rigs 40",),
            short="--seeds 2 --rigs 2",
        ),
        Study(
            "blunders",
            "What becomes of blunders of set-up, sensors, depth and crew: named, doubted, or too small to matter.",
            f"{MODULES}.blunders",
            (ResultTable("Blunders, {seeds} rigs a size, and {honest} honest ones", BLUNDERS, BLUNDERS),),
            (
                Option("seeds", 200, 1, 10_000),
                Option("honest", 1000, 1, 100_000, help="Rigs without a blunder."),
                FIRST,
            ),
            counts="rigs",
            drawn=False,
            full=("--seeds 29 --honest 2000",),
            short="--seeds 1 --honest 1",
        ),
        Study(
            "bad-days",
            "What days of five to eight mild disturbances leave untold: of one node, and after a rig's adjustment.",
            f"{MODULES}.bad_days",
            (
                ResultTable("Bad days of one node, {seeds} seeds", NODE_DAYS, NODE_DAYS),
                ResultTable(
                    "Bad days of a rig after its adjustment, {rigs} rigs a row",
                    RIG_DAYS,
                    RIG_DAYS,
                    rows="rig_cases",
                    suffix="-rigs",
                ),
            ),
            (
                Option("seeds", 1000, 1, 100_000, help="Of one node."),
                Option("rigs", 100, 1, 10_000, help="Of each row of the second table."),
                FIRST,
            ),
            drawn=False,
            full=("--seeds 40 --rigs 4",),
            short="--seeds 2 --rigs 1",
        ),
    ],
)


def all_studies() -> dict[str, Study]:
    """Studies of both tables."""
    return STUDIES | RIG_STUDIES
