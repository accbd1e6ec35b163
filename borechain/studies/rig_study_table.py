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
            full=("--seeds 9 --honest 1000",),
            short="--seeds 1 --honest 1",
        ),
    ],
)


def all_studies() -> dict[str, Study]:
    """Studies of both tables."""
    return STUDIES | RIG_STUDIES
