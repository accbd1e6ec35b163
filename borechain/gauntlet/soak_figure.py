"""What a soak needs over its hours, as a figure."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from borechain.gauntlet.soak import SoakSample
from groundstation.report.style import SERIES, new_figure, styled, tidy_ticks


@styled
def soak_figure(samples: Sequence[SoakSample]) -> Figure:
    """Memory, objects and open files of the process, and the database, over hours of rig time and over surveys."""
    figure = new_figure(4.2, f"One rig under faults for {samples[-1].hours:.0f} h")
    (memory, objects), (handles, database) = figure.subplots(2, 2)
    hours = [sample.hours for sample in samples]
    memory.plot(hours, [sample.memory_mib for sample in samples], color=SERIES[0], label="process")
    memory.plot(hours, [sample.disks_mib for sample in samples], color=SERIES[1], label="of it disks in memory")
    memory.set(ylabel="MiB", ylim=(0.0, None))
    memory.legend()
    objects.plot(hours, [1e-3 * sample.objects for sample in samples], color=SERIES[0])
    objects.set(ylabel="thousands of objects", ylim=(0.0, None))
    handles.plot(hours, [sample.handles for sample in samples], color=SERIES[0])
    handles.set(ylabel="open files", ylim=(0.0, None))
    # a database is deleted now and then, and begins anew
    database.plot([sample.surveys for sample in samples], [s.database_kib for s in samples], "o", color=SERIES[0])
    database.set(ylabel="database, KiB", xlabel="surveys in it", ylim=(0.0, None))
    for axes in (memory, objects, handles):
        axes.set_xlabel("h")
    return tidy_ticks(figure)
