"""One wall through both doors: as a file, and with one of its holes coming live. Nothing that is said may differ."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hand_fed import Rig

from groundstation.errors import SurveyError
from groundstation.service.answers.wall_views import survey_of
from groundstation.service.hole.live_wall import LiveWall
from groundstation.survey.wall.column_plans import ColumnSurvey
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_verdict import Judgement, WallVerdict

SPACING, LENGTH, STEP = 0.75, 8.0, 2.0
COVARIANCE = ("cov_nn_m2", "cov_ne_m2", "cov_nd_m2", "cov_ee_m2", "cov_ed_m2", "cov_dd_m2")


@dataclass(frozen=True)
class Case:
    """Heads, and which of them is drilled last."""

    heads: dict[str, tuple[float, float, float]]  # north, east, down
    own: str
    keys: str = ""
    inclination_deg: float = 0.0
    azimuth_deg: float = 0.0
    build_deg_per_m: float = 0.0  # of a plan


def ring(count: int) -> dict[str, tuple[float, float, float]]:
    radius = 0.5 * SPACING / math.sin(math.pi / count)
    angles = [math.tau * k / count for k in range(count)]
    return {f"R{k}": (radius * math.cos(a), radius * math.sin(a), 0.0) for k, a in enumerate(angles)}


LINE = {"H1": (0.0, 0.0, 0.0), "H2": (0.0, SPACING, 0.0), "H3": (0.0, 2.0 * SPACING, 0.0)}
CASES = {
    "vertical": Case(LINE, "H2"),
    "raked": Case(LINE, "H2", inclination_deg=15.0),
    "raked along the wall": Case(LINE, "H3", inclination_deg=15.0, azimuth_deg=90.0),
    "horizontal": Case(LINE, "H2", inclination_deg=90.0, azimuth_deg=0.0),
    "planned": Case(LINE, "H2", inclination_deg=5.0, azimuth_deg=20.0, build_deg_per_m=3.0),
    "ring": Case(ring(8), "R3", 'layout = "shaft"\n'),
    "grid": Case(
        {f"G{r}{c}": (SPACING * r, SPACING * c, 0.0) for r in range(3) for c in range(3)}, "G11",
        f'layout = "grid"\nspacing_m = {SPACING}\n',
    ),
}  # fmt: skip


def surveyed(case: Case, name: str, off_deg: float) -> ColumnSurvey:
    """A column a little off its design, one way or another by its name; ``off_deg`` more to the right."""
    md = np.arange(0.0, LENGTH + 1e-9, STEP)
    turn = 0.03 * (sum(map(ord, name)) % 7 - 3)
    inclination = np.radians(case.inclination_deg + 0.02 * turn + case.build_deg_per_m * md)
    s, c = np.sin(inclination), np.cos(inclination)
    azimuth = math.radians(case.azimuth_deg)
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    tangents = np.stack([s * math.cos(azimuth), s * math.sin(azimuth), c], axis=1)
    tangents += math.radians(turn + off_deg) * right
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    angles = np.arccos(tangents[:, 2]), np.arctan2(tangents[:, 1], tangents[:, 0])
    axes = np.linalg.qr(np.column_stack([tangents[0], right, [0.3, 0.1, 0.2]]))[0]
    sizes = np.outer(np.maximum(md, 1e-3) / LENGTH, [0.01, 0.02, 0.015])
    covs = np.einsum("ij,nj,kj->nik", axes, sizes**2, axes)
    covs[0] = 0.0
    return ColumnSurvey(md, *angles, covs=covs)


def written(folder: Path, case: Case, holes: dict[str, ColumnSurvey], with_covs: bool) -> Path:
    heads = "".join(f"{name},{n},{e},{d}\n" for name, (n, e, d) in case.heads.items())
    (folder / "heads.csv").write_text(f"column,north_m,east_m,down_m\n{heads}")
    names = COVARIANCE if with_covs else ()
    rows = [",".join(["column", "md_m", "inclination_deg", "azimuth_deg", *names])]
    for name, hole in holes.items():
        assert hole.covs is not None
        for md, i, a, cov in zip(hole.md, hole.inclination, hole.azimuth, hole.covs, strict=True):
            told = [cov[k] for k in zip(*np.triu_indices(3), strict=True)] if with_covs else []
            values = [float(md), math.degrees(i), math.degrees(a), *map(float, told)]
            rows.append(",".join([name, *(f"{value:.17g}" for value in values)]))
    (folder / "stations.csv").write_text("\n".join(rows) + "\n")
    path, axis = folder / "wall.toml", f"inclination_deg = {case.inclination_deg}\nazimuth_deg = {case.azimuth_deg}\n"
    if case.build_deg_per_m:
        leg = f"[[leg]]\nlength_m = {LENGTH}\nbuild_deg_per_m = {case.build_deg_per_m}\n"
        (folder / "plan.toml").write_text(axis + leg)
    design = 'plan = "plan.toml"\n' if case.build_deg_per_m else f"length_m = {LENGTH}\n{axis}"
    path.write_text(
        'name = "doors"\nradius_m = 0.6\nthickness_m = 0.8\nheads = "heads.csv"\nstations = "stations.csv"\n'
        f"{design}{case.keys}"
    )
    return path


def both_doors(folder: Path, case: Case, off_deg: float, with_covs: bool) -> tuple[Wall, Judgement, Wall, Judgement]:
    """The wall and its judgement from the file with all holes, and from one without the last that comes live."""
    holes = {name: surveyed(case, name, off_deg if name == case.own else 0.0) for name in case.heads}
    by_file = read_wall(written(folder, case, holes, with_covs))
    others = {name: hole for name, hole in holes.items() if name != case.own}
    live = LiveWall(written(folder, case, others, with_covs), case.own)
    own = holes[case.own]
    sent = own if with_covs else ColumnSurvey(own.md, own.inclination, own.azimuth)
    found = live.judged(sent, LENGTH)
    assert found.judgement is not None, found.problem
    return by_file, judge_wall(by_file), found.wall, found.judgement


@pytest.mark.parametrize("with_covs", [True, False])
@pytest.mark.parametrize("off_deg", [0.0, 4.0])
@pytest.mark.parametrize("name", CASES)
def test_what_is_said_of_a_hole_does_not_depend_on_the_door(
    tmp_path: Path, name: str, off_deg: float, with_covs: bool
) -> None:
    case = CASES[name]
    file_wall, by_file, live_wall, live = both_doors(tmp_path, case, off_deg, with_covs)
    assert live.verdict == by_file.verdict
    beside = {plan.design.name for plan in live_wall.plans}  # what was read of a neighbour is a doubt of the joint
    own = [f for f in by_file.findings if case.own in f.what.split("-") or f.what in beside]
    assert [(f.kind, f.text) for f in live.findings] == [(f.kind, f.text) for f in own]
    if off_deg:
        assert own
    names = [[plan.design.name for plan in wall.plans] for wall in (file_wall, live_wall)]
    for pair, thickness, chance in zip(live.joints.pairs, live.joints.thickness, live.joints.probability, strict=True):
        joint = {names[1][k] for k in pair}
        same = next(j for j, p in enumerate(by_file.joints.pairs) if {names[0][k] for k in p} == joint)
        np.testing.assert_allclose(thickness, by_file.joints.thickness[same], atol=1e-12)
        np.testing.assert_allclose(chance, by_file.joints.probability[same], rtol=1e-9, atol=1e-15)
    assert len(live.joints.pairs) == sum(case.own in {names[0][k] for k in pair} for pair in by_file.joints.pairs)


def test_a_wall_of_the_same_columns_is_the_same_to_the_last_digit(tmp_path: Path) -> None:
    _, by_file, _, live = both_doors(tmp_path, CASES["vertical"], 0.5, with_covs=True)
    assert live.system == by_file.system
    assert [(f.kind, f.what, f.top, f.bottom, f.probability) for f in live.findings] == [
        (f.kind, f.what, f.top, f.bottom, f.probability) for f in by_file.findings
    ]
    assert live.extras == by_file.extras


@pytest.mark.parametrize("with_covs", [True, False])
@pytest.mark.parametrize("door", ["file", "live"])
def test_surveys_may_count_from_another_north_than_the_wall(tmp_path: Path, door: str, with_covs: bool) -> None:
    """Grid north lies 7 deg west of true north, from which the stations count: the wall is the one of grid north."""
    case, west = CASES["raked"], math.radians(7.0)
    holes = {name: surveyed(case, name, 2.0 if name == case.own else 0.0) for name in case.heads}
    to_true = np.array([[math.cos(west), math.sin(west), 0.0], [-math.sin(west), math.cos(west), 0.0], [0.0, 0.0, 1.0]])
    from_true = {
        name: replace(hole, azimuth=hole.azimuth - west, covs=to_true @ hole.covs @ to_true.T)
        for name, hole in holes.items()
        if hole.covs is not None
    }
    told = 'north = "grid"\nstations_north = "true"\nconvergence_deg = -7\n'
    for folder in ("grid", "true"):
        (tmp_path / folder).mkdir()
    expected = judge_wall(read_wall(written(tmp_path / "grid", case, holes, with_covs)))
    own = replace(from_true[case.own], covs=from_true[case.own].covs if with_covs else None)
    others = from_true if door == "file" else {name: hole for name, hole in from_true.items() if name != case.own}
    path = written(tmp_path / "true", replace(case, keys=told), others, with_covs)
    found = judge_wall(read_wall(path)) if door == "file" else LiveWall(path, case.own).judged(own, LENGTH).judgement
    assert found is not None
    np.testing.assert_allclose(np.sort(found.joints.thickness, 0), np.sort(expected.joints.thickness, 0), atol=1e-9)
    np.testing.assert_allclose(
        np.sort(found.joints.probability, 0), np.sort(expected.joints.probability, 0), rtol=1e-6, atol=1e-15
    )


def test_a_remedial_column_closes_the_joint_that_it_stands_in_for_live_too(tmp_path: Path) -> None:
    """Two of three columns stand 1.1 m apart, and one between them is drilled last."""
    case = Case({"A": (0.0, 0.0, 0.0), "B": (0.0, 1.1, 0.0), "C": (0.0, 1.8, 0.0), "R": (0.05, 0.55, 0.0)}, "R")
    holes = {name: surveyed(case, name, 0.0) for name in case.heads}
    own = holes["R"]
    file = written(tmp_path, case, holes, with_covs=True)
    heads = (tmp_path / "heads.csv").read_text().splitlines()
    remedied = "\n".join([f"{heads[0]},between", *(f"{row}," for row in heads[1:4]), f"{heads[4]},A/B"]) + "\n"
    (tmp_path / "heads.csv").write_text(remedied)
    by_file = judge_wall(read_wall(file))
    written(tmp_path, case, {name: holes[name] for name in "ABC"}, with_covs=True)
    (tmp_path / "heads.csv").write_text(remedied)
    live = LiveWall(file, "R")
    found = live.judged(own, LENGTH).judgement
    assert found is not None
    assert found.verdict == by_file.verdict == WallVerdict.TIGHT
    np.testing.assert_allclose(found.joints.probability, by_file.joints.probability[:1], rtol=1e-9)
    np.testing.assert_allclose(found.joints.thickness, by_file.joints.thickness[:1], atol=1e-12)
    before = LiveWall(file, "R").judged(ColumnSurvey(*np.zeros((3, 1))), None).judgement
    assert before is not None
    assert before.verdict is WallVerdict.NOT_TIGHT


def test_a_void_beside_the_hole_is_seen_live(tmp_path: Path) -> None:
    _, by_file, _, live = both_doors(tmp_path, CASES["grid"], 6.0, with_covs=True)
    assert by_file.voids
    assert [(v.depth, v.void.area) for v in live.voids] == [(v.depth, v.void.area) for v in by_file.voids]


@pytest.mark.parametrize("toe_m", [8.0, 8.2, 8.49])
def test_a_hole_comes_to_its_toe_wherever_that_lies_between_two_planes(tmp_path: Path, toe_m: float) -> None:
    """The bit goes on from the last station, and nothing else changes: all of the column is drilled then."""
    case = CASES["raked"]
    holes = {name: surveyed(case, name, 0.0) for name in case.heads}
    own = holes.pop(case.own)
    file = written(tmp_path, case, holes, with_covs=True)
    file.write_text(file.read_text().replace(f"length_m = {LENGTH}", f"length_m = {toe_m}"))
    live, fresh = LiveWall(file, case.own), LiveWall(file, case.own)
    planes, gone = [], 0
    for bit in (LENGTH - 0.07, LENGTH, toe_m):
        found = live.judged(own, bit)
        planes.append(live.plane_of(bit))
        assert found.judgement is not None
        gone = int(np.sum(found.wall.columns.states[found.own] == ColumnState.MISSING))
    anew = fresh.judged(own, toe_m)
    assert gone == 0
    assert anew.judgement is not None
    assert [f.text for f in found.judgement.findings] == [f.text for f in anew.judgement.findings]
    assert planes[0] < planes[-1]  # what shows the wall asks for it anew then


@pytest.mark.parametrize("name", ["vertical", "raked", "horizontal", "planned"])
def test_nothing_that_is_said_changes_between_the_planes_that_are_told(tmp_path: Path, name: str) -> None:
    """The hole is drilled on its design while nothing is surveyed; a layer thinner than a step has a plane too."""
    case = replace(CASES[name], keys="[[layer]]\nfrom_m = 3.1\nradius_m = 0.7\n[[layer]]\nfrom_m = 3.3\n")
    holes = {other: surveyed(case, other, 0.0) for other in case.heads}
    own = holes.pop(case.own)
    live = LiveWall(written(tmp_path, case, holes, with_covs=True), case.own)
    assert own.covs is not None
    begun = ColumnSurvey(own.md[:2], own.inclination[:2], own.azimuth[:2], covs=own.covs[:2])
    said: dict[int, set[tuple[str, ...]]] = {}
    for bit in np.arange(STEP + 0.02, LENGTH + 0.01, 0.07):
        now = live.judged(begun, float(bit))
        assert now.judgement is not None
        assert now.wall.built.ends[now.own] == bit  # which is told anew however little it has moved
        told = tuple(finding.text for finding in now.judgement.findings if "is missing from" in finding.text)
        said.setdefault(live.plane_of(float(bit)), set()).add(told)
    assert [len(texts) for texts in said.values()] == [1] * len(said)
    assert len(said) >= 12  # half a metre apart, and two of layers


def test_own_covariances_are_used(tmp_path: Path) -> None:
    """Twice as uncertain, and the probability of a thin joint follows."""
    case = CASES["vertical"]
    holes = {name: surveyed(case, name, 0.0) for name in case.heads}
    own = holes.pop(case.own)
    assert own.covs is not None
    live = LiveWall(written(tmp_path, case, holes, with_covs=True), case.own)
    peaks = []
    for size in (1.0, 3.0, 9.0):
        found = live.judged(ColumnSurvey(own.md, own.inclination, own.azimuth, covs=size**2 * own.covs), LENGTH)
        assert found.judgement is not None
        peaks.append(float(found.judgement.joints.probability.max()))
    assert peaks[0] < peaks[1] < peaks[2]


def raked(inclination_deg: float) -> dict[str, float]:
    """A design that leans, and a crew that told the collar to be set out so."""
    return {"design_inclination_deg": inclination_deg, "collar_inclination_deg": inclination_deg}


@pytest.mark.parametrize("rake_deg", [0.0, 15.0, 60.0, 89.5, 90.0, 110.0])
def test_a_hole_drilled_on_its_design_stands_on_it_in_the_wall(tmp_path: Path, rake_deg: float) -> None:
    case = Case(LINE, "H2", inclination_deg=rake_deg)
    others = {name: surveyed(case, name, 0.0) for name in ("H1", "H3")}
    file = written(tmp_path, case, others, with_covs=True)
    rig = Rig(tmp_path / "ground", target=LENGTH, wall=file, hole="H2", **raked(rake_deg))
    rig.run(5.0)
    for stop in range(1, 5):
        rig.drill(stop, rake_deg)
    model = rig.ground.model
    assert model.wall is not None
    found = model.wall.judged(survey_of(model), model.string.bit)
    assert found.judgement is not None, found.problem
    columns = found.wall.columns
    off = columns.centres[found.own] - columns.planned[found.own]
    sigma = np.sqrt(np.maximum(np.diagonal(columns.covs[found.own], axis1=1, axis2=2), 0.0))
    assert np.all(np.isfinite(off))
    assert np.all(np.abs(off) <= sigma + 1e-9)
    rows = rig.ask("stations")["stations"]  # what is told of the hole itself is what its wall takes
    told = [[row[f"sigma_{name}_m"] for name in ("north", "east", "tvd")] for row in rows]
    taken = survey_of(model).covs
    assert taken is not None
    np.testing.assert_allclose(np.sqrt(np.diagonal(taken[1:], axis1=1, axis2=2)), told, rtol=1e-3, atol=1e-6)
    rig.ground.close()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace(",cov_dd_m2", ",other"), "together, cov_dd_m2 is missing"),
        (
            lambda text: text.replace("0.0001", "-1"),
            "expected the covariance of a station",
        ),
    ],
)
def test_covariances_that_are_none_are_refused_with_their_line(tmp_path: Path, change, message: str) -> None:
    (tmp_path / "wall.toml").write_text(
        'radius_m = 0.6\nthickness_m = 0.8\nheads = "heads.csv"\nstations = "stations.csv"\nlength_m = 2\n'
    )
    (tmp_path / "heads.csv").write_text("column,north_m,east_m\nH1,0,0\nH2,0,0.75\n")
    text = ",".join(["column", "md_m", "inclination_deg", "azimuth_deg", *COVARIANCE])
    text += "\nH1,0,0,0,0,0,0,0,0,0\nH1,2,0,0,0.0001,0,0,0.0001,0,0.0001\n"
    (tmp_path / "stations.csv").write_text(text)
    assert read_wall(tmp_path / "wall.toml").holes[0].covs is not None
    (tmp_path / "stations.csv").write_text(change(text))
    with pytest.raises(SurveyError, match=message) as refused:
        read_wall(tmp_path / "wall.toml")
    assert "line" in str(refused.value)
