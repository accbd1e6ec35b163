"""``borechain query`` and ``borechain watch``: what a running ground station knows."""

from __future__ import annotations

import json
import queue
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import EnvironmentFault, InputFault, plain_faults
from telemetry import keys
from telemetry.runtime.process_options import endpoint_option, insecure_option, keys_option

if TYPE_CHECKING:
    from telemetry.media.zenoh_bus import QueryReply

SILENCE = 5.0  # wall s without a sample before ``watch`` says so
PATIENCE, ORDER_PATIENCE = 5.0, 40.0  # s; the ground station itself waits 30 s for a tube
TIMEOUT = "Timeout"  # zenoh's text for an answer that did not come
rig_option = endpoint_option("Router of the rig.")
role_option = click.option(
    "--role",
    metavar="NAME",
    default="operator",
    show_default=True,
    help="Whose certificate of the folder --keys to show over TLS: a person's, or that of all operators or drillers.",
)


@click.command()
@click.argument("selector")
@insecure_option
@rig_option
@keys_option
@role_option
@click.option(
    "--timeout",
    type=click.FloatRange(0.1, 600.0),
    help="Seconds to wait for the router, and then for the answer  [default: 5; 40 for an order]",
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on one line.")
@click.option("--csv", "as_csv", is_flag=True, help="The rows of one answer, such as stations, as CSV.")
@plain_faults
def query(
    selector: str,
    endpoint: str,
    keys_place: Path | None,
    role: str,
    timeout: float | None,
    as_json: bool,
    as_csv: bool,
) -> None:
    """Ask a running ground station for SELECTOR and print its answer.

    \b
    Examples:
      borechain query 'borechain/*/ground/trajectory'
      borechain query 'borechain/*/ground/trajectory?md=4..12'
      borechain query 'borechain/rig-1/ground/stations' --csv > stations.csv
      borechain query 'borechain/rig-1/cmd/take_survey?tube=3'
    """
    from borechain.rig_search import who_is_there
    from telemetry.media.credentials import credentials_for
    from telemetry.media.zenoh_bus import open_client

    check_selector(selector)
    patience = timeout or (ORDER_PATIENCE if keys.is_order(selector) else PATIENCE)
    with open_client(endpoint, timeout or PATIENCE, credentials_for(endpoint, keys_place, role)) as bus:
        replies = bus.get(selector, patience)
        there = "" if replies else who_is_there(bus)
    answers = [reply for reply in replies if reply.error is None]
    if not answers and any(reply.error != TIMEOUT for reply in replies):
        raise InputFault(next(reply.error or "refused" for reply in replies if reply.error != TIMEOUT))
    if not answers and replies:
        raise EnvironmentFault(f"{selector}: no answer within {patience:g} s; a longer --timeout may help")
    if not answers:
        raise EnvironmentFault(f"{selector}: no answer from {endpoint}; {there}. {known_keys()}")
    if as_csv:
        click.echo(csv_of(answers), nl=False)
        return
    show_answers({reply.key: value_of(reply.payload) for reply in answers}, as_json=as_json)


def csv_of(answers: list[QueryReply]) -> str:
    """The rows of one answer as CSV.

    Raises
    ------
    InputFault
        When there are several answers, or the one has no rows, or is none of a ground station.
    """
    from groundstation.errors import SelectorError
    from groundstation.service.answers.answer_table import find_answer
    from groundstation.service.answers.csv_tables import table_of

    if len(answers) != 1:
        raise InputFault(f"--csv: expected one answer, got {len(answers)}: {', '.join(one.key for one in answers[:5])}")
    key, payload = answers[0].key, answers[0].payload
    path = key.partition("/ground/")[2]
    try:
        return table_of(path, find_answer(path).fields, json.loads(payload))
    except SelectorError as error:
        raise InputFault(f"--csv: {error}") from error
    except (ValueError, LookupError, TypeError) as error:
        raise InputFault(f"--csv: {key}: expected rows of a ground station, got {bytes(payload)!r:.60}") from error


@click.command()
@click.argument("selector")
@insecure_option
@rig_option
@keys_option
@role_option
@click.option("--count", type=click.IntRange(1), help="Stop after so many lines.")
@click.option("--timeout", type=click.FloatRange(0.1), help="Give up after so many seconds without a line.")
@plain_faults
def watch(
    selector: str, endpoint: str, keys_place: Path | None, role: str, count: int | None, timeout: float | None
) -> None:
    """Print what is published on SELECTOR, one JSON object a line, until Ctrl-C.

    A binary value is shown decoded where it is msgpack, else as {"hex": ...}.

    \b
    Examples:
      borechain watch 'borechain/*/ground/nodes/*'
      borechain watch 'borechain/rig-1/ground/status' --count 1 --timeout 10
    """
    from telemetry.media.credentials import credentials_for
    from telemetry.media.zenoh_bus import open_client

    check_selector(selector)
    arrived: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
    with open_client(endpoint, PATIENCE, credentials_for(endpoint, keys_place, role)) as bus:
        bus.subscribe(selector, lambda key, payload: arrived.put((key, payload)))
        seen = 0
        while count is None or seen < count:
            key, payload = next_sample(arrived, selector, timeout)
            click.echo(json.dumps({"key": key, "value": value_of(payload)}))
            seen += 1


def check_selector(selector: str) -> None:
    """Refuse an invalid key expression before anything connects.

    Raises
    ------
    InputFault
        Naming the keys there are.
    """
    from telemetry.media.zenoh_bus import keys_intersect

    key = selector.partition("?")[0]
    if not keys_intersect(key, key):
        raise InputFault(f"{selector}: expected a key expression, as borechain/*/ground/status; {known_keys()}")


def next_sample(
    arrived: queue.SimpleQueue[tuple[str, bytes]], selector: str, timeout: float | None
) -> tuple[str, bytes]:
    """The next sample; a silence is reported on stderr once, and ends the command after ``timeout`` (s).

    Raises
    ------
    EnvironmentFault
        When nothing came in time.
    """
    begin = time.monotonic()
    patience = SILENCE if timeout is None else min(SILENCE, timeout)
    try:
        return arrived.get(timeout=patience)
    except queue.Empty:
        click.echo(
            f"nothing on {selector} for {patience:g} s; waiting, Ctrl-C ends it. {known_keys('publish')}", err=True
        )
    try:
        return arrived.get(timeout=None if timeout is None else max(0.0, begin + timeout - time.monotonic()))
    except queue.Empty:
        raise EnvironmentFault(f"{selector}: nothing was published within {timeout:g} s") from None


def value_of(payload: bytes) -> Any:
    """Value of a payload: JSON, msgpack where it can be shown as JSON, or the bytes in hex."""
    import msgpack

    try:
        return json.loads(payload)
    except ValueError:
        pass
    try:
        value = msgpack.unpackb(payload)
        json.dumps(value)
    except (ValueError, TypeError, msgpack.UnpackException):
        return {"hex": payload.hex()}
    return value


def known_keys(kind: str = "query") -> str:
    """Which keys can be asked for, or are published."""
    from groundstation.service.answers.answer_table import known_keys

    return f"keys are {', '.join(key.template for key in known_keys() if kind in key.kind)}"


def show_answers(values: dict[str, Any], *, as_json: bool) -> None:
    """Print answers: a single one bare, several by their key."""
    value = next(iter(values.values())) if len(values) == 1 else values
    pretty = not as_json and sys.stdout.isatty()
    click.echo(json.dumps(value, indent=2 if pretty or not as_json else None))
