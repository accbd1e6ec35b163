"""A site of a scenario: the holes of a wall, drilled one after the other by the same rig."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from sim.world.section import Angle, Positive, ScenarioSection


class HoleSection(ScenarioSection):
    """A straight hole of the site: where its head stands and how it leans."""

    name: str = Field(min_length=1, max_length=32, pattern=r"^[A-Za-z0-9_]+$")
    north_m: float = Field(0.0, ge=-1e5, le=1e5, description="of the head")
    east_m: float = Field(0.0, ge=-1e5, le=1e5, description="of the head")
    inclination_deg: float = Field(0.0, ge=0.0, lt=90.0)
    azimuth_deg: Angle = 0.0


class SiteSection(ScenarioSection):
    """A wall; its holes are drilled in this order, and each is judged with those before it."""

    name: str = Field("wall", min_length=1, max_length=64)
    radius_m: Positive = Field(0.6, description="of each column")
    thickness_m: Positive = Field(0.8, description="of the wall, that is required")
    holes: Annotated[tuple[HoleSection, ...], Field(min_length=2, max_length=40)]
