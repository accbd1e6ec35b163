"""``borechain pki``: keys of a rig, from a folder that fits on a stick."""

from __future__ import annotations

import datetime
import sys
from pathlib import Path

import click

from borechain.cli.faults import plain_faults
from borechain.cli.pki.signing import sign, verify
from telemetry import keys
from telemetry.messages import MAX_TUBE
from telemetry.runtime.command_line import InputFault

folder_option = click.option(
    "--folder",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("stick"),
    show_default=True,
    help="Folder of the rig's keys; keep it on a stick, with the person responsible for the rig.",
)
tube_argument = click.argument("tube", type=int)


@click.group()
def pki() -> None:
    """Make, revoke and change the keys by which a rig knows its own.

    \b
    Examples:
      borechain pki init --rig rig-1
      borechain pki tube 7
      borechain pki person anna --role driller
      borechain pki revoke anna
      borechain pki renew base
      borechain pki revoke 7
      borechain pki rotate
      borechain pki retire
      borechain pki password driller --file passwords
      borechain pki sign K021.pdf --certificate stick/anna.pem
      borechain pki verify K021.pdf --authority stick/ca.pem
    """


pki.add_command(sign)
pki.add_command(verify)


@pki.command()
@folder_option
@click.option("--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig.")
@click.option("--tubes", type=click.IntRange(0, MAX_TUBE), default=0, help="Also make the keys of tubes 1 to so many.")
@click.option("--if-new", is_flag=True, help="Do nothing where the folder holds keys already.")
@plain_faults
def init(folder: Path, rig_name: str, tubes: int, if_new: bool) -> None:
    """Make the folder of a rig: its secret, and keys and certificates of all that every rig has.

    \b
    Example:
      borechain pki init --folder stick --rig rig-1
    """
    from borechain.pki.rig_keys import SECRET_FILE, add_tube, init_rig
    from telemetry.errors import KeyFileError

    if if_new and (folder / SECRET_FILE).exists():
        click.echo(f"{folder}: holds keys already")
        return
    try:
        init_rig(folder, rig_name, utc_now())
        for number in range(1, tubes + 1):
            add_tube(folder, number, utc_now())
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    click.echo(
        f"{folder}: keys of the rig {rig_name}; rig.secret stays here, each .keys file goes to its process alone"
    )


@pki.command()
@tube_argument
@folder_option
@plain_faults
def tube(tube: int, folder: Path) -> None:
    """Write the key file of TUBE, which goes to that tube at its make-up.

    \b
    Example:
      borechain pki tube 7 --folder stick
    """
    from borechain.pki.rig_keys import add_tube
    from telemetry.errors import KeyFileError

    try:
        path = add_tube(folder, tube, utc_now())
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    click.echo(str(path))


@pki.command()
@click.argument("name")
@click.option("--role", type=click.Choice(["operator", "driller"]), required=True, help="One reads, the other orders.")
@folder_option
@plain_faults
def person(name: str, role: str, folder: Path) -> None:
    """Make the certificate of a person, NAME.pem and NAME.key, good for half a year.

    Take access.json to the router, which follows it within seconds, and the person's two files to its machine.

    \b
    Example:
      borechain pki person anna --role driller --folder stick
    """
    from borechain.pki.rig_keys import add_person
    from telemetry.errors import KeyFileError

    try:
        path = add_person(folder, name, role, utc_now())
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    click.echo(str(path))


@pki.command()
@click.argument("name")
@folder_option
@plain_faults
def renew(name: str, folder: Path) -> None:
    """Make the certificate of NAME anew: a person, router, base, encoder, depth, medium or tube-7.

    The one of before stays good until its end. A router that runs takes its new files within seconds, a process at its
    next connection; nothing has to be started again.

    \b
    Example:
      borechain pki renew base --folder stick
    """
    from borechain.pki.rig_keys import renew_certificate
    from telemetry.errors import KeyFileError

    try:
        path = renew_certificate(folder, name, utc_now())
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    click.echo(str(path))


