"""``borechain bench page``, ``day``, ``learn``, ``doors``, ``killed``: a ground station loaded, old, beset, killed."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import EnvironmentFault, plain_faults, require_modules
from borechain.cli.shared_options import json_option, seed_option
from telemetry.runtime.process_options import endpoint_option

if TYPE_CHECKING:
    from groundstation.gateway.page.page_settings import PageSettings

page_option = click.option(
    "--page", "address", metavar="HOST:PORT", default="127.0.0.1:8080", show_default=True, help="Address of the page."
)


@click.command()
@click.option("--tubes", type=click.IntRange(1, 250), default=50, show_default=True, help="Tubes that send.")
@click.option("--browsers", type=click.IntRange(0, 60), default=3, show_default=True, help="Browsers on the page.")
@click.option("--terminals", type=click.IntRange(0, 60), default=2, show_default=True, help="Followers of the keys.")
@click.option(
    "--seconds", type=click.FloatRange(5.0, 86400.0), default=150.0, show_default=True, help="Duration of the load."
)
@page_option
@endpoint_option("Where its router listens.")
@json_option
@require_modules("orjson", "rich", "scipy", "sqlalchemy", "starlette", "uvicorn")
@plain_faults
def page(tubes: int, browsers: int, terminals: int, seconds: float, address: str, endpoint: str, as_json: bool) -> None:
    """Have a ground station with its page bear a shift: tubes at 1.9 Hz that drill and survey, readers, questions.

    \b
    Example:
      borechain bench page --tubes 50 --browsers 3 --terminals 2
    """
    from borechain.load.page import Load, measure_load

    served = free_page(address, endpoint)
    load = Load(tubes, browsers, terminals, seconds)
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        result: dict[str, Any] = {"bench": "page", "tubes": tubes, "seconds": seconds}
        result |= measure_load(load, endpoint, served, Path(folder))
    if as_json:
        click.echo(json.dumps(result))
        return
    begin, *_, end = result["memory_s_mb"]
    middle = result["memory_s_mb"][len(result["memory_s_mb"]) // 2]
    memory = f"{begin[1]:.1f} MB at first, {middle[1]:.1f} MB after {middle[0]:.0f} s, {end[1]:.1f} MB at the end"
    click.echo(f"ground station: {result['cpu_percent']:.1f} % of a core, {memory}")
    for name, what in (("browser", "news on the page"), ("terminal", "news on the keys")):
        click.echo(latency_line(f"{what}, {name}", result[f"{name}_late_ms"]))
    click.echo(latency_line(f"answers to questions, {result['unanswered']} without one", result["answer_ms"]))
    click.echo(latency_line("answers of a process that does nothing else", result["bare_ms"]))
    click.echo(f"{result['stations']} stations of {result['surveys']} surveys")


def free_page(address: str, endpoint: str) -> PageSettings:
    """Settings of a page at ``address``, checked to be free like the endpoint; a plain error otherwise."""
    from groundstation.gateway.page.page_settings import PageSettings, open_page_socket, parse_address
    from sim.rig.launcher import check_port_free

    served = PageSettings(*parse_address(address))
    open_page_socket(served).close()
    check_port_free(endpoint)
    return served


@click.command()
@click.option("--hours", type=click.FloatRange(0.1, 168.0), default=24.0, show_default=True, help="Hours of drilling.")
@click.option("--tubes", type=click.IntRange(1, 250), default=50, show_default=True, help="Surveyed at every stop.")
@page_option
@endpoint_option("Where its router listens.")
@json_option
@require_modules("orjson", "rich", "scipy", "sqlalchemy", "starlette", "uvicorn")
@plain_faults
def day(hours: float, tubes: int, address: str, endpoint: str, as_json: bool) -> None:
    """Start a ground station upon the surveys of hours of drilling, and open its history on the page.

    \b
    Example:
      borechain bench day --hours 24
    """
    from borechain.load.day import measure_day

    served = free_page(address, endpoint)
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        result: dict[str, Any] = {"bench": "day", "hours": hours, "tubes": tubes}
        result |= measure_day(hours, tubes, endpoint, served, Path(folder))
    if as_json:
        click.echo(json.dumps(result))
        return
    start = f"answers {result['started_s']:.1f} s after its start, {result['started_cpu_s']:.1f} s of CPU"
    click.echo(f"{result['surveys']} surveys at {result['stations']} stations: {start}")
    again = f"asked again {result['history_ms']:.0f} ms"
    click.echo(f"page opened: {result['picture_ms']:.0f} ms until the history has come; {again}")
    click.echo(latency_line("an earlier moment", result["moment_ms"]))
    click.echo(f"memory: {result['private_mb']:.0f} MB")


@click.command()
@click.option("--half-open", type=click.IntRange(0, 5000), default=400, show_default=True, help="Connections.")
@click.option("--streams", type=click.IntRange(0, 1000), default=64, show_default=True, help="That are not read.")
@click.option("--wrong", type=click.IntRange(0, 1000), default=150, show_default=True, help="Wrong passwords at once.")
@click.option("--asks", type=click.IntRange(2, 10_000), default=100, show_default=True, help="Of who is signed in.")
@page_option
@endpoint_option("Where its router listens.")
@json_option
@require_modules("orjson", "rich", "scipy", "sqlalchemy", "starlette", "uvicorn")
@plain_faults
def doors(half_open: int, streams: int, wrong: int, asks: int, address: str, endpoint: str, as_json: bool) -> None:
    """Beset the door of a page, and measure how long who is signed in waits for an answer.

    \b
    Example:
      borechain bench doors --half-open 400 --streams 64 --wrong 150
    """
    from borechain.load.doors import Siege, measure_doors

    served = free_page(address, endpoint)
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        siege = Siege(half_open, streams, wrong, asks)
        result: dict[str, Any] = {"bench": "doors"} | measure_doors(siege, endpoint, served, Path(folder))
    if as_json:
        click.echo(json.dumps(result))
        return
    click.echo(latency_line("answers while the door is free", result["free_ms"]))
    click.echo(latency_line("answers while it is beset", result["answer_ms"]))


@click.command()
@click.option(
    "--surveys", type=click.IntRange(500, 1_000_000), default=10_000, show_default=True, help="Stored before."
)
@click.option("--tubes", type=click.IntRange(2, 250), default=50, show_default=True, help="Surveyed at every stop.")
# after 15 stops the bit is deeper than its string by what a ground station lets pass
@click.option("--stops", type=click.IntRange(3, 15), default=12, show_default=True, help="Stops to learn.")
@json_option
@require_modules("orjson", "rich", "scipy", "sqlalchemy")
@plain_faults
def learn(surveys: int, tubes: int, stops: int, as_json: bool) -> None:
    """What a ground station that has thousands of surveys needs to start, to learn one more and to answer, in CPU time.

    \b
    Example:
      borechain bench learn --surveys 10000
    """
    from borechain.cli.console_tables import show_table
    from borechain.load.learning import measure_learning
    from borechain.load.placing_calls import CALLS_AT_MOST, count_placing_calls
    from groundstation.ground_host import load_kernels

    load_kernels()
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        result: dict[str, Any] = {"bench": "learn", "tubes": tubes}
        result |= measure_learning(surveys, tubes, stops, Path(folder))
        calls = {one: max(count_placing_calls(Path(folder) / one.value, one)) for one in CALLS_AT_MOST}
        result["calls_to_place_one"] = [
            {"weighting": one.value, "max": most, "bound": CALLS_AT_MOST[one], "holds": most <= CALLS_AT_MOST[one]}
            for one, most in calls.items()
        ]
    if as_json:
        click.echo(json.dumps(result))
        return
    columns = [(key, key) for key in ("what", "unit", "p50", "p99", "max", "count", "bound", "holds")]
    show_table(f"{result['surveys']} surveys at {result['stations']} stations, CPU time", result["figures"], columns)
    sizes = ", ".join(f"{size:.0f} bytes {of}" for of, size in result["store_bytes_of_a_survey"].items())
    click.echo(f"database, for each survey: {sizes}")
    for one, most in calls.items():
        bound = CALLS_AT_MOST[one]
        click.echo(f"Python calls of the ground station to place one, {one}: {most} at most, the bound is {bound}")


def latency_line(what: str, figures: dict[str, Any]) -> str:
    """Figures for people."""
    if not figures["count"]:
        return f"{what}: none"
    return (
        f"{what}: median {figures['p50']:.1f} ms, 99 % within {figures['p99']:.1f} ms, "
        f"all within {figures['max']:.1f} ms, of {figures['count']}"
    )


@click.command()
@click.option("--times", type=click.IntRange(1, 10_000), default=200, show_default=True, help="Number of kills.")
@click.option(
    "--database", metavar="URL", help="An empty database, such as postgresql://USER@HOST/NAME  [default: SQLite]"
)
@endpoint_option("Where its router listens.")
@json_option
@seed_option
@require_modules("orjson", "rich", "scipy", "sqlalchemy")
@plain_faults
def killed(times: int, database: str | None, endpoint: str, as_json: bool, seed: int) -> None:
    """Kill a ground station at random moments while it takes events, and check that what it receipted is kept.

    Exit status 1 when anything was lost or doubled.

    \b
    Example:
      borechain bench killed --times 200
    """
    from borechain.load.killed import kill_again_and_again
    from borechain.load.page import latency_quantiles
    from sim.rig.launcher import check_port_free

    check_port_free(endpoint)
    with tempfile.TemporaryDirectory(prefix="borechain-") as folder:
        outcome = kill_again_and_again(times, endpoint, Path(folder), database, seed)
    back = latency_quantiles(outcome.back_s[1:])
    result = {"bench": "killed", "times": times, "handed": outcome.handed}
    result |= {"lost": outcome.lost, "doubled": outcome.doubled, "back_ms": back}
    if as_json:
        click.echo(json.dumps(result))
    else:
        click.echo(f"{outcome.handed} events, {outcome.lost} lost, {outcome.doubled} doubled")
        click.echo(latency_line("killed until the next receipt", back))
    if not outcome.is_whole:
        raise EnvironmentFault(f"{outcome.lost} receipted events were lost, {outcome.doubled} are kept twice")
