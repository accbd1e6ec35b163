"""A rig: the router that its processes meet at, then its scenario."""

from __future__ import annotations

import contextlib

from borechain.drilling.rig_host import opened_router
from borechain.drilling.rig_job import DrilledRig, RigJob, RigWatcher


def drill_rig(job: RigJob, watcher: RigWatcher) -> DrilledRig:
    """Drill a scenario: its hole, or every hole of its site.

    Raises
    ------
    ScenarioError
        When the scenario cannot be drilled; nothing was written.
    RigError
        When the folder cannot be used, a process fails, or on Ctrl-C.
    MediumError
        When the endpoint cannot be listened on.
    """
    with contextlib.nullcontext() if job.inline else opened_router(job.endpoint, job.keys_place) as bus:
        # others can join while what drills is imported, the scenario is read and the kernels are loaded
        from borechain.drilling.drill_site import drill_scenario

        return drill_scenario(job, bus, watcher)
