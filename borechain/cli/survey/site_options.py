"""Options of the place that a survey or a clearance is computed for."""

from __future__ import annotations

import click

from telemetry.runtime.typed_options import Option


def site_options(field: str, declination: str) -> tuple[Option, ...]:
    """Options of ``SiteFigures``, with the help of the magnetic field and of its declination."""
    return (
        click.option("--gravity", type=float, default=9.81, show_default=True, help="Gravity of the site, m/s^2."),
        click.option("--field-nt", type=float, default=50_000.0, show_default=True, help=field),
        click.option("--dip-deg", type=float, default=70.0, show_default=True, help="Dip of the magnetic field."),
        click.option("--declination-deg", type=float, default=0.0, show_default=True, help=declination),
        click.option("--latitude-deg", type=float, default=52.0, show_default=True, help="Latitude, for gyroscopes."),
    )
