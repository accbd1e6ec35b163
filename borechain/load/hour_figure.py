"""What the processes of a rig hold over time, as a figure."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.figure import Figure

from borechain.load.hour import GROUND, Weight
from groundstation.report.style import SERIES, new_figure, styled, tidy_ticks


@styled
def hour_figure(weights: Sequence[Weight]) -> Figure:
    """Private memory and open files of every process over hours, and the database over surveys."""
    end = weights[-1]
    figure = new_figure(2.8, f"A rig of {len({one.process for one in weights})} real processes for {end.hours:.1f} h")
    memory, handles, database = figure.subplots(1, 3)
    for name in sorted({one.process for one in weights}):
        own = [one for one in weights if one.process == name]
        hours, is_ground = [one.hours for one in own], name == GROUND
        style = {"color": SERIES[0] if is_ground else SERIES[1], "label": "ground station" if is_ground else None}
        memory.plot(hours, [one.private_mb for one in own], **style)
        handles.plot(hours, [one.handles for one in own], **style)
        if is_ground:
            database.plot([one.surveys for one in own], [one.database_kb for one in own], color=SERIES[0])
    memory.set(ylabel="private memory, MB", xlabel="h", ylim=(0.0, None))
    memory.legend()
    handles.set(ylabel="open files", xlabel="h", ylim=(0.0, None))
    database.set(ylabel="database, kB", xlabel="surveys", ylim=(0.0, None))
    return tidy_ticks(figure)