@pki.command()
@click.argument("who", metavar="TUBE|NAME")
@folder_option
@plain_faults
def revoke(who: str, folder: Path) -> None:
    """Revoke a tube, so that it is believed nothing, and make new keys for all others; or shut out a person.

    Of a person no keys change: take access.json to the router, which shuts the person out within seconds, and remove
    its password with borechain pki password. Of a tube take the new files to the base, the encoder and every tube that
    can be reached; a tube that has not got its file yet goes on with its old keys, and lets the revoked one speak where
    it is its neighbour.

    \b
    Examples:
      borechain pki revoke 7 --folder stick
      borechain pki revoke anna --folder stick
    """
    from borechain.pki.access import ACCESS_FILE
    from borechain.pki.rig_keys import revoke_person, revoke_tube
    from telemetry.errors import KeyFileError

    try:
        if not who.lstrip("-").isdecimal():
            revoke_person(folder, who)
            click.echo(f"{who} is revoked; take {folder / ACCESS_FILE} to the router")
            return
        secret = revoke_tube(folder, int(who), utc_now())
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    click.echo(f"tube {who} is revoked; generation {secret.generations[-1].number} is in every other file of {folder}")


@pki.command()
@folder_option
@plain_faults
def rotate(folder: Path) -> None:
    """Make new keys for all; the old ones stay valid for a day, with a warning after that.

    \b
    Example:
      borechain pki rotate --folder stick
    """
    from borechain.pki.rig_keys import rotate_keys
    from telemetry.errors import KeyFileError

    try:
        secret = rotate_keys(folder, utc_now())
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    before, newest = secret.generations
    until = f"{before.retires_at:%Y-%m-%d %H:%M} UTC" if before.retires_at is not None else "it is retired"
    click.echo(
        f"generation {newest.number} is in every file of {folder}; generation {before.number} is valid until {until}"
    )


@pki.command()
@folder_option
@plain_faults
def retire(folder: Path) -> None:
    """End the keys from before the last change, once every process of the rig has the new ones.

    \b
    Example:
      borechain pki retire --folder stick
    """
    from borechain.pki.rig_keys import retire_keys
    from telemetry.errors import KeyFileError

    try:
        secret = retire_keys(folder)
    except KeyFileError as error:
        raise InputFault(str(error)) from error
    click.echo(f"generation {secret.generations[-1].number} alone is in every file of {folder}")


@pki.command()
@click.argument("role", type=click.Choice(["operator", "driller"]))
@click.option(
    "--file",
    "path",
    type=click.Path(path_type=Path, dir_okay=False),
    default=Path("passwords"),
    show_default=True,
    help="Where the hashes are kept, for --page-passwords.",
)
@click.option("--name", default="", metavar="PERSON", help="Of one person in that role, who signs in by this name.")
@click.option("--remove", is_flag=True, help="Take the password away; its sessions end within seconds.")
@plain_faults
def password(role: str, path: Path, name: str, remove: bool) -> None:
    """Set the password of ROLE on the page: an operator reads, a driller orders. It is asked for, or read from a pipe.

    \b
    Examples:
      borechain pki password driller --file passwords
      borechain pki password driller --name anna --file passwords
      borechain pki password driller --name anna --remove --file passwords
    """
    from borechain.pki.private_files import write_private
    from groundstation.gateway.page.passwords import hash_of, holder_of, read_passwords, text_of

    known = read_passwords(path) if path.exists() else {}
    if "/" in name or len(name.split()) > 1 or not name.isascii():
        raise InputFault(f"--name: expected a name of one word, got {name!r:.60}")
    holder = holder_of(role, name)
    if remove:
        if holder not in known:
            raise InputFault(f"{path}: expected one of {', '.join(sorted(known)) or 'none'}, got {holder}")
        write_private(path, text_of({one: hashed for one, hashed in known.items() if one != holder}))
        click.echo(f"{path}: {holder} has no password any more; its sessions end within seconds")
        return
    text = click.prompt("Password", hide_input=True, confirmation_prompt=True) if stdin_is_terminal() else read_line()
    write_private(path, text_of(known | {holder: hash_of(text)}))
    click.echo(f"{path}: password of {holder}; borechain ground --page-passwords {path} takes it at once")


def stdin_is_terminal() -> bool:
    """Return whether a question can be asked on the terminal."""
    return sys.stdin.isatty()


def read_line() -> str:
    """The password on standard input, without its line end."""
    return sys.stdin.readline().rstrip("\r\n")


def utc_now() -> datetime.datetime:
    """Now, to the second."""
    return datetime.datetime.now(datetime.UTC).replace(microsecond=0)
