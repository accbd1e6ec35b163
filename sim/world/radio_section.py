"""The table ``[radio]`` of a scenario: what the tubes speak with, and what lies between their ends."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from node.firmware.tube_settings import MAX_REACH
from sim.world.section import NotNegative, Positive, ScenarioSection
from telemetry.radio.path_loss import THRESHOLD, TRANSMITTED, WIDTH

Decibels = Annotated[float, Field(ge=-200.0, le=200.0)]


class LayerSection(ScenarioSection):
    """One layer of the ground, from the top down."""

    to_m: Positive | None = Field(None, description="true vertical depth of its lower bound; of the last none")
    sand: float = Field(description="mass fraction of the solids")
    clay: float = Field(description="mass fraction of the solids")
    bulk_density_g_cm3: float = Field(1.5, description="of the dry soil")
    water: float = Field(description="volume of water over volume of soil, 0..1")
    temperature_c: float = 10.0


class PipeSection(ScenarioSection):
    """The bore of the string as a waveguide."""

    radius_cm: Positive = Field(3.0, description="of the bore")
    carbon_percent: float = Field(0.26, description="of the steel, by weight")
    temperature_c: float = Field(20.0, description="of the wall")
    joint_db: NotNegative = Field(3.0, description="lost at every joint, beside the wall's loss")
    reach: int = Field(2, ge=1, le=MAX_REACH, description="tubes away that a node hears")


class RadioSection(ScenarioSection):
    """A radio at both ends of every tube, and in the drive head."""

    mode: Literal["soil", "pipe"] = Field("soil", description="from tube end to tube end, or inside the bore")
    frequency_mhz: Positive = 868.0
    transmit_dbm: Decibels = TRANSMITTED
    gain_dbi: Decibels = Field(0.0, description="of each antenna; a small one against steel has far less than 0")
    threshold_dbm: Decibels = Field(THRESHOLD, description="received power at which every second packet is lost")
    width_db: Positive = Field(WIDTH, description="of the logistic packet error rate around the threshold")
    gap_m: Positive = Field(0.2, le=10.0, description="between tube ends, through soil")
    attempts: int = Field(3, ge=1, le=20, description="of the radio at a packet, before the frame is lost")
    attempt_ms: NotNegative = Field(4.0, le=100.0, description="each of them after the first delays the frame by")
    fade_std_db: NotNegative = Field(0.0, le=20.0, description="of each joint's loss, constant, 1 sigma")
    burst_every_s: Positive | None = Field(
        None, description="mean time from the end of one burst of a joint to the next"
    )
    burst_s: Positive = Field(1.0, description="mean length of a burst")
    burst_db: NotNegative = Field(10.0, le=100.0, description="lost at a joint during a burst")
    soil: tuple[LayerSection, ...] = Field((), description="from the top down; air above")
    pipe: PipeSection | None = Field(None, description="of the mode pipe")
