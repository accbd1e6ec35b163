"""Options of every process: which rig, which router, which folder, which clock and who is at its ends."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from telemetry import keys
from telemetry.bounded_bytes import bounded_text
from telemetry.errors import MediumError
from telemetry.media.credentials import needs_tls
from telemetry.media.media_table import check_medium
from telemetry.messages import BASE, ENCODER, MAX_TUBE, Side, address_name
from telemetry.runtime.command_line import InputFault
from telemetry.toml_tables import parse_toml_tables

if TYPE_CHECKING:
    from telemetry.runtime.hosting import OwnTime, Place

INSECURE = "borechain.insecure"  # in the context of a command


def read_config(context: click.Context, _parameter: click.Parameter, path: Path | None) -> None:
    """Read the options of a command from a TOML file; those on the command line win."""
    if path is None:
        return
    try:
        values = parse_toml_tables(bounded_text(path))
    except OSError as error:
        raise click.BadParameter(f"{path}: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise click.BadParameter(f"{path}: not TOML: {error}") from None
    known = {option: p.name for p in context.command.params for option in p.opts if option.startswith("--")}
    unknown = [name for name in values if f"--{name}" not in known or name == "config"]
    if unknown:
        names = ", ".join(sorted(option[2:] for option in known if option != "--config"))
        raise click.BadParameter(f"{path}: {unknown[0]}: unknown key; expected one of {names}")
    context.default_map = {known[f"--{name}"]: value for name, value in values.items()}


def remember_insecure(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    """Store the option's value for ``parse_endpoint``."""
    context.meta[INSECURE] = value


insecure_option = click.option(
    "--insecure",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=remember_insecure,
    help="Allow an endpoint on a network without TLS: anybody there may read, and without --keys is believed.",
)


def parse_endpoint(context: click.Context, _parameter: click.Parameter, value: str) -> str:
    """Return an endpoint in zenoh's form: on this machine or with TLS, unless ``--insecure`` is given."""
    protocol, _, place = value.partition("/")
    host, _, port = place.rpartition(":")
    if not (protocol.isalpha() and host and port.isdecimal()):
        raise click.BadParameter(f"expected tcp/HOST:PORT, got {value}")
    check_secure(context, value)
    return value


def secure_endpoint(context: click.Context, _parameter: click.Parameter, value: str) -> str:
    """Return an endpoint after a closer check than ``parse_endpoint``."""
    check_secure(context, value)
    return value


def check_secure(context: click.Context, endpoint: str) -> None:
    """Refuse an endpoint on a network without TLS.

    Raises
    ------
    click.BadParameter
        Unless the command was given ``--insecure``.
    """
    if needs_tls(endpoint) and not context.meta.get(INSECURE, False):
        raise click.BadParameter(
            f"expected tls/HOST:PORT, or an address of this machine alone, got {endpoint}; --insecure allows it"
        )


