"""What the fork server imports and compiles before the first process is forked."""

from __future__ import annotations

import gc

import borechain.drilling.rig_host
import groundstation.ground_host
import node.process.node_host
import sim.rig.bus_stepper
import sim.rig.scheduler
import sim.world.world
from groundstation.survey.adjustment.warm_adjustment import warm_adjustment
from groundstation.survey.well.kernels import position_errors
from node.kernels.arithmetic.compiler import leave_blas_out
from node.kernels.step.precompile import warm_encoder, warm_up

leave_blas_out()
warm_up()
warm_encoder()
position_errors.warm_up()
warm_adjustment()
# a collection in a child writes into every object that it looks at: 45 MB of shared pages would become its own
gc.collect()
gc.freeze()

__all__ = ["borechain", "groundstation", "node", "sim"]
