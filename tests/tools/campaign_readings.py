"""What a campaign reads, cycle by cycle, and every key of a scenario's file."""

from collections.abc import Iterator
from typing import Any, get_args, get_origin

import numpy as np
from pydantic import BaseModel

from node.kernels.record.node_record import READING
from sim.string.drawn_string import DrawnString
from sim.world.disturbance.lanes import draw_further, draw_numbers
from sim.world.disturbance.sensor_reading import read_frames, read_sensors
from sim.world.world import World


def read_campaign(string: DrawnString, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """What the encoder of a campaign measures, and what its tubes read, (tubes, cycles, READING).

    The tubes read as if they were in the string from the first cycle on.
    """
    world = World(string.scenario, seed)
    (schedule, run), drawn, reading = string.redraw(world), string.new_readings(world), np.zeros((1, READING))
    draws, numbers, shared = (drawn.counter, drawn.key, drawn.words), drawn.numbers, drawn.shared[0]
    rows = np.zeros((len(drawn.tubes), world.cycles, READING))
    for (tube, cycle), end in np.ndenumerate(schedule.ends + schedule.later[:, None]):
        place, own, is_first = (cycle, tube), drawn.tubes[tube], cycle == 0
        draw_numbers(*draws, numbers, *place)
        if run is None:
            read_sensors(shared, own, is_first, *drawn.felt, numbers, reading, end, *place)
        else:
            draw_further(*draws, run.field.desk.drawn, *place)
            read_frames(shared, own, is_first, run.field, numbers, reading, end, *place)
        rows[tube, cycle] = reading[0]
    return schedule.measured, rows


def section_in(annotation: Any) -> type[BaseModel] | None:
    """The table that a field of a scenario is, or may be; of a list of tables none."""
    if isinstance(annotation, type):
        kinds: tuple[Any, ...] = (annotation,)
    else:
        kinds = () if get_origin(annotation) is tuple else get_args(annotation)
    found = [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)]
    return found[0] if found else None


def keys_of_file(model: type[BaseModel], within: str = "") -> Iterator[tuple[str, Any]]:
    """Keys of a scenario and their defaults, and the names of tables that may be absent."""
    for name, field in model.model_fields.items():
        key, usual = within + name, field.get_default(call_default_factory=True)
        section = section_in(field.annotation)
        if section is None:
            yield key, (usual, field)
            continue
        if usual is None:
            yield key, (None, field)
        yield from keys_of_file(section, f"{key}.")
