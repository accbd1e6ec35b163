"""Voids, joints and make-ups beside rasters, closed forms and sums by hand, with sizes that all differ."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.path.curvature_prior import CurvaturePrior
from groundstation.survey.path.curvature_tendency import learn_curvature
from groundstation.survey.wall.as_built import Columns, covariance_roots, intersect_planes
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.column_joint import (
    joint_thickness,
    limit_distances,
    probability_beyond,
    shift_margin,
)
from groundstation.survey.wall.projected_end import project_to_target
from groundstation.survey.wall.voids import find_voids, power_centre, triples_of
from groundstation.survey.well.depth_errors import DepthErrors
from groundstation.survey.well.make_up_depths import (
    MakeUpDepths,
    learnt_reading_std,
    make_up_depths,
    misfit_of_depths,
)
from groundstation.survey.well.trajectory_rows import TrajectoryPoint

Array = np.ndarray


# voids


def discs(seed: int) -> tuple[Array, Array]:
    """Columns of three sizes: one is inside another, one in a joint, one twice, one not there, one stands alone."""
    random = np.random.default_rng(seed)
    grid = np.stack(np.meshgrid(np.arange(6.0), np.arange(6.0)), axis=-1).reshape(-1, 2)
    centres, radii = grid + 0.03 * random.standard_normal(grid.shape), random.choice([0.52, 0.56, 0.62], len(grid))
    centres[9], radii[21] = math.nan, 0.17
    centres = np.vstack([centres, centres[0], centres[3] + 0.05, (centres[14] + centres[15]) / 2.0])
    return centres, np.concatenate([radii, [radii[0], 0.3, 0.1]])  # the last lies in the joint of two


@pytest.mark.parametrize("seed", range(2))
def test_voids_of_columns_of_any_size_are_those_of_a_raster(seed: int) -> None:
    from scipy.ndimage import label

    centres, radii = discs(seed)
    step = 0.01
    places = np.arange(-1.0, 6.0, step)
    x, y = np.meshgrid(places, places)
    free = np.full(x.shape, np.inf)
    for (cx, cy), radius in zip(centres, radii, strict=True):
        if math.isfinite(cx):
            free = np.minimum(free, np.hypot(x - cx, y - cy) - radius)
    parts, count = label(free > 0.0)
    shares = [(part, parts == part) for part in range(1, count + 1) if part != parts[0, 0]]
    rastered = sorted((inside.sum() * step**2, free[inside].max(), part) for part, inside in shares)
    voids = sorted(find_voids(centres, radii), key=lambda one: one.area)
    rastered, voids = [one for one in rastered if one[0] > 0.002], [one for one in voids if one.area > 0.002]
    assert len(voids) == len(rastered) > 10
    for void, (area, deepest, part) in zip(voids, rastered, strict=True):
        assert void.area == pytest.approx(area, abs=1e-3 + 0.01 * area)
        column, row = (round((at + 1.0) / step) for at in void.place)
        assert parts[row, column] == part
        assert void.radius == pytest.approx(free[row, column], abs=2.0 * step)
        assert void.radius <= deepest + 2.0 * step
        if len(void.columns) <= 8 and not void.area > 0.5:  # the deepest point of a large one may be by its island
            assert void.radius == pytest.approx(deepest, abs=0.03)


@pytest.mark.parametrize("turn", np.arange(0.0, 6.3, 0.7))
def test_a_column_that_stands_free_in_a_void_takes_its_area_from_it(turn: float) -> None:
    """Twelve columns in a ring; in it one, or a ring of six which has a void of its own with one inside."""
    ring = turn + math.tau / 12 * np.arange(12)
    outer = 10.0 * np.stack([np.cos(ring), np.sin(ring)], axis=1)
    inner = 3.0 * np.stack([np.cos(ring[::2]), np.sin(ring[::2])], axis=1) + [1.0, 2.0]
    centres, radii = outer, np.full(12, 2.8)
    (empty,) = find_voids(centres, radii)
    (one,) = find_voids(np.vstack([centres, [[2.0, -1.0]]]), np.append(radii, 0.7))
    assert one.area == pytest.approx(empty.area - math.pi * 0.49)
    (alone,) = find_voids(inner, np.full(6, 1.6))
    nested = find_voids(np.vstack([centres, inner, [[1.0, 2.0]]]), np.concatenate([radii, np.full(6, 1.6), [0.5]]))
    inside, outside = sorted(nested, key=lambda void: void.area)
    assert inside.area == pytest.approx(alone.area - math.pi * 0.25)
    lens = 2.0 * (1.6**2 * math.acos(1.5 / 1.6) - 1.5 * math.sqrt(1.6**2 - 1.5**2))
    assert outside.area == pytest.approx(empty.area - (6.0 * (math.pi * 1.6**2 - lens) + alone.area))
    beside = find_voids(np.vstack([centres, [[20.0, 0.0]]]), np.append(radii, 0.7))
    assert beside[0].area == pytest.approx(empty.area)


@pytest.mark.parametrize("radius", [0.51, 0.55, 0.57, 0.577])
def test_a_small_void_of_three_columns_is_the_triangle_less_sectors_and_lenses(radius: float) -> None:
    centres = np.array([[0.0, 0.0], [1.0, 0.0], [0.5, math.sqrt(0.75)]])
    (void,) = find_voids(centres, np.full(3, radius))
    lens = 2.0 * (radius**2 * math.acos(0.5 / radius) - 0.5 * math.sqrt(radius**2 - 0.25))
    assert void.area == pytest.approx(math.sqrt(3.0) / 4.0 - math.pi / 2.0 * radius**2 + 1.5 * lens, abs=1e-12)
    assert void.radius == pytest.approx(1.0 / math.sqrt(3.0) - radius)


def test_a_power_centre_is_as_far_from_three_discs_by_their_tangents() -> None:
    centres, radii = np.array([[[0.0, 0.0], [3.0, 0.5], [1.0, 2.5]]]), np.array([[0.4, 0.9, 0.6]])
    (meeting,) = power_centre(centres, radii)
    powers = np.sum((centres[0] - meeting) ** 2, axis=1) - radii[0] ** 2
    assert powers == pytest.approx([powers[0]] * 3)


def test_triples_are_near_each_other_all_three() -> None:
    heads = np.array([[1.0, 0.0], [0.0, 0.0], [2.0, 0.0], [1.0, 1.0]])
    assert triples_of(heads, 1.5).tolist() == [[0, 1, 3], [0, 2, 3]]
    assert triples_of(heads, 0.5).shape == (0, 3)


# columns cut by planes


def test_between_stations_a_hole_is_the_cubic_through_their_places_and_slopes() -> None:
    """Two wells whose ways are cubics of the depth themselves: a cut gives them back, up to 5 cm beyond their ends."""
    depth = np.array([[0.0, 4.0, 9.0, 15.0], [1.0, 5.0, 8.0, 14.0]])
    north = np.array([[0.1, 0.02, 0.003, -0.0002], [-0.2, 0.01, 0.0, 0.0004]])
    east = np.array([[0.3, -0.03, 0.001, 0.0001], [0.0, 0.05, -0.002, 0.0]])

    def at(parts: Array, z: Array) -> Array:
        return np.asarray(sum(parts[:, k, None] * z**k for k in range(4)))

    def slope(parts: Array, z: Array) -> Array:
        return np.asarray(sum(k * parts[:, k, None] * z ** (k - 1) for k in range(1, 4)))

    positions = np.stack([at(north, depth), at(east, depth), depth], axis=-1)
    tangents = np.stack([slope(north, depth), slope(east, depth), np.ones_like(depth)], axis=-1)
    tangents /= np.linalg.norm(tangents, axis=-1, keepdims=True)
    planes = np.array([-0.049, 0.951, 3.0, 4.0, 7.0, 12.0, 14.04, 14.06, 15.04, 15.06])
    z = np.broadcast_to(planes, (2, len(planes)))
    cut = intersect_planes(positions, tangents, planes)
    there = (z >= depth[:, :1] - 0.05) & (z <= depth[:, -1:] + 0.05)
    assert np.isfinite(cut.centres[..., 0]).tolist() == there.tolist()
    expected = np.stack([at(north, z), at(east, z)], axis=-1)
    assert cut.centres[there] == pytest.approx(expected[there])
    errors = np.random.default_rng(1).standard_normal((2, 4, 3, 2))
    ratio = tangents[..., :2] / tangents[..., 2:]
    assert cut.in_plane(errors) == pytest.approx(errors[..., :2, :] - ratio[..., None] * errors[..., 2:, :])


def test_a_root_of_a_covariance_is_symmetric_and_gives_it_back() -> None:
    covs = np.array([[[2.0, 0.7], [0.7, 1.0]], [[4.0, 0.0], [0.0, 0.0]]])
    roots = covariance_roots(covs)
    assert roots == pytest.approx(np.swapaxes(roots, 1, 2))
    assert roots @ roots == pytest.approx(covs)


def test_some_of_the_columns_keep_all_that_is_theirs() -> None:
    random = np.random.default_rng(2)
    centres, covs = random.standard_normal((4, 3, 2)), np.tile(np.diag([1.0, 2.0]), (4, 3, 1, 1))
    whole = Columns.surveyed(list("abcd"), np.arange(3.0), centres, covs, random.standard_normal((4, 2)), 0.5)
    whole = replace(
        whole, radii=random.random((4, 3)), radius_stds=random.random((4, 3)), planned=random.random((4, 3, 2)),
        states=random.integers(0, 3, (4, 3)).astype(np.int8), covs=random.random((4, 3, 2, 2)),
    )  # fmt: skip
    which = np.array([3, 1])
    some = whole.subset(which)
    assert some.names == ["d", "b"]
    for name in ("centres", "covs", "designs", "planned", "states", "radii", "radius_stds"):
        assert getattr(some, name).tolist() == getattr(whole, name)[which].tolist(), name
    some.centres[0, 1] = math.nan
    assert some.drawn_centres[0, 1].tolist() == some.planned[0, 1].tolist()
    assert some.drawn_centres[1].tolist() == some.centres[1].tolist()


# joints


@pytest.mark.parametrize(("first", "second"), [(0.5, 0.5), (0.4, 0.7), (0.7, 0.4)])
def test_a_joint_is_as_thick_as_the_common_chord_and_a_gap_as_wide_as_it_is(first: float, second: float) -> None:
    for distance in (0.35, 0.6, 0.9, 1.05):
        thick = float(joint_thickness(np.array(distance), first, second))
        if distance >= first + second:
            assert thick == pytest.approx(first + second - distance)
        elif distance**2 <= abs(first**2 - second**2):
            assert thick == pytest.approx(2.0 * min(first, second))
        else:  # by Heron: twice the height of the triangle of the two radii
            s = 0.5 * (first + second + distance)
            area = math.sqrt(s * (s - first) * (s - second) * (s - distance))
            assert thick == pytest.approx(4.0 * area / distance)
            (limit,) = limit_distances(np.array([first]), np.array([second]), thick)
            if limit >= math.sqrt(abs(first**2 - second**2)):
                assert limit == pytest.approx(distance) or distance < limit
    for one, other, required in ((0.3, 0.9, 0.7), (0.9, 0.3, 0.7), (0.0, 0.5, 0.0), (0.5, 0.0, 0.0)):
        assert limit_distances(np.array([one]), np.array([other]), required).tolist() == [0.0]


def test_a_shift_leaves_the_joint_just_thick_enough() -> None:
    shift, lean = shift_margin(0.5, 0.6, 0.7, 20.0)
    assert float(joint_thickness(np.array(0.7 + shift), 0.5)) == pytest.approx(0.6)
    assert math.tan(lean) == pytest.approx(shift / 20.0)


@pytest.mark.parametrize("std", [0.01, 0.1, 0.6])
def test_the_chance_beyond_a_distance_is_that_of_the_noncentral_chi_square(std: float) -> None:
    from scipy.special import chndtr

    for mean in ([0.0, 0.0], [0.3, -0.2], [-0.55, 0.1]):
        found = float(probability_beyond(np.array(mean), std**2 * np.eye(2), np.array(0.6)))
        expected = 1.0 - float(chndtr((0.6 / std) ** 2, 2, (math.hypot(*mean) / std) ** 2))
        assert found == pytest.approx(expected, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("deviations", [1.0, 3.5, 5.0, 8.0, 20.0])
def test_a_small_chance_beyond_a_distance_is_as_exact_as_a_large_one_on_both_sides(deviations: float) -> None:
    from scipy.special import ndtr

    long, thin = 0.6 / deviations, 0.01
    steps = (np.arange(4000) + 0.5) / 4000 * 16.0 - 8.0
    chords = np.sqrt(0.36 - (thin * steps) ** 2)
    weight = np.exp(-0.5 * steps**2) / math.sqrt(math.tau) * (16.0 / 4000)
    for off in (0.0, 0.3 * long):
        expected = float(weight @ (ndtr((off - chords) / long) + ndtr((-off - chords) / long)))
        found = float(probability_beyond(np.array([0.0, off]), np.diag([thin**2, long**2]), np.array(0.6)))
        assert found == pytest.approx(expected, rel=1e-5, abs=0.0)


@pytest.mark.parametrize("mean", [(0.0, 0.0), (0.3, -0.2), (-0.2, 0.5)])
def test_the_chance_beyond_a_distance_of_a_long_covariance_is_that_of_a_fine_sum(mean: tuple[float, float]) -> None:
    root = np.array([[0.25, 0.0], [0.1, 0.06]])
    steps = (np.arange(2400) + 0.5) / 2400 * 14.0 - 7.0
    weight = np.exp(-0.5 * steps**2) / math.sqrt(math.tau) * (14.0 / 2400)
    x = mean[0] + root[0, 0] * steps[:, None] + root[0, 1] * steps
    y = mean[1] + root[1, 0] * steps[:, None] + root[1, 1] * steps
    expected = float(weight @ (np.hypot(x, y) > 0.45) @ weight)
    found = float(probability_beyond(np.array(mean), root @ root.T, np.array(0.45)))
    assert found == pytest.approx(expected, abs=2e-4)


# ends

TIPPED = math.radians(12.0)


def foreseen(position: list[float], lean: float, own: float = 1e-3, shared: float = 0.0) -> Any:
    """The end of a hole that goes straight on to a design that leans by twelve degrees to the north."""
    tangent = np.array([math.sin(lean), 0.0, math.cos(lean)])
    axis = np.array([math.sin(TIPPED), 0.0, math.cos(TIPPED)])
    cov = own**2 * (np.eye(2) - np.outer(tangent[:2], tangent[:2]))
    columns = np.array([[0.0], [shared]]) if shared else np.zeros((2, 0))
    direction = Direction(tangent[:2], tangent[2], cov, columns)
    tendency = learn_curvature(
        2.0 * np.arange(6), np.tile(tangent, (6, 1)), np.zeros((6, 3, 3)),
        CurvaturePrior(np.array([1e-9]), np.array([400.0]), np.ones((1, 1)), np.zeros(1), np.ones(1), 1e-9, 1e6),
    )  # fmt: skip
    point = TrajectoryPoint(11.0, tangent, np.array(position), np.diag([1.0, 4.0, 9.0]) * 1e-4, np.zeros((3, 0)))
    return project_to_target(point, direction, tendency, ColumnDesign(inclination=TIPPED)), tangent, axis


def test_the_end_is_where_the_line_meets_the_plane_across_the_design_with_an_error_along_it_turned_onto_it() -> None:
    found, tangent, axis = foreseen([2.0, 0.3, 9.0], math.radians(8.0))
    design = ColumnDesign(inclination=TIPPED)
    rest = float((design.end.point - [2.0, 0.3, 9.0]) @ axis) / float(tangent @ axis)
    meeting = np.array([2.0, 0.3, 9.0]) + rest * tangent
    assert found.ends.offset == pytest.approx(design.end.across @ (meeting - design.end.point))
    assert found.ends.along == pytest.approx(design.length)
    assert found.ends.md == pytest.approx(11.0 + rest)
    start = float((np.array([2.0, 0.3, 9.0]) - design.end.point) @ axis)
    expected = [design.length + start * (1.0 - k / 8.0) for k in range(1, 9)]
    assert [one.mean.along for one in found.cone] == pytest.approx(expected)
    assert [one.mean.md for one in found.cone] == pytest.approx([11.0 + rest * k / 8.0 for k in range(1, 9)])
    random = np.random.default_rng(2)
    off = random.standard_normal((100_000, 3)) * [0.01, 0.02, 0.03]
    # across the hole alone: what is along it moves the station down the same line
    along = (off @ axis)[:, None] / float(tangent @ axis) * tangent
    drawn = np.cov(((off - along) @ design.end.across.T).T)
    assert found.ends.cov == pytest.approx(drawn, rel=0.02, abs=1e-6)
    assert found.is_reached is False


def test_what_directions_share_turns_the_whole_hole_and_what_is_their_own_does_not() -> None:
    alone, _, _ = foreseen([2.0, 0.3, 9.0], math.radians(8.0), own=0.02)
    bare, _, _ = foreseen([2.0, 0.3, 9.0], math.radians(8.0), own=1e-6)
    shared, _, _ = foreseen([2.0, 0.3, 9.0], math.radians(8.0), own=1e-6, shared=0.02)
    assert alone.ends.cov == pytest.approx(bare.ends.cov)
    rest = float(shared.ends.md) - 11.0
    together = math.sqrt(bare.measured[1, 1]) + 0.02 * rest  # and errs as the position does
    assert math.sqrt(shared.measured[1, 1]) == pytest.approx(together, rel=1e-3)


@pytest.mark.parametrize(("lean_deg", "comes"), [(12.0 + 87.0, True), (12.0 + 87.3, False), (12.0 + 120.0, False)])
def test_a_hole_that_all_but_lies_across_its_design_does_not_come_there(lean_deg: float, comes: bool) -> None:
    """By a cosine of a twentieth, which is 87.13 degrees."""
    found, _, _ = foreseen([2.0, 0.3, 9.0], math.radians(lean_deg))
    assert (found.comes_there, found.is_reached) == (comes, False)
    below, _, _ = foreseen([20.0, 0.3, 90.0], math.radians(lean_deg))
    assert (below.comes_there, below.is_reached) == (comes, comes)


# make-ups

LENGTHS = np.array([2.0, 3.0, 2.5, 3.5, 2.2, 2.8, 3.1, 2.4])
NO_ERRORS = DepthErrors(0.0, 0.0, 0.0, 0.002)


def depths(*steps: float, errors_at_zero: float = -0.4) -> MakeUpDepths:
    """Make-ups of one to so many tubes, the rest of which grows by ``steps``."""
    count = len(steps) + 1
    reach = np.cumsum(LENGTHS)[:count]
    return MakeUpDepths(np.arange(1, count + 1), reach + errors_at_zero + np.cumsum([0.0, *steps]), reach)


def test_the_deepest_bit_with_each_number_of_tubes_counts() -> None:
    found = make_up_depths(np.array([3, 1, 3, 1, 3]), np.array([7.0, 1.8, 7.3, 1.2, 6.0]), LENGTHS)
    assert (found.tubes.tolist(), found.bit.tolist()) == ([1, 3], [1.8, 7.3])
    assert found.reach == pytest.approx([2.0, 7.5])
    assert found.rest == pytest.approx([-0.2, -0.2])


def test_a_reading_scatters_as_the_steps_do_less_what_tubes_do() -> None:
    found = MakeUpDepths(np.array([1, 3, 4]), np.array([2.0, 7.54, 11.0]), np.array([2.0, 7.5, 11.0]))
    errors = DepthErrors(0.0, 0.0, 0.01, 0.004)
    var = (4.0 * 0.004**2 + 0.5 * (0.04**2 - 2.0 * 0.01**2 + 0.04**2 - 0.01**2)) / 6.0
    assert learnt_reading_std(found, errors, 3.0) == pytest.approx(math.sqrt(var))
    assert learnt_reading_std(found, errors, 0.2) == 0.004  # of a crew that surveys anywhere
    assert learnt_reading_std(depths(0.0, 0.0), errors, 3.0) == 0.004


@pytest.mark.parametrize(("step", "is_told"), [(0.119, True), (0.118, False), (-0.119, True), (0.05, False)])
def test_a_step_is_unlike_beyond_eight_times_the_others(step: float, is_told: bool) -> None:
    """The others scatter as rigs do at least, by 1 cm and a half: eight times that are 12 cm."""
    usual = 0.0998 / 8.0 / 1.4826 * 1.0
    found = depths(usual, -usual, step - (0.119 - 0.0999), usual, -usual)
    text = misfit_of_depths(found, NO_ERRORS, 3.0)
    assert ("the bit went" in text) == is_told
    if is_told and step > 0.0:
        upper, lower = found.bit[2:4]
        assert f"from {upper:.2f} to {lower:.2f} m the bit went {lower - upper:.2f} m" in text
        assert "tubes of 3.50 m were added" in text


def test_a_step_of_five_centimetres_is_told_where_all_others_are_alike_and_none_of_less() -> None:
    assert "the bit went" in misfit_of_depths(depths(0.0, 0.081, 0.0, 0.0, 0.0), NO_ERRORS, 3.0)
    assert misfit_of_depths(depths(0.0, 0.079, 0.0, 0.0, 0.0), NO_ERRORS, 3.0) == ""
    assert misfit_of_depths(depths(0.0, 0.3, 0.0, 0.0), NO_ERRORS, 3.0) == ""  # three others make no habit


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_depth_that_counts_too_much_shows_in_all_steps_together(sign: float) -> None:
    """Five steps of 2 cm are a drift of 10 cm, of 14.3 m of tubes."""
    found = depths(*[0.02 * sign] * 5, errors_at_zero=-1.0)
    assert f"0.7 % {'more' if sign > 0.0 else 'less'} than the tubes" in misfit_of_depths(found, NO_ERRORS, 3.0)
    once = 2.0 * 0.01**2
    for tube_std in (0.0051, 0.0069):  # five tubes, of which the sum scatters by the root of five
        told = 5.0 * math.sqrt(5.0 * tube_std**2 + once) < 0.1
        errors = DepthErrors(0.0, 0.0, tube_std, 0.002)
        assert bool(misfit_of_depths(found, errors, 3.0)) == told
    gone = float(found.bit[-1] - found.bit[0])
    for scale in (0.9, 1.1):
        std = math.sqrt(0.02**2 - once) / gone
        assert bool(misfit_of_depths(found, DepthErrors(scale * std, 0.0, 0.0, 0.002), 3.0)) == (scale < 1.0)


def test_a_bit_deeper_than_its_tubes_is_told_beyond_five_deviations() -> None:
    errors = DepthErrors(0.001, 0.01, 0.02, 0.005)
    reach = np.array([5.0, 10.0])
    for over, told in ((0.99, False), (1.01, True)):
        std = math.sqrt((0.001 * 10.22) ** 2 + 4 * 0.02**2 + 0.01**2 + 0.005**2)
        found = MakeUpDepths(np.array([2, 4]), np.array([3.0, 10.0 + over * 5.0 * std]), reach)
        text = misfit_of_depths(found, errors, 3.0)
        assert text.endswith("m with 4 tubes of 10.00 m: stick-up, depth or lengths are wrong") == told
    assert misfit_of_depths(MakeUpDepths(np.array([1]), np.array([9.0]), np.array([2.0])), errors, 3.0) == ""
