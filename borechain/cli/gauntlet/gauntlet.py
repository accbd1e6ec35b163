"""``borechain gauntlet``: seeds of faults against a whole rig in this process."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import EnvironmentFault, InputFault, plain_faults, require_modules
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from collections.abc import Sequence

    from borechain.gauntlet.covered_states import Pair
    from borechain.gauntlet.gauntlet_run import SeedJob, SeedOutcome
    from borechain.gauntlet.soak import SoakSample

COLUMNS = tuple(
    (name, name)
    for name in ("hours", "memory_mib", "disks_mib", "objects", "handles", "database_kib", "surveys", "wrong", "cpu_s")
)


@dataclass(frozen=True, slots=True)
class GauntletRequest:
    """Which seeds run, with which faults, on which plan."""

    seeds: int
    first: int
    seed: int | None
    faults: str | None
    exactly: str | None
    plan: str
    together: int | None
    has_seams: bool
    covers: bool

    @property
    def numbers(self) -> list[int]:
        """Every seed."""
        return [self.seed] if self.seed is not None else list(range(self.first, self.first + self.seeds))

    def to_jobs(self) -> list[SeedJob]:
        """What is run of every seed; InputFault for kinds that are none, or too few to combine."""
        from borechain.gauntlet.gauntlet_run import ALL, SeedJob
        from sim.gauntlet.plan import combined_kinds

        allowed, exactly = _names(self.faults, "--faults", ALL), _names(self.exactly, "--exactly", ()) or None
        if self.together is not None and (exactly is not None or self.together > len(allowed)):
            raise InputFault(f"--together {self.together}: expected as many --faults at least, and no --exactly")
        return [
            SeedJob(
                seed,
                allowed,
                exactly if self.together is None else combined_kinds(seed, allowed, self.together),
                self.plan,
                self.has_seams,
                self.covers,
            )
            for seed in self.numbers
        ]


gauntlet_options = gather_options(
    click.option("--seeds", type=click.IntRange(1), default=20, show_default=True, help="How many seeds to run."),
    click.option("--from", "first", type=click.IntRange(0), default=1, show_default=True, help="The first of them."),
    click.option("--seed", type=click.IntRange(0), help="Repeat this one seed."),
    click.option("--faults", help="Kinds of faults to draw from, as a,b,c  [default: all]."),
    click.option("--exactly", help="Kinds of faults to switch on, whatever the seed says, as a,b,c."),
    click.option("--list", "listed", is_flag=True, help="List the kinds of faults."),
    click.option(
        "--plan",
        type=click.Choice(["minute", "calmed", "drilled-in"]),
        default="minute",
        show_default=True,
        help="A string that drills for a minute; the same and a calm minute, after which all is to be well; "
        "or one that is drilled in tube by tube.",
    ),
    click.option(
        "--together",
        type=click.IntRange(1, 4),
        help="So many kinds in each seed: seeds in a row go through all pairs, threes or fours.",
    ),
    click.option(
        "--seams",
        "has_seams",
        is_flag=True,
        help="Open seams of the product itself too: early timeouts, queues with hardly any room.",
    ),
    click.option(
        "--coverage", "covers", is_flag=True, help="Count pairs of facts about the rig that were true at once."
    ),
    click.option(
        "--soak", "hours", type=click.FloatRange(1.0), help="Instead, hours of rig time of one rig under faults."
    ),
    click.option(
        "--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for soak.csv and soak.svg; with --soak."
    ),
    click.option("--json", "as_json", is_flag=True, help="Print one JSON object a seed, and one of the whole."),
    request=GauntletRequest,
)


@click.command()
@gauntlet_options
@require_modules("scipy", "sqlalchemy")
@plain_faults
def gauntlet(request: GauntletRequest, listed: bool, hours: float | None, out: Path | None, as_json: bool) -> None:
    """Drill with a string of two tubes in this process under faults that each seed draws; judge what the crew sees.

    \b
    Examples:
      borechain gauntlet --seeds 100
      borechain gauntlet --seed 17 --exactly node-cut,loss
      borechain gauntlet --seeds 100 --plan calmed --seams
      borechain gauntlet --seeds 2000 --together 2 --coverage
      borechain gauntlet --soak 24
    """
    if listed:
        list_faults()
    elif hours is not None:
        _soak(hours, request.first, out, as_json=as_json)
    elif out is not None:
        raise InputFault("--out: expected --soak with it")
    else:
        run_seeds(request, as_json=as_json)


def list_faults() -> None:
    """Kinds of faults, one a line."""
    from sim.gauntlet.fault_kinds import KINDS

    for kind in KINDS:
        click.echo(f"{kind.name:20} {kind.meaning}")


def run_seeds(request: GauntletRequest, *, as_json: bool) -> None:
    """Run every seed and show it.

    Raises
    ------
    EnvironmentFault
        When one has failed.
    """
    from borechain.gauntlet.gauntlet_run import judge_seeds

    numbers, failed, cpu_s = request.numbers, 0, 0.0
    pairs: set[Pair] = set()
    for outcome in judge_seeds(request.to_jobs()):
        failed += bool(outcome.violations)
        cpu_s += outcome.cpu_s
        pairs |= outcome.pairs
        _show(outcome, as_json=as_json)
    _show_figures(len(numbers), failed, cpu_s, len(pairs) if request.covers else None, as_json=as_json)
    if failed:
        raise EnvironmentFault(f"{failed} of {len(numbers)} seeds failed; each is named above with what repeats it")


def _names(text: str | None, option: str, default: tuple[str, ...]) -> tuple[str, ...]:
    from borechain.gauntlet.gauntlet_run import ALL

    if text is None:
        return default
    names = tuple(name.strip() for name in text.split(","))
    for name in names:
        if name not in ALL:
            raise InputFault(f"{option}: expected some of {', '.join(ALL)}, got {name!r}")
    return names


def _show(outcome: SeedOutcome, *, as_json: bool) -> None:
    from borechain.gauntlet.gauntlet_run import USUAL

    row: dict[str, Any] = {
        "seed": outcome.seed,
        "faults": list(outcome.kinds),
        "seams": outcome.seams,
        "violations": outcome.violations,
        "alarms": outcome.alarms,
        "cleared": outcome.cleared,
        "measurements": outcome.measurements,
        "schedule": outcome.schedule,
        "digest": outcome.digest,
    }
    if as_json:
        click.echo(json.dumps(row))
    elif outcome.violations:
        click.echo(f"seed {outcome.seed} failed: {'; '.join(outcome.violations)}")
        for line in outcome.schedule:
            click.echo(f"  {line}")
        plan = f" --plan {outcome.plan}" if outcome.plan != USUAL else ""
        seams = " --seams" if outcome.seams else ""
        click.echo(f"  borechain gauntlet --seed {outcome.seed} --exactly {','.join(outcome.kinds)}{plan}{seams}")


def _soak(hours: float, seed: int, out: Path | None, *, as_json: bool) -> None:
    """Show what a long run needs, a line now and then, and keep it."""
    from borechain.gauntlet.soak import run_soak

    found: tuple[str, ...] = ()
    samples = []
    for sample in run_soak(hours, seed):
        found = sample.violations
        samples.append(sample)
        if as_json:
            click.echo(json.dumps(asdict(sample)))
        else:
            click.echo(
                f"{sample.hours:7.1f} h {sample.memory_mib:7.1f} MiB, {sample.disks_mib:5.1f} of it disks "
                f"{sample.objects:7d} objects {sample.handles:4d} handles "
                f"{sample.database_kib:8.1f} KiB {sample.surveys:5d} surveys {len(found):3d} wrong"
            )
    if out is not None:
        _keep(samples, out)
    if found:
        raise EnvironmentFault(f"after {hours:g} h: {'; '.join(found)}")


def _keep(samples: Sequence[SoakSample], out: Path) -> None:
    """Table and picture of a soak."""
    from borechain.cli.console_tables import write_table
    from borechain.gauntlet.soak_figure import soak_figure
    from groundstation.report.style import save_figure

    out.mkdir(parents=True, exist_ok=True)
    write_table(out / "soak.csv", [asdict(sample) | {"wrong": len(sample.violations)} for sample in samples], COLUMNS)
    save_figure(soak_figure(samples), out / "soak.svg")


def _show_figures(seeds: int, failed: int, cpu_s: float, pairs: int | None, *, as_json: bool) -> None:
    """How many seeds ran and failed, how many a minute of one core, and how many pairs of facts they covered."""
    a_minute = 60.0 * seeds / cpu_s
    if as_json:
        figures = {
            "seeds": seeds,
            "failed": failed,
            "cpu_s": round(cpu_s, 2),
            "runs_per_cpu_minute": round(a_minute, 1),
        } | ({} if pairs is None else {"pairs": pairs})
        click.echo(json.dumps(figures))
    else:
        covered = "" if pairs is None else f", {pairs} pairs of facts"
        click.echo(f"{seeds} seeds, {failed} failed, {a_minute:.0f} a minute of one core{covered}")
