"""Modes of the pipe as a waveguide, their attenuation and reach, beside the published figures.

Source: thesis, chapter on radio links: bore of 3 cm radius, 2.4 and 5 GHz, budget of 110 dB, grades of API 5L.
"""

from __future__ import annotations

from typing import Any

from sim.studies.pool import Step
from telemetry.errors import RadioError
from telemetry.radio.steel import API_5L, carbon_of, steel_resistivity
from telemetry.radio.waveguide import (
    LOWEST,
    TE11,
    TM01,
    WaveguideMode,
    cut_off,
    link_reach,
    nepers_to_decibels,
    wall_attenuation,
)

RADIUS = 0.03  # m
FREQUENCIES = (2.4e9, 5e9)  # Hz
RHO = 1.12e-7  # ohm m, with which TE11 has the printed 0.034 dB/m
BUDGET = 110.0  # dB
CUT_OFFS_GHZ = {"TE11": 2.928, "TM01": 3.828, "TE21": 4.858}
ATTENUATIONS_DB = {"TE11": 0.034, "TM01": 0.082}
REACHES_M = {0.034: 3235.0, 0.030: 3666.0}  # by attenuation, dB/m
PROPAGATES = {2.4e9: 0.0, 5e9: 1.0}
# carbon %, temperature C, resistivity in 1e-8 ohm m: the nominal composition and what data sheets of the steels print
DATA_SHEETS = {
    "AISI 1010 at 20 C": (0.10, 20.0, 14.3),
    "AISI 1020 at 20 C": (0.20, 20.0, 15.9),
    "AISI 1040 at 20 C": (0.40, 20.0, 17.1),
    "AISI 1080 at 20 C": (0.80, 20.0, 18.0),
}
WARM_C = (20.0, 100.0, 200.0)


def count_steps() -> int:
    """Steps of the study: one."""
    return 1


def run_study(step: Step) -> dict[str, Any]:
    """Published values beside ours, then every grade of API 5L over its temperature."""
    result = {"experiment": "pipe-link", "cases": published_values(), "grades": grade_rows()}
    step()
    return result


def comparison_row(case: str, printed: float | None, ours: float, unit: str) -> dict[str, Any]:
    """One line of the table."""
    difference = None if printed is None else 100.0 * (ours / printed - 1.0) if printed else 100.0 * ours
    return {"case": case, "published": printed, "ours": ours, "difference_percent": difference, "unit": unit}


def published_values() -> list[dict[str, Any]]:
    """Cut-offs, attenuations, reaches and resistivities."""
    rows = [
        comparison_row(f"cut-off {mode}", CUT_OFFS_GHZ[str(mode)], float(cut_off(mode, RADIUS)) * 1e-9, "GHz")
        for mode in LOWEST
    ]
    rows += [
        comparison_row(
            f"TE11 propagates at {f * 1e-9:g} GHz",
            PROPAGATES[f],
            float(loss_db(TE11, f, RHO) is not None),
            "1 yes, 0 no",
        )
        for f in FREQUENCIES
    ]
    lost = {
        mode: float(nepers_to_decibels(wall_attenuation(mode, RADIUS, FREQUENCIES[1], RHO))) for mode in (TE11, TM01)
    }
    rows += [
        comparison_row(f"{mode}, 5 GHz, 11.2e-8 ohm m", ATTENUATIONS_DB[str(mode)], lost[mode], "dB/m") for mode in lost
    ]
    printed = ATTENUATIONS_DB["TM01"] / ATTENUATIONS_DB["TE11"]
    rows.append(comparison_row("TM01 over TE11, 5 GHz, of any steel", printed, lost[TM01] / lost[TE11], "1"))
    rows += [
        comparison_row(f"reach of 110 dB at {db:g} dB/m", metres, float(link_reach(db, BUDGET)), "m")
        for db, metres in REACHES_M.items()
    ]
    rows += [
        comparison_row(f"resistivity of {name}", given, float(steel_resistivity(carbon, warm)) * 1e8, "1e-8 ohm m")
        for name, (carbon, warm, given) in DATA_SHEETS.items()
    ]
    return rows


def grade_rows() -> list[dict[str, Any]]:
    """Resistivity, attenuation of TE11 at 5 GHz and reach by grade and temperature."""
    rows = []
    for grade in API_5L:
        for warm in WARM_C:
            carbon = carbon_of(grade)
            rho = steel_resistivity(carbon, warm)
            lost = nepers_to_decibels(wall_attenuation(TE11, RADIUS, FREQUENCIES[1], rho))
            rows.append(
                {
                    "grade": grade,
                    "carbon_percent": carbon,
                    "temperature_c": warm,
                    "resistivity_1e_8_ohm_m": float(rho) * 1e8,
                    "te11_db_per_m": float(lost),
                    "reach_m": float(link_reach(lost, BUDGET)),
                }
            )
    return rows


def loss_db(mode: WaveguideMode, frequency: float, rho: float) -> float | None:
    """Attenuation in dB/m; None below the cut-off."""
    try:
        return float(nepers_to_decibels(wall_attenuation(mode, RADIUS, frequency, rho)))
    except RadioError:
        return None


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Lines that sum the tables up."""
    reaches = [line["reach_m"] for line in result["grades"]]
    worst = max(result["cases"], key=lambda line: abs(line["difference_percent"] or 0.0))
    return [
        f"2.4 GHz is below every cut-off, 5 GHz above three; 110 dB reach {min(reaches):.0f} to {max(reaches):.0f} m",
        f"farthest from print: {worst['case']}, {worst['difference_percent']:+.1f} %",
    ]
