"""Links through soil as they are asked for: what is received over water and distance, one object a link."""

from __future__ import annotations

from typing import Any

from telemetry.radio.link_request import SoilRequest
from telemetry.radio.path_loss import link_margin, packet_error_rate, path_loss, propagation_constants, received_power
from telemetry.radio.soil_dielectric import Soil, soil_permittivity


def soil_power(request: SoilRequest, sand: Any, clay: Any, water: float, distance: Any) -> Any:
    """Received power (dBm) through a soil of this texture; scalars, or arrays of one shape.

    Raises
    ------
    RadioError
        A value outside the model.
    """
    f = request.frequency_mhz * 1e6
    eps = soil_permittivity(Soil(sand, clay, request.density, water, request.temperature_c), f)
    lost = path_loss(*propagation_constants(*eps, f), distance)
    return received_power(lost, request.transmit_dbm, 2.0 * request.gain_dbi)


def soil_links(request: SoilRequest) -> list[dict[str, Any]]:
    """Every link, the distances of each content of water together; errors as ``soil_power``."""
    return [soil_link(request, water, distance) for water in request.waters for distance in request.distances]


def soil_link(request: SoilRequest, water: float, distance: float) -> dict[str, Any]:
    """One link; errors as ``soil_power``."""
    dbm = float(soil_power(request, request.sand, request.clay, water, distance))
    over = float(link_margin(dbm, request.threshold_dbm))
    return {
        "water_percent": 100.0 * water,
        "distance_m": distance,
        "received_dbm": dbm,
        "margin_db": over,
        "packet_error_rate": float(packet_error_rate(over)),
    }
