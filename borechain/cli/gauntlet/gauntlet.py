"""``borechain gauntlet``: seeds of faults against a whole rig in this process."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import EnvironmentFault, InputFault, needs, plain_faults

if TYPE_CHECKING:
    from borechain.gauntlet.run import Outcome


@click.command()
@click.option("--seeds", type=click.IntRange(1), default=20, show_default=True, help="How many seeds to run.")
@click.option("--from", "first", type=click.IntRange(0), default=1, show_default=True, help="The first of them.")
@click.option("--seed", type=click.IntRange(0), help="Repeat this one seed.")
@click.option("--faults", help="Kinds of faults to draw from, as a,b,c  [default: all].")
@click.option("--exactly", help="Kinds of faults to switch on, whatever the seed says, as a,b,c.")
@click.option("--list", "listed", is_flag=True, help="List the kinds of faults.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object a seed.")
@needs("scipy", "sqlalchemy")
@plain_faults
def gauntlet(
    seeds: int, first: int, seed: int | None, faults: str | None, exactly: str | None, listed: bool, as_json: bool
) -> None:
    """Drill a rig of two tubes in this process under faults that each seed draws, and judge what the crew sees.

    \b
    Examples:
      borechain gauntlet --seeds 100
      borechain gauntlet --seed 17 --exactly node-cut,loss
    """
    from borechain.gauntlet.run import ALL, run_seed, shrink
    from sim.gauntlet.kinds import KINDS

    if listed:
        for kind in KINDS:
            click.echo(f"{kind.name:20} {kind.meaning}")
        return
    allowed, kinds = _names(faults, "--faults", ALL), _names(exactly, "--exactly", ()) or None
    began, failed = time.monotonic(), 0
    numbers = [seed] if seed is not None else range(first, first + seeds)
    for number in numbers:
        outcome = run_seed(number, allowed, kinds)
        if outcome.violations:
            failed += 1
            outcome = shrink(number, outcome.kinds)
        _show(outcome, as_json=as_json)
    if not as_json:
        click.echo(f"{len(numbers)} seeds, {failed} failed, {time.monotonic() - began:.1f} s")
    if failed:
        raise EnvironmentFault(f"{failed} of {len(numbers)} seeds failed; each is named above with what repeats it")


def _names(text: str | None, option: str, default: tuple[str, ...]) -> tuple[str, ...]:
    from borechain.gauntlet.run import ALL

    if text is None:
        return default
    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in ALL:
            raise InputFault(f"{option}: expected some of {', '.join(ALL)}, got {name!r}")
    return names


def _show(outcome: Outcome, *, as_json: bool) -> None:
    row: dict[str, Any] = {
        "seed": outcome.seed,
        "faults": list(outcome.kinds),
        "violations": outcome.violations,
        "alarms": outcome.alarms,
        "measurements": outcome.measurements,
        "digest": outcome.digest,
    }
    if as_json:
        click.echo(json.dumps(row))
    elif outcome.violations:
        click.echo(f"seed {outcome.seed} failed: {'; '.join(outcome.violations)}")
        click.echo(f"  borechain gauntlet --seed {outcome.seed} --exactly {','.join(outcome.kinds)}")
