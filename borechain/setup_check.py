"""Whether a rig is ready to drill: asked of its ground station, or found in what it is to be started with."""

from __future__ import annotations

import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from groundstation.config import GroundConfig, checked_config
from groundstation.service.alarms.verdict_words import VerdictDoubt

if TYPE_CHECKING:
    from borechain.client import Ground

# surveys mend them, or they are named
LATER = (VerdictDoubt.NO_SURVEY, VerdictDoubt.UNCERTAIN, VerdictDoubt.SETUP, VerdictDoubt.UNCHECKED)


@dataclass(frozen=True, slots=True)
class SetupCheck:
    """The answer: what is missing and what nothing checks by name, what else is wrong, what to do next, all items."""

    ready: bool
    missing: list[str]
    unchecked: list[str]
    wrong: list[str]
    todo: str
    left_out: str
    items: list[dict[str, Any]]

    def as_object(self) -> dict[str, Any]:
        """The answer as plain objects."""
        return asdict(self)


def check_live_rig(ground: Ground) -> SetupCheck:
    """Ask a ground station; errors as those of the client."""
    setup, verdict = ground.ask("setup"), ground.ask("verdict")
    reasons = zip(verdict["doubts"], verdict["why"], strict=False)
    return check_of(setup, [why for doubt, why in reasons if doubt not in LATER])


def check_scenario(file: Path, seed: int) -> SetupCheck:
    """What the crew of a scenario tells before its rig starts.

    Raises
    ------
    ScenarioError
        When it is no scenario.
    """
    from sim.rig.ground_settings import ground_settings
    from sim.world.scenario import load_scenario
    from sim.world.world import World

    world = World(load_scenario(file), seed)
    tubes = [world.tube_settings(tube) for tube in range(world.scenario.tubes, 0, -1)]
    joints = {one.tube: (one.drive_joint.is_told, one.lower_joint.is_told or one.tube == 1) for one in tubes}
    return check_settings(ground_settings(world), joints)


def check_settings(settings: dict[str, Any], joints: dict[int, tuple[bool, bool]] | None = None) -> SetupCheck:
    """What the settings of a ground station tell.

    Parameters
    ----------
    settings : of ``GroundConfig``
    joints : by tube, from the top down, whether its node is told the angles to the drive head and to the tube below

    Raises
    ------
    ConfigurationError
        When a setting is outside its range.
    """
    from groundstation.service.answers.model import RigModel
    from groundstation.service.answers.paths import find_path
    from telemetry.messages import NodeFlag

    with tempfile.TemporaryDirectory() as folder:
        config: GroundConfig = checked_config(**settings | {"folder": Path(folder)})
        model = RigModel.begin(config)
    model.string.restore_tubes(list(joints or {}))
    for tube, (drive, lower) in (joints or {}).items():
        untold = NodeFlag(0) if drive else NodeFlag.DRIVE_UNTOLD
        model.setup.on_flags(tube, 1, untold if lower else untold | NodeFlag.LOWER_UNTOLD)  # each hangs from it once
    setup = find_path(model, "setup").show(model, {})
    return check_of(setup, setup["contradicted"])


def check_of(setup: dict[str, Any], wrong: list[str]) -> SetupCheck:
    """The check by the answer of a ground station, and by what else is wrong."""
    return SetupCheck(
        setup["ready"] and not wrong, setup["missing"], setup["unchecked"], wrong, setup["todo"], setup["left_out"],
        setup["items"],
    )  # fmt: skip
