"""Links inside a pipe as they are asked for: cut-off, attenuation and reach of the lowest modes."""

from __future__ import annotations

from typing import Any

from telemetry.errors import RadioError
from telemetry.radio.link_request import PipeRequest
from telemetry.radio.steel import carbon_of, steel_resistivity
from telemetry.radio.waveguide import (
    LOWEST,
    TE11,
    cut_off,
    link_reach,
    nepers_to_decibels,
    wall_attenuation,
)

USUAL_CARBON = 0.26  # per cent by weight


def pipe_result(request: PipeRequest) -> dict[str, Any]:
    """The steel, and ``links``: one object a mode.

    Raises
    ------
    RadioError
        A value outside the model, or a pipe in which nothing propagates.
    """
    carbon = carbon_content(request)
    rho = float(steel_resistivity(carbon, request.temperature_c))
    radius, f = request.radius_cm * 1e-2, request.frequency_ghz * 1e9
    wall_attenuation(TE11, radius, f, rho)  # a pipe in which nothing propagates is refused
    links = [pipe_link(mode, float(cut_off(mode, radius)), radius, f, rho, request.budget_db) for mode in LOWEST]
    return {"carbon_percent": carbon, "resistivity_ohm_m": rho, "links": links}


def carbon_content(request: PipeRequest) -> float:
    """Carbon of the steel, per cent by weight; errors as ``pipe_result``."""
    if request.grade is None:
        return USUAL_CARBON if request.carbon_percent is None else request.carbon_percent
    if request.carbon_percent is not None:
        raise RadioError("--grade: expected either a grade or --carbon-percent, got both")
    return carbon_of(request.grade)


def pipe_link(mode: Any, lowest: float, radius: float, frequency: float, rho: float, budget: float) -> dict[str, Any]:
    """One link of a mode whose cut-off is ``lowest`` (Hz); nothing is lost or reached where nothing propagates."""
    row: dict[str, Any] = {"mode": str(mode), "cut_off_ghz": lowest * 1e-9, "attenuation_db_per_m": None}
    row["reach_m"] = None
    if frequency > lowest:
        lost = nepers_to_decibels(wall_attenuation(mode, radius, frequency, rho))
        row |= {"attenuation_db_per_m": float(lost), "reach_m": float(link_reach(lost, budget))}
    return row
