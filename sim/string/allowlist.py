"""What a campaign can express: keys of a scenario, each by a row of the table of disturbances or a part of the string.

A key that is away from its default and that none of them has is refused by its name, so that no campaign is silently
of another scenario than the one it was asked for. ``borechain rig`` runs all of them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from pydantic import BaseModel

from sim.errors import ScenarioError
from sim.world.disturbance.disturbance_table import TABLE
from sim.world.scenario import Scenario

EXPRESSED: Final[dict[str, tuple[str, ...]]] = {  # by the part of a string that does
    "hole": (
        "path.displacements",
        "path.stations",
        "path.straight",
        "path.straight.inclination_deg",
        "path.straight.azimuth_deg",
        "path.spiral",
        "path.spiral.inclination_deg",
        "path.spiral.azimuth_deg",
        "path.spiral.turn_deg",
        "path.spiral.build_deg",
        "path.drawn",
        "path.drawn.kind",
        "path.drawn.seed",
        "path.drawn.inclination_deg",
        "path.drawn.azimuth_deg",
        "path.drawn.collar_std_deg",
        "path.drawn.bending",
    ),
    "schedule": (
        "rig.tubes",
        "rig.tube_length_m",
        "rig.tubes_at_start",
        "rig.depth_at_start_m",
        "schedule.begin_s",
        "schedule.add_s",
        "schedule.joint_s",
        "schedule.stop_s",
        "schedule.finish_s",
        "schedule.blocks",
        "rotation.rate_dps",
        "rotation.acceleration_dps2",
        "rotation.turns",
        "rotation.advance_m",
    ),
    "truth": ("accelerometer.radius_m", "accelerometer.gravity_mps2"),
    "joints": (
        "joints.reading_std_deg",
        "joints.mount_std_deg",
        "rough.string.wrong_mark_deg",
        "setup.untold",
        "told.joint_tube",
        "told.joint_deg",
        "told.drive_deg",
    ),
    "string": ("told.lengths_off_m",),
    "encoder": (
        "encoder.counts_per_turn",
        "encoder.edge_std_deg",
        "encoder.phase",
        "told.north_deg",
        "rough.encoder.eccentricity_deg",
        "rough.encoder.belt_slip",
        "rough.encoder.index",
        "rough.encoder.reversed",
        "rough.encoder.outliers",
        "rough.encoder.outlier_deg",
    ),
    "hops": (
        "clocks.joint_std_ms",
        "clocks.wander_std_ms",
        "clocks.wander_tau_s",
        "clocks.stated_std_ms",
        "medium.delay_ms",
        "medium.dated_by",
        "medium.latency_ms",
        "medium.loss",
        "aiding.on_s",
        "aiding.off_s",
        "aiding.every_s",
        "aiding.renumbered",
    ),
    "nodes": ("node.tuning",),
    "rough motion": (
        "rough",
        "rough.samples_hz",
        "rough.drive.ripple",
        "rough.drive.ripple_s",
        "rough.drive.stick_slip",
        "rough.drive.stick_slip_s",
        "rough.drive.dead_stop_dps",
        "rough.drive.turns_back_deg",
        "rough.string.backlash_deg",
        "rough.string.twist_deg",
        "rough.string.hold_s",
        "rough.string.unwind_s",
    ),
}
FRAMES: Final = "of the frames of a link; a campaign hands aiding on without them"
GROUND: Final = "of what a ground station judges"
UNUSED: Final[dict[str, str]] = {  # keys without effect on a campaign, and why
    "version": "of the format of the file",
    "medium.link": "a campaign has no link, on or off",
    "medium.jitter_ms": FRAMES,
    "medium.duplicate": FRAMES,
    "medium.corrupt": FRAMES,
    "medium.transports": FRAMES,
    "clocks.offset_std_s": "of clocks that a link synchronises; a campaign states what is left of that",
    "clocks.drift_std_ppm": "of clocks that a link synchronises; a campaign states what is left of that",
    "node.torsion": "of a string that torque twists, which is refused",
    "rough.encoder.jump_s": "of a jump, which is refused",
    "design.inclination_deg": GROUND,
    "design.azimuth_deg": GROUND,
    "design.length_m": GROUND,
    "design.radius_m": GROUND,
    "design.tolerance": GROUND,
    "setup.north_std_deg": GROUND,
    "setup.stick_up_std_m": GROUND,
    "setup.collar_std_deg": GROUND,
    "setup.unchecked": GROUND,
    "told.north_check_deg": GROUND,
    "told.stick_up_check_m": GROUND,
    "told.collar_north_deg": GROUND,
    "told.collar_east_deg": GROUND,
    "told.depth_offset_m": GROUND,
    "told.depth_scale": GROUND,
    "told.depth_std_m": GROUND,
    "told.depth_stuck_after_s": GROUND,
    "told.depth_stuck_s": GROUND,
    "design.leg": GROUND,
    "site": "its hole is chosen before",
    "site.name": "its hole is chosen before",
    "site.radius_m": GROUND,
    "site.thickness_m": GROUND,
    "site.holes": "its hole is chosen before",
}
KNOWN: Final = frozenset(UNUSED) | {key for keys in EXPRESSED.values() for key in keys}


def refuse_others(scenario: Scenario) -> None:
    """Refuse what a campaign cannot express.

    Raises
    ------
    ScenarioError
        Names the key and the command that can.
    """
    for key in refused_keys(scenario):
        raise ScenarioError(f"{key}: a campaign cannot express it; borechain rig runs such a scenario, seed by seed")


def refused_keys(scenario: Scenario) -> Iterator[str]:
    """Keys of a scenario that a campaign cannot express."""
    file = scenario.file
    for key, value, usual in keys_of(file):
        if value != usual and not is_expressed(key):
            yield key
    for row in TABLE:
        if row.beyond is not None:
            yield from (key for key, is_beyond in row.beyond(file).items() if is_beyond)
    if file.rough is None and file.encoder.phase != "locked":
        # the means of a plain world's cycles are worked out once, at the ends of the encoder's
        yield 'encoder.phase = "random" without the table rough'
    if scenario.faults:
        yield "faults"


def is_expressed(key: str) -> bool:
    """Whether the rows that own a key of a scenario have a compiled form, or a part of the string has it."""
    owners = [row for row in TABLE if row.owns(key)]
    return all(row.compiled is not None for row in owners) if owners else key in KNOWN


def keys_of(section: BaseModel, within: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Keys of a scenario with their values and defaults; of a table that may be absent its own name too."""
    for name, field in type(section).model_fields.items():
        key, value = within + name, getattr(section, name)
        usual = field.get_default(call_default_factory=True)
        if key == "disturbance":
            yield from own_tables(value)
        elif isinstance(value, BaseModel):
            if usual is None:
                yield key, value, usual
            yield from keys_of(value, f"{key}.")
        else:
            yield key, value, usual


def own_tables(tables: dict[str, dict[str, Any]]) -> Iterator[tuple[str, Any, Any]]:
    """Tables of disturbances with one of their own, against their defaults."""
    for row in TABLE:
        if row.section is not None and row.name in tables:
            yield f"disturbance.{row.name}", row.section.model_validate(tables[row.name]), row.section()
