"""The hole of a scenario: a record, a shape in closed form or one that is drawn; and what moves it later."""

from __future__ import annotations

from typing import Final, Literal, TypeAlias, get_args

from pydantic import Field

from sim.world.section import Angle, NotNegative, Positive, ScenarioSection

HoleKind: TypeAlias = Literal["straight", "build", "walk", "soft", "wellbore", "steered", "random"]
HOLE_KINDS: Final[tuple[HoleKind, ...]] = get_args(HoleKind)


class StraightSection(ScenarioSection):
    """A straight hole."""

    inclination_deg: float = Field(0.0, ge=0.0, lt=180.0)
    azimuth_deg: Angle = 0.0


class SpiralSection(ScenarioSection):
    """A hole whose azimuth turns evenly over its length, and its inclination with it."""

    inclination_deg: float = Field(0.0, ge=0.0, le=90.0)
    azimuth_deg: Angle = 0.0
    turn_deg: Angle = Field(0.0, description="of the azimuth, from the collar to the last bit's depth")
    build_deg: float = Field(0.0, ge=-90.0, le=90.0, description="of the inclination, likewise")


class DrawnSection(ScenarioSection):
    """A hole of a kind, drawn by a number of its own; smooth between any two stations, see sim.world.drawn_hole."""

    kind: HoleKind = Field("random", description="what bends it")
    seed: int = Field(1, ge=0, lt=2**63, description="of the draw; one number, one hole")
    inclination_deg: float = Field(0.0, ge=0.0, le=120.0, description="of the axis that it leaves")
    azimuth_deg: Angle = Field(0.0, description="likewise")
    collar_std_deg: NotNegative = Field(0.15, le=5.0, description="lean of its collar against that axis, each way")
    bending: NotNegative = Field(1.0, le=10.0, description="times what its kind bends by")


class MovedSection(ScenarioSection):
    """A stretch of the hole that takes another direction while the rig drills below it."""

    after_s: NotNegative = Field(description="after the start")
    from_m: NotNegative = Field(description="measured depth of the stretch's begin")
    to_m: Positive = Field(description="and of its end")
    north_deg: float = Field(0.0, ge=-5.0, le=5.0, description="by which its lean changes to the north")
    east_deg: float = Field(0.0, ge=-5.0, le=5.0, description="and to the east")
    ramp_m: Positive = Field(0.5, le=10.0, description="above and below it, over which the change goes to nothing")


class PathSection(ScenarioSection):
    """The hole; exactly one of the first five, files relative to the scenario."""

    displacements: str | None = Field(None, description="CSV md_m,a_cm,b_cm: lateral displacement over one interval")
    stations: str | None = Field(None, description="CSV md_m,inclination_deg,azimuth_deg")
    straight: StraightSection | None = Field(None, description="a hole in one direction, as long as it takes")
    spiral: SpiralSection | None = Field(None, description="a hole whose azimuth turns, as long as it takes")
    drawn: DrawnSection | None = Field(None, description="a hole that is drawn, as long as it takes")
    moved: MovedSection | None = Field(None, description="what becomes of it while the rig drills")
