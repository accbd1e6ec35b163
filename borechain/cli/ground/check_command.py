"""``borechain check``: whether a rig is ready to drill, and what is missing."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from borechain.cli.faults import plain_faults, require_modules
from borechain.cli.ground.query import rig_option, role_option
from borechain.cli.shared_options import ScenarioPath
from telemetry import keys
from telemetry.runtime.process_options import insecure_option, keys_option
from telemetry.runtime.typed_options import gather_options

if TYPE_CHECKING:
    from borechain.setup_check import SetupCheck

NOT_READY = 1  # exit status
LEAST_CM = 0.05  # at the toe, from which an item is listed


@dataclass(frozen=True, slots=True)
class CheckRequest:
    """Which rig to check: one that runs, a scenario, or the options of a ground station."""

    scenario: Path | None
    ground_config: Path | None
    seed: int
    rig_name: str
    endpoint: str
    keys_place: Path | None
    role: str

    def answer(self) -> SetupCheck:
        """Check it; errors of the client, of scenarios and of settings."""
        from borechain import setup_check
        from borechain.client import connect_to_ground

        if self.scenario is not None:
            return setup_check.check_scenario(self.scenario, self.seed)
        if self.ground_config is not None:
            return setup_check.check_settings(settings_of_file(self.ground_config))
        with connect_to_ground(self.endpoint, self.rig_name, keys_place=self.keys_place, role=self.role) as ground:
            return setup_check.check_live_rig(ground)


@click.command()
@gather_options(
    click.argument("scenario", type=ScenarioPath(), required=False),
    click.option(
        "--ground-config",
        type=click.Path(path_type=Path, exists=True, dir_okay=False),
        help="Options of a ground station that is to be started, as its --config takes them.",
    ),
    click.option("--seed", type=int, default=0, show_default=True, help="Of the scenario."),
    click.option("--rig", "rig_name", default=keys.DEFAULT_RIG, show_default=True, help="Name of the rig."),
    insecure_option,
    rig_option,
    keys_option,
    role_option,
    request=CheckRequest,
)
@click.option("--json", "as_json", is_flag=True, help="One JSON object on one line.")
@require_modules("orjson", "scipy", "sqlalchemy")
@plain_faults
def check(request: CheckRequest, as_json: bool) -> None:
    """Say whether a rig is ready to drill, and name what is missing: of a rig that runs, or before, of SCENARIO.

    The exit status is 0 where it is ready, and 1 where it is not.

    \b
    Examples:
      borechain check --rig rig-1
      borechain check --endpoint tls/10.0.0.7:7447 --keys stick
      borechain check wellbore-1
      borechain check --ground-config /etc/borechain/ground.toml
    """
    found = request.answer()
    click.echo(json.dumps(found.as_object()) if as_json else check_text(found))
    sys.exit(0 if found.ready else NOT_READY)


def check_text(found: SetupCheck) -> str:
    """The answer for people: the word, what is missing, unchecked, wrong, or costs most, and what to do next."""
    lines = ["READY TO DRILL" if found.ready else "NOT READY TO DRILL"]
    lines += [f"missing  {name}" for name in found.missing]
    lines += [f"check    {row['item']}, {row['check']}" for row in found.items if row["item"] in found.unchecked]
    lines += [f"wrong    {why}" for why in found.wrong]
    assumed: dict[str, list[dict[str, Any]]] = {}
    for row in found.items:
        if not row["told"] and not row["missing"] and row["toe_cm"] >= LEAST_CM:
            assumed.setdefault(row["kind"], []).append(row)
    lines += [f"assumed  {assumed_text(rows)}" for rows in assumed.values()]
    return "\n".join([*lines, f"next     {found.todo}", f"no sigma {found.left_out}"])


def assumed_text(rows: list[dict[str, Any]]) -> str:
    """What stands by design or by default, of one kind: of several tubes together."""
    row, cm = rows[0], math.sqrt(math.fsum(row["toe_cm"] ** 2 for row in rows))
    name = row["item"] if len(rows) == 1 else f"{row['kind']} of {len(rows)} tubes"
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    way = " along the hole" if row["way"] == "along" else ""
    return f"{name} ± {row['sigma']:g}{unit}, {row['detail']}: {cm:.1f} cm at the toe{way}"


def settings_of_file(file: Path) -> dict[str, Any]:
    """Settings of a ground station by a file of its options; errors as those of its command."""
    from groundstation.command import ground
    from groundstation.ground_options import GroundRequest

    values = ground.make_context("ground", ["--config", str(file)]).params
    return GroundRequest(**{name: values[name] for name in GroundRequest.__dataclass_fields__}).to_settings()
