"""A ground station and the tube next to it, joined by hand: states, surveys and depths as a test wants them."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

from groundstation.config import GroundConfig
from groundstation.service.process.ground_process import GroundProcess
from telemetry.application.depth_source import DepthSource
from telemetry.application.endpoint import Endpoint
from telemetry.messages import Command, ImuMean, NodeFlag, NodeMode, NodeState, Reply, Side, SurveyMeasurement
from telemetry.presentation.msgpack_codec import encode_message

VAR = (0.0034**2) / 32
CALIBRATED = {"accelerometer_bias_std_deg": 0.002}
TOLD = {
    "north_std_deg": 1e-12, "north_check_deg": 0.0, "north_check_std_deg": 1e-12, "collar_std_deg": 1e-12,
    "collar_inclination_deg": 0.0, "mount_tilt_std_deg": 0.01,
}  # fmt: skip
# nothing is known of path and sensors that would pull a direction off what its one look says
FOLLOWED = {
    "curvature_std_deg_per_m": 1e4, "accelerometer_bias_std_deg": 1e-6, "mount_tilt_std_deg": 1e-6,
    "play_std_deg": 1e-6,
}  # fmt: skip
COV = ((VAR, 0.0, 0.0), (0.0, VAR, 0.0), (0.0, 0.0, VAR))


class Rig:
    """A ground station and the station of tube 1, joined directly by hand: frames in, frames out."""

    def __init__(self, folder: Path, **settings: Any) -> None:
        self.ground = GroundProcess(GroundConfig(folder=folder, **CALIBRATED | TOLD | settings))
        self.tube = Endpoint(1, frozenset(Side), boot_count=1, is_clock_root=True)
        self.now = 1000.0
        self.source = DepthSource()
        self.hops: dict[int, int] = {}  # as each tube has told them last
        self.untold: dict[int, NodeFlag] = {}  # angles that the node of a tube was not told
        self.yaw, self.systematic_var = 0.0, 1e-8  # of every survey, rad and rad^2
        self.obey: Callable[[Command], Reply] | None = None  # what tube 1 does with an order

    md = 0.0

    def run(self, duration: float) -> None:
        end = self.now + duration
        while self.now < end:
            self.tube.advance(self.now)
            self.ground.on_timer(self.now)
            for _ in range(3):
                for _, frame in self.ground.take_frames(self.now):
                    for received in self.tube.receive(Side.UPPER, frame.payload, self.now):
                        if self.obey is not None and isinstance(received.message, Command):
                            self.tube.mail.reply(self.obey(received.message))
                for side, frame in self.tube.take_frames(self.now):
                    if side is Side.UPPER:
                        self.ground.on_frame(Side.LOWER, frame.payload, self.now)
            self.now += 0.5

    def depth(self, md: float) -> None:
        """The bit is moved to a depth, and stands there from now on."""
        for _ in range(20 if md != self.md else 0):
            self.now += 1.0
            for endpoint in (self.tube, self.ground.endpoint):
                endpoint.advance(self.now)
        for _ in range(3):
            self.now += 0.5
            self.read_depth(md)

    def read_depth(self, md: float) -> None:
        self.md = md
        self.ground.on_depth(encode_message(self.source.measure(self.now, md)), self.now)

    def alarms(self) -> set[str]:
        """Kinds of alarms that an operator sees."""
        return set(self.ground.operator.ask("status")["alarms"])

    def state(self, tube: int, hops: int) -> None:
        self.tell(tube, hops)
        self.run(1.0)

    def tell(self, tube: int, hops: int, scale: float = 0.0) -> None:
        self.hops[tube] = hops
        state = NodeState(
            tube, self.now, hops, NodeMode.TRACKING, 1.0, 1e-6, 1e-6, (0.0, 0.0, 0.0), scale, 0.0, 1e-6, 0.1, 1e-8,
            self.untold.get(tube, NodeFlag.NONE), 5, 0,
        )  # fmt: skip
        self.tube.send_state(state, self.now)

    def drill(self, stop: int, inclination_deg: float, flags: NodeFlag = NodeFlag.NONE) -> None:
        """Add a tube on top, drill it down and survey the hole with the tube at the bit."""
        self.speak(stop)
        self.depth(2.0 * stop)
        self.survey(1, stop, inclination_deg, flags)
        self.speak(stop)

    def speak(self, tubes: int) -> None:
        """Every tube of the string tells its state, the lowest is number 1."""
        for tube in range(tubes, 0, -1):
            self.tell(tube, tubes - tube + 1)
        self.run(1.0)
        self.read_depth(self.md)

    def ask(self, path: str, **parameters: str) -> dict[str, Any]:
        """What an operator sees."""
        return self.ground.operator.ask(path, parameters)

    def survey(self, tube: int, sequence: int, inclination_deg: float = 2.0, flags: NodeFlag = NodeFlag.NONE) -> None:
        lean = math.radians(inclination_deg)
        imus = (ImuMean((9.81 * math.sin(lean), 0.0, -9.81 * math.cos(lean)), COV),)
        hops = self.hops.get(tube, 1)
        flags |= self.untold.get(tube, NodeFlag.NONE)
        yaw = self.yaw, 1e-8, self.systematic_var
        message = SurveyMeasurement(tube, sequence, self.now, hops, imus, *yaw, 32, 20.0, flags)
        self.tube.mail.submit(message, self.now)
        self.run(2.0)
        self.read_depth(self.md)
