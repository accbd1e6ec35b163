"""What a radio hears through soil, beside the published figures, and the delivery of surveys through wet clay.

Source: thesis, chapter on radio links: 868 MHz, 2 dBm, tube ends 100 to 300 mm apart, threshold -103 dBm.
"""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from sim.studies.pool import Step
from sim.studies.soil_link.delivery_time import STEP, quantile
from sim.studies.soil_link.wet_clay import expected_delivery, largest_difference, surveys_of, wet_clay
from telemetry.radio.path_loss import Logarithm, link_margin, path_loss, propagation_constants, received_power
from telemetry.radio.soil_dielectric import PorosityWarning, Soil, soil_permittivity

Array = npt.NDArray[np.float64]
FREQUENCY = 868e6  # Hz
DENSITY = 1.5  # g/cm^3
WATERS = (0.01, 0.25, 0.80)
DISTANCES = (0.1, 0.2, 0.3)  # m
PUBLISHED_DBM = {0.01: -54.5, 0.80: -95.1}
STATED_DBM = {0.01: (-32.0, -22.0), 0.80: (-73.0, -41.0)}  # of the formula with log10, over all textures
TEXTURES = {  # sand and clay; the first five are those that the dielectric model was fitted to
    "sandy loam": (0.515, 0.135),
    "loam": (0.42, 0.085),
    "silt loam A": (0.306, 0.135),
    "silt loam B": (0.172, 0.190),
    "silty clay": (0.050, 0.474),
    "sand": (0.90, 0.05),
    "clay": (0.20, 0.60),
}
GRID = 41  # textures along one side of the triangle
SHARES = (0.5, 0.75, 0.9, 0.95)


def received_dbm(soil: Soil, distance: npt.ArrayLike, log: Logarithm = np.log10) -> Array:
    """Received power, dBm, without a warning of water that no soil holds: the published case has it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PorosityWarning)
        eps = soil_permittivity(soil, FREQUENCY)
    return received_power(path_loss(*propagation_constants(*eps, FREQUENCY), distance, log))


def texture_triangle() -> tuple[Array, Array]:
    """Sand and clay fractions (n,) over all textures."""
    sand, clay = np.meshgrid(np.linspace(0.0, 1.0, GRID), np.linspace(0.0, 1.0, GRID))
    inside = sand + clay <= 1.0 + 1e-9
    return sand[inside], clay[inside]


def count_steps(tubes: int) -> int:
    """Steps of the study: the figures, then the drilling."""
    del tubes
    return 2


def run_study(tubes: int, step: Step) -> dict[str, Any]:
    """Published powers beside ours, the map of margins, and the delivery of every survey of the wet-clay scenario."""
    sand, clay = texture_triangle()
    fields = {water: link_margin(received_dbm(Soil(sand, clay, DENSITY, water), DISTANCES[-1])) for water in WATERS}
    step()
    delivered, times, distribution = measure_delivery(tubes)
    step()
    return {
        "experiment": "soil-link",
        "tubes": tubes,
        "cases": published_powers(),
        "map": feasibility_map(),
        "delivery": delivered,
        "surveys": len(times),
        "traces": {"sand": sand, "clay": clay, "margins": fields, "times": times, "expected": distribution},
    }


def published_powers() -> list[dict[str, Any]]:
    """The printed powers beside the range over all textures, with log10 and with the natural logarithm."""
    sand, clay = texture_triangle()
    rows = []
    for water, printed in PUBLISHED_DBM.items():
        low, high = STATED_DBM[water]
        for name, log in (("log10", np.log10), ("natural logarithm", np.log)):
            found = received_dbm(Soil(sand, clay, DENSITY, water), DISTANCES[-1], log)
            rows.append(
                {
                    "case": f"{100.0 * water:g} % water, {name}",
                    "published": printed,
                    "ours": float(np.median(found)),
                    "low": float(found.min()),
                    "high": float(found.max()),
                    "difference": float(np.median(found)) - printed,
                    "holds": bool(found.min() <= printed <= found.max()),
                    "unit": "dBm over all textures, 0.3 m",
                }
            )
            if log is np.log10:
                rows[-1]["stated_low"], rows[-1]["stated_high"] = low, high
            else:
                rows[-1]["stated_low"] = rows[-1]["stated_high"] = None
    return rows


def feasibility_map() -> list[dict[str, Any]]:
    """Received power and margin by texture, water and distance."""
    rows = []
    for texture, (sand, clay) in TEXTURES.items():
        for water in WATERS:
            for distance in DISTANCES:
                dbm = float(received_dbm(Soil(sand, clay, DENSITY, water), distance))
                rows.append(
                    {
                        "texture": texture,
                        "sand": sand,
                        "clay": clay,
                        "water_percent": 100.0 * water,
                        "distance_m": distance,
                        "received_dbm": dbm,
                        "margin_db": float(link_margin(dbm)),
                    }
                )
    return rows


def measure_delivery(tubes: int) -> tuple[list[dict[str, Any]], Array, Array]:
    """Quantiles of the delivery time beside their expectation; the times (n,) and the distribution behind them."""
    world = wet_clay(tubes)
    surveys = surveys_of(world)
    times = np.array([seconds for _, seconds in surveys])
    distribution = expected_delivery(world, surveys)
    made = tubes * (tubes + 1) // 2
    rows = [
        {"quantity": "surveys that arrived", "ours": float(len(times)), "expected": float(made), "unit": "1"},
        {
            "quantity": "mean",
            "ours": float(times.mean()),
            "expected": float(distribution @ np.arange(len(distribution))) * STEP,
            "unit": "s",
        },
    ]
    for share in SHARES:
        observed = float(np.quantile(times, share, method="inverted_cdf"))
        rows.append(
            {
                "quantity": f"{100.0 * share:g} % arrived within",
                "ours": observed,
                "expected": quantile(distribution, share),
                "unit": "s",
            }
        )
    apart = largest_difference(times, distribution)
    rows.append({"quantity": "largest difference of the shares", "ours": apart, "expected": None, "unit": "1"})
    return rows, times, distribution


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Lines that sum the tables up."""
    natural = [row for row in result["cases"] if "natural" in row["case"]]
    margins = [row["margin_db"] for row in result["map"]]
    return [
        f"the printed powers lie inside the range of the natural logarithm in {sum(row['holds'] for row in natural)} "
        f"of {len(natural)} cases, and of log10 in "
        f"{sum(row['holds'] for row in result['cases'] if row not in natural)}",
        f"margins of {min(margins):.0f} to {max(margins):.0f} dB over the threshold of -103 dBm: "
        f"{sum(m > 0.0 for m in margins)} of {len(margins)} links can be heard",
        f"{result['surveys']} of {int(result['delivery'][0]['expected'])} surveys arrived through wet clay",
    ]
