"""Table of instruments: ``experiment records`` knows an instrument from its line here alone.

An instrument more is a module with ``records`` (see `sim.instruments.instrument`) and a line here.
"""

from __future__ import annotations

from sim.instruments.instrument import MODULES, Instrument
from sim.named import by_name

INSTRUMENTS = by_name(
    "instruments",
    [
        Instrument("mwd", "an MWD tool in its jig, oven and control", f"{MODULES}.mwd_jig"),
        Instrument("static", "a gyroscope at rest", f"{MODULES}.static_records"),
        Instrument("turntable", "a gyroscope on a turn table", f"{MODULES}.turn_table"),
        Instrument("attitudes", "an accelerometer on a robot arm", f"{MODULES}.robot_arm"),
    ],
)
