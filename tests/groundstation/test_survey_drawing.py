"""The figure of a survey in print, measured: every point and ellipse where it belongs, of the size that it has."""

from __future__ import annotations

import math

import matplotlib.pyplot as plt
import numpy as np
import pytest
from matplotlib.axes import Axes

from groundstation.report.plots import survey_figure
from groundstation.survey.wall.column_deviation import PRESETS, ColumnDesign

MD = np.array([0.0, 4.0, 8.0, 12.0])
POSITIONS = np.array([[0.0, 0.0, 0.0], [0.05, 0.01, 4.0], [0.16, 0.07, 7.9], [0.20, 0.18, 11.8]])
SIGMA = math.sqrt(-2.0 * math.log(1.0 - 0.95))  # to the ellipse that holds 95 % of a plane


def covariances() -> np.ndarray:
    """Regions that lean, each another; none at the collar."""
    made = np.zeros((4, 3, 3))
    for k in range(1, 4):
        root = np.array([[0.02 * k, 0.0, 0.0], [0.012 * k, 0.008 * k, 0.0], [0.003, 0.004, 0.03 * k]])
        made[k] = root @ root.T
    return made


def panels(design: ColumnDesign | None = None) -> list[Axes]:
    """Plan, deviations, section north, section east."""
    figure = survey_figure(MD, POSITIONS, covariances(), 0.95, "by hand", design)
    plt.close(figure)
    return list(figure.axes[:4])


def unit_of(label: str) -> float:
    """What a metre is in the unit that an axis names."""
    return {"m": 1.0, "cm": 100.0, "mm": 1000.0}[label.partition("(")[2].partition(")")[0]]


def hole_of(axes: Axes) -> np.ndarray:
    return np.array(axes.lines[0].get_data()).T


def ellipses_of(axes: Axes) -> list[np.ndarray]:
    return [patch.get_path().vertices[:-1] for patch in axes.patches if patch.get_gid() == "ellipse"]


def test_the_plan_has_east_to_the_right_and_north_up() -> None:
    plan = panels()[0]
    across, up = unit_of(plan.get_xlabel()), unit_of(plan.get_ylabel())
    assert plan.get_xlabel().startswith("East")
    np.testing.assert_allclose(hole_of(plan), POSITIONS[:, 1::-1] * [across, up])
    assert plan.get_xlim()[0] < plan.get_xlim()[1]
    assert plan.get_ylim()[0] < plan.get_ylim()[1]


@pytest.mark.parametrize(("panel", "pair"), [(0, (1, 0)), (2, (0, 2)), (3, (1, 2))])
def test_every_ellipse_is_that_of_its_covariance(panel: int, pair: tuple[int, int]) -> None:
    """Each point of it is as many standard deviations off as the region has: x C^-1 x = sigma^2, in metres."""
    axes = panels()[panel]
    units = np.array([unit_of(axes.get_xlabel()), unit_of(axes.get_ylabel())])
    outlines = ellipses_of(axes)
    assert len(outlines) == 3
    for k, outline in enumerate(outlines, 1):
        off = outline / units - POSITIONS[k, list(pair)]
        cov = covariances()[k][np.ix_(pair, pair)]
        squares = np.einsum("ni,ij,nj->n", off, np.linalg.inv(cov), off)
        np.testing.assert_allclose(np.sqrt(squares), SIGMA, rtol=1e-6)


@pytest.mark.parametrize(("panel", "axis", "name"), [(2, 0, "North"), (3, 1, "East")])
def test_a_section_has_the_depth_downwards(panel: int, axis: int, name: str) -> None:
    axes = panels()[panel]
    assert axes.get_xlabel().startswith(name)
    np.testing.assert_allclose(hole_of(axes), POSITIONS[:, [axis, 2]] * [unit_of(axes.get_xlabel()), 1.0])
    assert axes.get_ylim()[0] > axes.get_ylim()[1]
    assert axes.get_xlim()[0] < axes.get_xlim()[1]


def test_the_deviations_are_roots_of_the_variances_over_the_measured_depth() -> None:
    stds = panels()[1]
    scale = unit_of(stds.get_ylabel())
    by_name = {line.get_label(): line for line in stds.lines}
    for axis, name in enumerate(("north", "east", "TVD")):
        expected = scale * np.sqrt(covariances()[1:, axis, axis])
        np.testing.assert_allclose(by_name[name].get_xdata()[1:], MD[1:])
        np.testing.assert_allclose(by_name[name].get_ydata()[1:], expected)


@pytest.mark.parametrize(("panel", "axis"), [(2, 0), (3, 1)])
def test_the_tolerance_stands_on_both_sides_of_the_axis(panel: int, axis: int) -> None:
    design = ColumnDesign("P01", length=12.0, tolerance=PRESETS["en-12716"])
    axes = panels(design)[panel]
    scale = unit_of(axes.get_xlabel())
    edges = [np.array(line.get_data()) for line in axes.lines if line.get_linestyle() == "--"]
    assert len(edges) == 2
    for sign, (x, depth) in zip((-1.0, 1.0), sorted(edges, key=lambda edge: edge[0][-1]), strict=True):
        np.testing.assert_allclose(x / scale, sign * (0.05 + 0.02 * depth), atol=1e-9)
    assert axis in (0, 1)
