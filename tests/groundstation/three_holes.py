"""A wall of three holes as its files, of which the middle one is still to be drilled."""

from pathlib import Path

THREE_HOLES = """
name = "three holes"
radius_m = 0.60
thickness_m = 0.80
length_m = 8.0
heads = "heads.csv"
stations = "s.csv"
"""


def write_three_holes(folder: Path, more: str = "") -> Path:
    """Write the wall, with ``more`` lines in it, and the files it names; returns its path."""
    wall = folder / "wall.toml"
    wall.write_text(THREE_HOLES + more)
    (folder / "heads.csv").write_text("column,north_m,east_m\nH1,0,0\nH2,0.75,0\nH3,1.5,0\n")
    rows = "".join(f"{hole},{md},0,0\n" for hole in ("H1", "H3") for md in (0, 4, 8))
    (folder / "s.csv").write_text(f"column,md_m,inclination_deg,azimuth_deg\n{rows}")
    return wall