def endpoint_option(text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Option ``--endpoint``; ``text`` says what listens there."""
    return click.option(
        "--endpoint", default=keys.DEFAULT_ENDPOINT, show_default=True, callback=parse_endpoint, help=text
    )


def place_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every process: which rig, which router, which folder, and a file that holds any of its options."""
    for option in (
        click.option(
            "--config",
            type=click.Path(path_type=Path, dir_okay=False),
            callback=read_config,
            is_eager=True,
            expose_value=False,
            help="TOML file with options of this command, by their names without the leading dashes.",
        ),
        insecure_option,
        click.option(
            "--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig in key expressions."
        ),
        endpoint_option("zenoh router to join."),
        click.option(
            "--folder",
            type=click.Path(path_type=Path, file_okay=False),
            default=Path("state"),
            show_default=True,
            help="Where the process keeps what must survive a restart.",
        ),
    ):
        command = option(command)
    return command


@dataclass(frozen=True, slots=True)
class PlaceRequest:
    """Where a process finds its rig, as its options say."""

    rig_name: str
    endpoint: str
    folder: Path
    key_file: Path | None = None
    keys_place: Path | None = None
    upper: str | None = None
    lower: str | None = None

    def to_place(self) -> Place:
        """The place; InputFault for two kinds of keys."""
        from telemetry.runtime.hosting import Place, chosen_media

        media = chosen_media({Side.UPPER: self.upper, Side.LOWER: self.lower})
        return Place(self.rig_name, self.endpoint, self.folder, self.key_file, media, keys=self.keys_place)


key_option = click.option(
    "--key-file",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Key of the rig, 64 hex digits, readable by its owner alone. Without it no parameter block is sent or taken.",
)

keys_option = click.option(
    "--keys",
    "keys_place",
    type=click.Path(path_type=Path, exists=True),
    help="Keys that borechain pki made: the file of this process, or the folder that it lies in. With them everything "
    "said is sealed and everything heard must be; parameter blocks need no --key-file then.",
)


def parse_neighbour(_context: click.Context, _parameter: click.Parameter, value: str | None) -> int | None:
    """Address of a neighbour by its name."""
    named = {"encoder": ENCODER, "base": BASE}
    if value is None or value in named:
        return None if value is None else named[value]
    if not value.isdecimal() or not 1 <= int(value) <= MAX_TUBE:
        raise click.BadParameter(f"expected encoder, base or a tube 1..{MAX_TUBE}, got {value}")
    return int(value)


clock_option = click.option(
    "--clock",
    type=click.Choice(["stepper", "own"]),
    default="stepper",
    show_default=True,
    help="What drives the process: a stepper, step by step, or this machine's own clock.",
)
above_option = click.option(
    "--above", callback=parse_neighbour, help="Neighbour at the upper end, with --clock own: encoder, base or a tube."
)
below_option = click.option(
    "--below", callback=parse_neighbour, help="Neighbour at the lower end, with --clock own: a tube."
)


def parse_medium(context: click.Context, _parameter: click.Parameter, value: str | None) -> str | None:
    """Return the medium of an end, checked before anything is opened."""
    if value is not None:
        try:
            check_medium(value)
        except MediumError as error:
            raise click.BadParameter(str(error)) from None
        name, _, where = value.partition(":")
        if name == "zenoh":
            check_secure(context, where)
    return value


MEDIUM_HELP = "end, with --clock own: can:CHANNEL, can:CHANNEL,frames=classic or zenoh:ENDPOINT  [default: zenoh]"
upper_option = click.option("--upper", callback=parse_medium, help=f"Medium of the upper {MEDIUM_HELP}")
lower_option = click.option("--lower", callback=parse_medium, help=f"Medium of the lower {MEDIUM_HELP}")


def own_neighbours(
    clock: str,
    address: int,
    sensor: tuple[str, str | tuple[str, ...] | None],
    ends: dict[Side, int | None],
    media: dict[Side, str | None],
) -> dict[Side, int | None] | None:
    """Neighbours at the ends of a process with a clock of its own; None where a stepper drives it.

    ``sensor`` is the option that names it and what was given. An end on CAN needs no neighbour by name: it is
    what answers at the other end of the segment, and None here.

    Raises
    ------
    InputFault
        When the options do not fit each other.
    """
    joined = {side: neighbour for side, neighbour in ends.items() if neighbour is not None}
    chosen = {side: medium for side, medium in media.items() if medium is not None}
    if clock == "stepper":
        if joined or chosen:
            raise InputFault(
                "--above, --below, --upper and --lower: expected --clock own with them; otherwise the medium joins"
            )
        return None
    option, given = sensor
    if not given:
        raise InputFault(f"--clock own: expected {option} with it, since no stepper brings readings")
    if address in joined.values() or len(set(joined.values())) < len(joined):
        names = ", ".join(address_name(neighbour) for neighbour in joined.values())
        raise InputFault(f"--above, --below: expected two others than {address_name(address)} itself, got {names}")
    for side, medium in chosen.items():
        if side not in joined and not medium.startswith("can:"):
            option, end = ("--above", "--upper") if side is Side.UPPER else ("--below", "--lower")
            raise InputFault(f"{end} {medium}: expected {option} with it; only on CAN a neighbour is found")
    return {side: joined.get(side) for side in ends if side in joined or side in chosen}


@dataclass(frozen=True, slots=True)
class EndsRequest:
    """Clock of a process, and who is at its ends on which medium, as its options say."""

    clock: str
    above: int | None
    below: int | None
    upper: str | None
    lower: str | None

    def to_own_time(self, address: int, sensor: tuple[str, str | tuple[str, ...] | None]) -> OwnTime | None:
        """Settings of a process with a clock of its own; arguments and errors as ``own_neighbours``."""
        from telemetry.runtime.hosting import OwnTime

        ends = {Side.UPPER: self.above, Side.LOWER: self.below}
        media = {Side.UPPER: self.upper, Side.LOWER: self.lower}
        neighbours = own_neighbours(self.clock, address, sensor, ends, media)
        return None if neighbours is None else OwnTime(neighbours)
