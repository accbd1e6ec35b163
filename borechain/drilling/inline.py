"""A whole rig inside this process: firmware, links and ground station as objects, stepped by the scheduler.

Everything that a rig of processes runs is here but the bus and the operating system's processes. The digest is the
same, bit for bit, at a fraction of the CPU time; no query is answered while it runs.
"""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from borechain.drilling.rare_collection import rare_collection
from borechain.drilling.rig_host import depth_sealer
from groundstation.config import GroundConfig
from groundstation.service.process.ground_process import GroundProcess
from node.process.encoder_process import EncoderProcess
from node.process.node_host import seals_at
from node.process.tube_process import TubeProcess
from sim.errors import RigError
from sim.rig.in_process import Build, InProcessStepper, carry_unwritten
from sim.rig.launcher import private_folder
from sim.rig.rack_operator import RackOperator
from sim.rig.rig_progress import RigProgress
from sim.rig.scheduler import Scheduler
from sim.rig.stepper import Acted
from sim.world.world import World
from telemetry.errors import BorechainError
from telemetry.messages import BASE, ENCODER
from telemetry.presentation.can_native import rounded_frame
from telemetry.runtime.disk import MACHINE, Disk
from telemetry.transport.authentication import new_key, read_key


class InlineRig:
    """Builds every process of a rig and drills with them.

    Parameters
    ----------
    world : truth, sensors and schedule
    settings : of ``GroundConfig``, what the operator enters at the ground station
    rig : its name
    folder : new, of the whole run
    lot : of the starts of the ground station; a rig that is to repeat itself draws them from its seed
    native : the joints are on CAN's native profile, which rounds cyclic messages to the steps of their signals
    disk_of : disk of the process of an address
    keys : folder of the rig's keys; without it everybody is believed

    Attributes
    ----------
    seal_depth : what the source of the depth makes of its readings
    """

    def __init__(
        self,
        world: World,
        settings: dict[str, Any],
        rig: str,
        folder: Path,
        lot: Callable[[int], int] = secrets.randbelow,
        *,
        native: bool = False,
        disk_of: Callable[[int], Disk] = lambda _address: MACHINE,
        keys: Path | None = None,
    ) -> None:
        self.world = world
        self._has_encoder_run = False
        key_file = new_key(folder / "rig.key") if keys is None else None
        config = GroundConfig(
            rig=rig, folder=private_folder(folder, "ground"), key_file=key_file, keys=keys, **settings
        )
        builders: dict[int, Build] = {
            BASE: partial(GroundProcess, config, lot, disk_of(BASE)),
            ENCODER: lambda: self._build_encoder(private_folder(folder, "encoder"), keys, disk_of(ENCODER), lot),
        }
        self.seal_depth = depth_sealer(keys)
        block_key = None if key_file is None else read_key(key_file)
        for tube in range(1, world.scenario.tubes + 1):
            place = private_folder(folder, f"tube-{tube}")
            builders[tube] = partial(self._build_tube, tube, place, block_key, keys, disk_of(tube))
        self.stepper = InProcessStepper(builders, self._act_on_cue, rounded_frame if native else carry_unwritten)

    def _build_encoder(self, folder: Path, keys: Path | None, disk: Disk, lot: Callable[[int], int]) -> EncoderProcess:
        is_new, self._has_encoder_run = not self._has_encoder_run, True
        return EncoderProcess(
            folder,
            torque=self.world.torque_settings(),
            reach=self.world.reach,
            seals=seals_at(keys, ENCODER, self.world.reach),
            disk=disk,
            is_new=is_new,
            lot=lot,
        )

    @property
    def ground(self) -> GroundProcess:
        """The ground station, once the schedule has begun."""
        process = self.stepper.processes[BASE]
        if not isinstance(process, GroundProcess):
            raise TypeError(f"expected the ground station at the base, got {type(process).__name__}")
        return process

    def run(self, show: Callable[[RigProgress], None] = lambda _progress: None, speed: float = math.inf) -> None:
        """Drill to the end of the schedule.

        Raises
        ------
        RigError
            When the schedule asks for what the rig has not, or the ground station refuses the operator.
        """

        def follow(progress: RigProgress) -> None:
            self.stepper.follow(progress)
            show(progress)

        with rare_collection():
            Scheduler(self.world, self.stepper, follow, speed, cued=True, seal_depth=self.seal_depth).run()

    @property
    def is_begun(self) -> bool:
        """Whether the ground station runs and can be asked."""
        return BASE in self.stepper.processes

    def ask(self, path: str, parameters: Mapping[str, str] | None = None) -> dict[str, Any]:
        """What the ground station shows on ``path``, see docs/keys.md."""
        return self.ground.operator.ask(path, parameters)

    def command(self, name: str, parameters: dict[str, str]) -> dict[str, Any]:
        """Have the ground station obey an operator's command."""
        operator = self.ground.operator
        try:
            return operator.reply_of(operator.order(name, parameters))
        except BorechainError as error:
            raise RigError(f"{name}: {error}") from error

    def close(self) -> None:
        """Close the ground station's database."""
        self.ground.store.close()

    def _build_tube(self, tube: int, folder: Path, key: bytes | None, keys: Path | None, disk: Disk) -> TubeProcess:
        seals = seals_at(keys, tube, self.world.reach)
        return TubeProcess(self.world.tube_settings(tube), folder, key=key, disk=disk, seals=seals)

    def _act_on_cue(self, cue: str) -> Acted:
        rack = self.world.rack
        return Acted.DONE if rack is None else RackOperator(rack, self.world.scenario.tubes).act_on_cue(self, cue)
