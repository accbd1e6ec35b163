"""What an exported file says of a hole: stations, axis in site coordinates, covariances, radius and verdict."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ExportHole:
    """One hole; angles in deg as files have them, lengths in m.

    Attributes
    ----------
    md, inclination_deg, azimuth_deg : (n,) stations
    local : (n, 3) north, east, down of the hole's zero
    axis : (n, 3) easting, northing, height of the site; local east, north and up where there is no grid
    covs : (n, 3, 3) m^2, north, east, down at one sigma; None where they are not known
    deviation : (2,) north and east of the toe from its design
    """

    name: str
    md: Array
    inclination_deg: Array
    azimuth_deg: Array
    local: Array
    axis: Array
    covs: Array | None = None
    radius: float | None = None
    verdict: str = ""
    north: str = "site"
    deviation: Array | None = None
    magnetic: bool = False  # surveyed by a magnetic instrument


@dataclass(frozen=True, slots=True)
class ExportSite:
    """What all holes of a file share; ``crs`` is the code of their coordinates, empty of local ones."""

    name: str
    holes: tuple[ExportHole, ...]
    verdict: str = ""
    crs: str = ""
    remarks: tuple[str, ...] = ()
    day: str = "2026-01-01"
    project: str = ""
    client: str = ""

    def in_plain_lines(self) -> ExportSite:
        """The site with every text in one line of letters that a file of any format can hold."""
        holes = tuple(replace(hole, name=plain_line(hole.name)) for hole in self.holes)
        words = {key: plain_line(getattr(self, key)) for key in ("name", "crs", "project", "client")}
        return replace(self, holes=holes, remarks=tuple(map(plain_line, self.remarks)), **words)


def plain_line(text: str) -> str:
    """Text without letters that are none: ends of lines, controls, halves of a pair from names of files."""
    return "".join(letter if letter.isprintable() else " " for letter in text)
