"""``borechain query`` and ``borechain watch``: what a running ground station knows."""

from __future__ import annotations

import json
import queue
import sys
from typing import Any

import click

from borechain.cli.faults import EnvironmentFault, InputFault, plain_faults
from telemetry import keys

endpoint_option = click.option(
    "--endpoint", default=keys.DEFAULT_ENDPOINT, show_default=True, help="Router of the rig."
)


@click.command()
@click.argument("selector")
@endpoint_option
@click.option("--timeout", type=click.FloatRange(0.1, 600.0), default=5.0, show_default=True, help="Wall seconds.")
@click.option("--json", "as_json", is_flag=True, help="One JSON object on one line.")
@plain_faults
def query(selector: str, endpoint: str, timeout: float, as_json: bool) -> None:
    """Ask a running ground station for SELECTOR and print its answer.

    \b
    Examples:
      borechain query 'borechain/*/ground/trajectory'
      borechain query 'borechain/*/ground/trajectory?md=4..12'
      borechain query 'borechain/rig-1/cmd/take_survey?tube=3' --timeout 40
    """
    from telemetry.errors import MediumError
    from telemetry.media.zenoh_bus import open_client

    with open_client(endpoint, timeout=timeout) as bus:
        try:
            replies = bus.get(selector, timeout)
        except MediumError as error:
            raise InputFault(str(error)) from error
    answers = [reply for reply in replies if reply.error is None]
    if not answers and replies:
        raise InputFault(replies[0].error or "refused")
    if not answers:
        raise EnvironmentFault(nobody(selector, endpoint))
    show({reply.key: unpack(reply.payload) for reply in answers}, as_json=as_json)


@click.command()
@click.argument("selector")
@endpoint_option
@click.option("--count", type=click.IntRange(1), help="Stop after so many lines.")
@plain_faults
def watch(selector: str, endpoint: str, count: int | None) -> None:
    """Print what is published on SELECTOR, one JSON object a line, until Ctrl-C.

    \b
    Example:
      borechain watch 'borechain/*/ground/nodes/*'
    """
    from telemetry.media.zenoh_bus import open_client

    arrived: queue.SimpleQueue[tuple[str, bytes]] = queue.SimpleQueue()
    with open_client(endpoint, timeout=5.0) as bus:
        bus.subscribe(selector, lambda key, payload: arrived.put((key, payload)))
        seen = 0
        while count is None or seen < count:
            key, payload = arrived.get()
            click.echo(json.dumps({"key": key, "value": json.loads(payload)}))
            seen += 1


def unpack(payload: bytes) -> Any:
    """Value of a reply: JSON, or msgpack where the selector asked for it."""
    import msgpack

    return json.loads(payload) if payload[:1] == b"{" else msgpack.unpackb(payload)


def nobody(selector: str, endpoint: str) -> str:
    """What to say when no ground station feels asked."""
    known = ", ".join(key.template for key in keys.TABLE if "query" in key.kind)
    return f"{selector}: nobody at {endpoint} answers it; is a ground station running? keys are {known}"


def show(values: dict[str, Any], *, as_json: bool) -> None:
    """Print answers: a single one bare, several by their key."""
    value = next(iter(values.values())) if len(values) == 1 else values
    pretty = not as_json and sys.stdout.isatty()
    click.echo(json.dumps(value, indent=2 if pretty or not as_json else None))
