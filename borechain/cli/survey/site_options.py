"""Options of the place that a survey or a clearance is computed for."""

from __future__ import annotations

import click

from telemetry.runtime.typed_options import Option


def site_options(field: str, declination: str) -> tuple[Option, ...]:
    """Options of ``SiteFigures``, with the help of the magnetic field and of its declination."""
    return (
        click.option(
            "--at",
            metavar="LAT,LON[,HEIGHT]",
            help="Place of the site, deg and m: works out what is not stated. A magnetic instrument needs it, or its "
            "field.",
        ),
        click.option("--date", metavar="DAY", help="Day of the magnetic field, such as 2026-11-27."),
        click.option("--grid-crs", metavar="CODE", help="National grid, such as EPSG:25833: convergence and scale."),
        click.option("--gravity", type=float, help="Gravity of the site, m/s^2; 9.81, or of --at."),
        click.option("--field-nt", type=float, help=field),
        click.option("--dip-deg", type=float, help="Dip of the magnetic field."),
        click.option("--declination-deg", type=float, help=declination),
        click.option("--latitude-deg", type=float, help="Latitude, for gyroscopes; 52, or of --at."),
    )
