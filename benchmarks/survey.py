"""Survey mathematics against welleng and wellpathpy, and many wells against one by one, side by side in one run.

Run it as ``borechain bench survey`` or by itself. Every pair is timed in alternating blocks, so that a slow spell of
the machine meets both; a figure is the median of a block, a ratio the median over the blocks.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.tools.instruments import SurveyTool, load_tool
from groundstation.survey.well.analysis import analyse_survey
from groundstation.survey.well.compiled_model import COMPILED_FROM, locate_many, preload_models
from groundstation.survey.well.error_sources import Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions
from groundstation.survey.well.trajectory import Trajectory
from groundstation.survey.well.well_record import SurveyRecord

STATIONS = 1000
SHORT = COMPILED_FROM - 1  # stations of the longest survey that is compiled only where its model is held
WELLS, WELL_STATIONS = 10_000, 10  # of a batch
SHARED = 250  # errors that the stations of fifty tubes share
BLOCKS = 7
REPEATS = 15
IMPORTS = 5


def median_time(work: Callable[[], Any], repeats: int) -> float:
    """Median wall time (s) of one call, after one that warms up."""
    work()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def compare(ours: Callable[[], Any], peer: Callable[[], Any], repeats: int = REPEATS) -> dict[str, float]:
    """Seconds of both and how many times faster ours is."""
    pairs = [(median_time(ours, repeats), median_time(peer, repeats)) for _ in range(BLOCKS)]
    ratios = [p / o for o, p in pairs]
    return {
        "ours": statistics.median(o for o, _ in pairs),
        "peer": statistics.median(p for _, p in pairs),
        "ratio": statistics.median(ratios),
        "ratio_min": min(ratios),
        "ratio_max": max(ratios),
    }


def well() -> tuple[Any, Any, Any]:
    """A well of 1000 stations from the vertical to the horizontal; m and rad."""
    return np.linspace(0.0, 5000.0, STATIONS), np.linspace(0.0, np.pi / 2, STATIONS), np.linspace(0.2, 2.0, STATIONS)


def import_time(module: str) -> float:
    """Seconds a fresh interpreter takes to import a module, above one that imports nothing."""
    times = []
    for code in ("pass", f"import {module}"):
        runs = []
        for _ in range(IMPORTS):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], check=True)
            runs.append(time.perf_counter() - begin)
        times.append(statistics.median(runs))
    return times[1] - times[0]


def append_time() -> float:
    """Median seconds to append one station up to 1000 as the service does, with all errors of fifty tubes."""
    md, inclination, azimuth = (x.tolist() for x in well())
    rng = np.random.default_rng(1)
    trajectory = Trajectory()
    times = []
    for k in range(1, STATIONS):
        lean = np.sin(inclination[k]) * np.array([np.cos(azimuth[k]), np.sin(azimuth[k])])
        shared = 1e-4 * rng.standard_normal((2, SHARED))
        direction = Direction(lean, float(np.cos(inclination[k])), 1e-8 * np.eye(2), shared)
        begin = time.perf_counter()
        trajectory.append(md[k], direction)
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def batch(tool: SurveyTool, site: Site) -> dict[str, float]:
    """Seconds a well of a batch, and of the same wells one call each; the model is held."""
    random = np.random.default_rng(2)
    shape = WELLS, WELL_STATIONS
    md = np.broadcast_to(2.0 * np.arange(WELL_STATIONS), shape).copy()
    inclination, azimuth = random.uniform(0.01, 0.1, shape), random.uniform(0.0, 2.0 * np.pi, shape)
    method, lines = Method.MINIMUM_CURVATURE, list(range(WELL_STATIONS))
    alone = SurveyRecord(md[0], inclination[0], azimuth[0], lines, {})
    survey = WellSurvey(md, inclination, azimuth, md)
    found = compare(
        lambda: locate_many(method, survey, tool, site),
        lambda: analyse_survey(alone, method, tool, site).uncertainty.cov,
    )
    return {"ours": found["ours"] / WELLS, "peer": found["peer"]} | {
        name: WELLS * found[name] for name in ("ratio", "ratio_min", "ratio_max")
    }


def run() -> dict[str, Any]:
    """All ratios: seconds of ours, of the peer, and how many times faster ours is.

    A survey is what the command and the service compute: positions, doglegs, closure and covariances. The peer gets its
    positions and covariances of all sources, which is how it makes the totals too.
    """
    import welleng
    import wellpathpy

    warnings.simplefilter("ignore")
    md, inclination, azimuth = well()
    inclination_deg, azimuth_deg = np.degrees(inclination), np.degrees(azimuth)
    tool, site = load_tool("mwd-rev5.1"), Site(9.80665, 50_000.0, np.radians(72.0))
    header = welleng.survey.SurveyHeader(
        latitude=60, longitude=2, altitude=0, b_total=50_000, dip=72, declination=0, convergence=0, G=9.80665,
        azi_reference="true",
    )  # fmt: skip

    record = SurveyRecord(md, inclination, azimuth, list(range(STATIONS)), {})

    def analysed() -> Any:
        return analyse_survey(record, Method.MINIMUM_CURVATURE, tool, site).uncertainty

    def ours() -> Any:
        return analysed().cov

    def ours_by_source() -> Any:
        found = analysed()
        return found.cov, found.by_source()

    short = SurveyRecord(md[:SHORT], inclination[:SHORT], azimuth[:SHORT], list(range(SHORT)), {})

    def ours_short() -> Any:
        return analyse_survey(short, Method.MINIMUM_CURVATURE, tool, site).uncertainty.cov

    def peer_short() -> Any:
        survey: Any = welleng.survey.Survey(
            md[:SHORT], inclination_deg[:SHORT], azimuth_deg[:SHORT], header=header, error_model="ISCWSA MWD Rev5.11"
        )
        return survey.err.errors.cov_NEVs

    def peer() -> Any:
        survey: Any = welleng.survey.Survey(
            md, inclination_deg, azimuth_deg, header=header, error_model="ISCWSA MWD Rev5.11"
        )
        return survey.err.errors.cov_NEVs

    def peer_by_source() -> Any:
        survey: Any = welleng.survey.Survey(
            md, inclination_deg, azimuth_deg, header=header, error_model="ISCWSA MWD Rev5.11"
        )
        errors = survey.err.errors
        return errors.cov_NEVs, {name: part.cov_NEV for name, part in errors.errors.items()}

    def path() -> Any:
        return station_positions(Method.MINIMUM_CURVATURE, md, inclination, azimuth)

    def peer_path() -> Any:
        return wellpathpy.deviation(md, inclination_deg, azimuth_deg).minimum_curvature()

    by_arrays = compare(ours_short, peer_short)  # before a longer survey has the model held
    preload_models(["mwd-rev5.1"])
    ratios: dict[str, dict[str, float | None]] = {
        "survey of 1000 stations, totals, against welleng": dict(compare(ours, peer)),
        "the same, alternating call by call": dict(alternating(ours, peer)),
        "survey of 1000 stations, every source, against welleng": dict(compare(ours_by_source, peer_by_source)),
        f"survey of {SHORT} stations, model held, totals, against welleng": dict(compare(ours_short, peer_short)),
        f"survey of {SHORT} stations, not compiled, totals, against welleng": dict(by_arrays),
        "positions of 1000 stations, against wellpathpy": dict(compare(path, peer_path)),
        f"a well of {WELL_STATIONS} stations in a batch of {WELLS}, against a call each": dict(batch(tool, site)),
        f"append one station, {SHARED} shared errors (no peer)": {"ours": append_time(), "peer": None, "ratio": None},
    }
    ours_import, peer_import = import_time("groundstation.survey.well.analysis"), import_time("welleng.survey")
    ratios["import, against welleng"] = {
        "ours": ours_import,
        "peer": peer_import,
        "ratio": peer_import / ours_import,
    }
    return {"bench": "survey", "stations": STATIONS, "ratios": ratios}


def alternating(ours: Callable[[], Any], peer: Callable[[], Any]) -> dict[str, float]:
    """The same with one call of each in turn: every call finds the caches and the heap as the other left them."""
    pairs = []
    for _ in range(BLOCKS * 3):
        begin = time.perf_counter()
        ours()
        middle = time.perf_counter()
        peer()
        pairs.append((middle - begin, time.perf_counter() - middle))
    o, p = (statistics.median(pair[k] for pair in pairs[1:]) for k in range(2))
    return {"ours": o, "peer": p, "ratio": p / o}


if __name__ == "__main__":
    print(json.dumps(run(), indent=2))
