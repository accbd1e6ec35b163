"""Designs that no drilling would make tight: a grid in parts, columns too thin for their joints."""

from pathlib import Path

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import read_wall
from groundstation.survey.wall.wall_verdict import FindingKind, WallVerdict

LENGTH = 8.0  # m
Heads = dict[str, tuple[float, float]]


def made(folder: Path, heads: Heads, more: str, radii: dict[str, float] | None = None) -> Path:
    """A wall of vertical columns, each drilled on its design."""
    rows = "".join(f"{name},{n},{e},{(radii or {}).get(name, '')}\n" for name, (n, e) in heads.items())
    (folder / "heads.csv").write_text("column,north_m,east_m,radius_m\n" + rows)
    stations = "".join(f"{name},{md},0,0\n" for name in heads for md in (0.0, 4.0, LENGTH))
    (folder / "stations.csv").write_text("column,md_m,inclination_deg,azimuth_deg\n" + stations)
    path = folder / "wall.toml"
    path.write_text(f'radius_m = 0.6\nthickness_m = 0.8\nheads = "heads.csv"\nstations = "stations.csv"\n{more}')
    return path


def block(name: str, east: float) -> Heads:
    """Four columns of a grid of 0.7 m."""
    return {f"{name}{r}{c}": (0.7 * r, east + 0.7 * c) for r in range(2) for c in range(2)}


@pytest.mark.parametrize(
    ("others", "named"),
    [
        (block("Q", 4.0), "P01 and Q00 are 3.300 m apart"),  # far beyond what voids are looked for in
        ({"Q": (0.0, 1.6)}, "P01 and Q are 0.900 m apart"),
    ],
)
def test_a_grid_in_parts_is_refused_as_a_design(tmp_path: Path, others: Heads, named: str) -> None:
    path = made(tmp_path, block("P", 0.0) | others, 'layout = "grid"\nspacing_m = 0.7\n')
    with pytest.raises(SurveyError, match=f"the grid is in 2 parts that no joint connects: columns {named}") as error:
        read_wall(path)
    assert "neighbours of spacing_m = 0.7 are 0.840 m or less" in str(error.value)
    assert "\n" not in str(error.value)


def test_a_grid_in_one_piece_is_judged(tmp_path: Path) -> None:
    path = made(tmp_path, block("P", 0.0) | block("Q", 1.4), 'layout = "grid"\nspacing_m = 0.7\n')
    assert judge_wall(read_wall(path)).verdict is WallVerdict.TIGHT


@pytest.mark.parametrize(
    ("more", "radii", "top"),
    [("[[layer]]\nfrom_m = 5\nradius_m = 0.39\n", {}, 5.0), ("", {"B": 0.35}, 0.0), ("", {"B": 0.4}, 0.0)],
)
def test_a_column_too_thin_for_its_joint_leaves_the_wall_judged(
    tmp_path: Path, more: str, radii: dict[str, float], top: float
) -> None:
    """No joint of 0.8 m has a column of less: it is open there, is said to be so by its design, and is not closed."""
    heads = {name: (0.0, 0.7 * k) for k, name in enumerate("ABC")}
    found = judge_wall(read_wall(made(tmp_path, heads, more, radii)))
    assert found.verdict is WallVerdict.NOT_TIGHT
    said = [finding for finding in found.findings if finding.kind is FindingKind.DESIGN]
    assert [(one.what, one.top, one.bottom) for one in said] == [("A-B", top, LENGTH), ("B-C", top, LENGTH)]
    radius = radii.get("B", 0.39)
    assert said[0].text.endswith(f": a column of {radius:g} m radius makes no joint of 0.8 m")
    assert [extra.closes for _, extra in found.extras] == [False, False]
    assert found.system.probability == 1.0


LAYERS = {
    "from the heads on": "from_m = 0\nradius_m = 0.58\nradius_cv = 0.01",
    "from above the heads on": "from_m = -3\nradius_m = 0.58\nradius_cv = 0.01",
    "below the toes": "from_m = 30\nradius_m = 0.58\nradius_cv = 0.01",
}


@pytest.mark.parametrize("layout", ["line", "grid"])
@pytest.mark.parametrize("name", LAYERS)
def test_layers_without_a_plane_count_for_nothing(tmp_path: Path, name: str, layout: str) -> None:
    """As a wall whose own radius is that of the only layer which has planes."""
    heads = block("P", 0.0) if layout == "grid" else {name: (0.0, 0.7 * k) for k, name in enumerate("ABC")}
    keys = f'layout = "{layout}"\nspacing_m = 0.7\nradius_cv = 0.01\n'
    found = judge_wall(read_wall(made(tmp_path, heads, keys + f"[[layer]]\n{LAYERS[name]}\n")))
    path = made(tmp_path, heads, keys)
    if name != "below the toes":
        path.write_text(path.read_text().replace("radius_m = 0.6", "radius_m = 0.58"))
    alike = judge_wall(read_wall(path))
    assert (found.verdict, found.system) == (alike.verdict, alike.system)
    np.testing.assert_array_equal(found.joints.thickness, alike.joints.thickness)


def test_a_layer_thinner_than_a_step_is_judged(tmp_path: Path) -> None:
    heads = {name: (0.0, 0.7 * k) for k, name in enumerate("ABC")}
    more = "[[layer]]\nfrom_m = 3.1\nradius_m = 0.45\n[[layer]]\nfrom_m = 3.3\nradius_m = 0.6\n"
    wall = read_wall(made(tmp_path, heads, more))
    np.testing.assert_allclose(wall.columns.depths, sorted([*np.arange(0.0, LENGTH + 0.1, 0.5), 3.1, 3.3]))
    thin = [one for one in judge_wall(wall).findings if one.kind is FindingKind.THIN]
    assert [(one.what, one.top, one.bottom) for one in thin] == [("A-B", 3.1, 3.1), ("B-C", 3.1, 3.1)]
