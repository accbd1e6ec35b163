"""What the fork server imports and compiles before the first process is forked."""

from __future__ import annotations

import borechain.processes
import groundstation.process
import sim.bench
import sim.medium
import sim.world
from node.kernels.warm import warm_up

warm_up()

__all__ = ["borechain", "groundstation", "sim"]
