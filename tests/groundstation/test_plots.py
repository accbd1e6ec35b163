"""Figures: what is drawn, that it is drawn the same twice, and that a file is whole or not written."""

import functools
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure

from groundstation.errors import SurveyError
from groundstation.report import plots, plots_wall, style
from groundstation.report.plots_wall import band_of_thickness, joint_name, thinness_ranking
from groundstation.survey.files.survey_records import DisplacementRule, read_record
from groundstation.survey.fusion.fusion import POWERS, sequence_weights
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_deviation import PRESETS, ColumnDesign
from groundstation.survey.wall.column_joint import joint_thickness, probability_beyond
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.wall_joints import Joints, extra_column, judge_joints, neighbours_in_line, worst_joint
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions
from sim.studies.coverage.figure import coverage_figure
from sim.studies.region_of_uncertainty.figure import azimuth_error_figure, uncertainty_figure
from sim.studies.weighting.figure import weighting_figure

# thesis Table 4.1, the field record of a 20 m bore at Potsdam
POTSDAM = """md_m,b_cm,a_cm
0,0,0
2,0.1,-0.25
4,0.5,-1
6,0.75,-2
8,0.75,-3
10,1,-4.5
12,1.75,-5.75
14,2.75,-7.75
16,3,-9.25
18,2.25,-10.25
20,2,-11.75
"""
# thesis Table 4.5, cm at 2 sigma: b, a, TVD
PRINTED_RST = np.array([
    [0.028, 0.064, 2.1], [0.042, 0.096, 2.96], [0.026, 0.128, 3.64], [0.056, 0.16, 4.2], [0.062, 0.194, 4.7],
    [0.074, 0.23, 5.14], [0.088, 0.27, 5.54], [0.1, 0.314, 5.94], [0.106, 0.358, 6.3], [0.108, 0.37, 6.38],
])  # fmt: skip
UNIT = re.compile(r"\((m|cm|mm|deg|%|percentage points|-)\)")
INSTRUMENTS = ("rst-inclinometer", "vectornav-100t", "stim300", "ipst-rqh")


@pytest.fixture(scope="module")
def bore(tmp_path_factory: pytest.TempPathFactory) -> WellSurvey:
    file = tmp_path_factory.mktemp("record") / "potsdam.csv"
    file.write_text(POTSDAM)
    record = read_record(file, DisplacementRule.THESIS)
    place = station_positions(Method.BALANCED_TANGENTIAL, record.md, record.inclination, record.azimuth)
    return WellSurvey(record.md, record.inclination, record.azimuth, place[:, 2])


def covariances(bore: WellSurvey, name: str, *without: str) -> np.ndarray:
    return propagate_errors(bore, [Leg(load_tool(name).without(*without))], Site()).cov


def survey_of(bore: WellSurvey, design: ColumnDesign | None = None, name: str = "vectornav-100t") -> Figure:
    place = station_positions(Method.BALANCED_TANGENTIAL, bore.md, bore.inclination, bore.azimuth)
    return plots.survey_figure(bore.md, place, covariances(bore, name), 0.95, "Bore 1, Potsdam", design)


def uncertainty_of(bore: WellSurvey) -> Figure:
    found = {}
    for name in INSTRUMENTS:
        stds = 200.0 * np.sqrt(np.diagonal(covariances(bore, name), axis1=1, axis2=2))[1:]
        found[name] = (bore.md[1:], stds, PRINTED_RST if name == "rst-inclinometer" else None)
    return uncertainty_figure(found, "Uncertainty of bore 1", ("B", "A", "TVD"))


def azimuth_error_of(bore: WellSurvey) -> Figure:
    found = {}
    for name in INSTRUMENTS:
        lateral = [
            100.0 * np.sqrt(np.trace(cov[1:, :2, :2], axis1=1, axis2=2))
            for cov in (covariances(bore, name), 0.1 * covariances(bore, name))
        ]
        found[name] = (bore.md[1:], lateral[0], lateral[1])
    return azimuth_error_figure(found, 0.25, "Gyro terms or a filter, bore 1")


def weighting_of() -> Figure:
    changes = np.arange(0.5, 9.1, 0.5)
    jump = 100.0 * (np.sin(np.radians(1.0 + changes)) - np.sin(np.radians(1.0)))
    errors = {scheme.value: jump * (1.0 - sequence_weights(3, power)[-1]) for scheme, power in POWERS.items()}
    return weighting_figure(
        changes, errors, "inclination", "Station 2 at t4", {"linear": (np.array([2.0]), np.array([1.74]))}
    )


def coverage_of() -> Figure:
    claimed = np.array([0.1, 0.3, 0.5, 0.6827, 0.8, 0.9, 0.95, 0.99])
    off = np.array([0.01, -0.02, 0.015, 0.0, -0.01, 0.005, 0.004, 0.0])
    observed = {"relay": claimed + off, "too sure of itself": claimed - 0.12 * claimed * (1.0 - claimed) * 4.0}
    return coverage_figure(claimed, observed, 500, "Coverage of the regions")


@functools.cache
def made_wall(
    count: int = 12, lean: float = 0.35, spread: float = 0.02, short: int | None = None
) -> tuple[Columns, Joints]:
    """A wall to the east, 0.75 m apart; column 6 goes astray and ``short`` ends at 18 m."""
    depths = np.arange(0.0, 30.1, 0.5)
    rng = np.random.default_rng(7)
    heads = np.stack([np.zeros(count), 0.75 * np.arange(count)], axis=-1)
    leans = rng.normal(0.0, 0.05, (count, 2)) / 30.0
    leans[6] += np.array([0.1, lean]) / 30.0
    centres = heads[:, None] + leans[:, None] * depths[:, None]
    if short is not None:
        centres[short, depths > 18.0] = np.nan
    covs = np.einsum("z,ij->zij", (0.003 + spread * depths / 30.0) ** 2, np.diag([1.0, 1.5]))
    names = [f"P{k + 1:02d}" for k in range(count)]
    columns = Columns.surveyed(names, depths, centres, np.broadcast_to(covs, (count, *covs.shape)), heads, 0.6)
    return columns, judge_joints(columns, neighbours_in_line(count, closed=False), 0.8)


def wall_of(shade: str = "probability", **wall: Any) -> Figure:
    columns, found = made_wall(**wall)
    extra = extra_column(columns, found, worst_joint(found)[0], 0.8)
    return plots_wall.wall_figure(columns, found, 0.8, extra, "Wall A", shade=shade)


BUILDERS: dict[str, Callable[[WellSurvey], Figure]] = {
    "survey": survey_of,
    "survey_design": lambda bore: survey_of(bore, ColumnDesign("P01", length=20.0)),
    "uncertainty": uncertainty_of,
    "azimuth_error": azimuth_error_of,
    "weighting": lambda _: weighting_of(),
    "coverage": lambda _: coverage_of(),
    "wall": lambda _: wall_of(),
    "wall_thickness": lambda _: wall_of("thickness"),
    "wall_short": lambda _: wall_of(short=3),
    "wall_good": lambda _: wall_of(lean=0.0, spread=0.008),
}


def variants_in_study() -> list[Any]:
    """Every figure; of one that is drawn in several forms all but one in `make study`."""
    again = ("survey", "wall", "wall_thickness", "wall_good")
    return [pytest.param(name, marks=pytest.mark.statistical) if name in again else name for name in BUILDERS]


def drawn(axes: Axes, gid: str) -> list:
    return [artist for artist in axes.get_children() if artist.get_gid() == gid]


@pytest.mark.slow
@pytest.mark.parametrize("name", variants_in_study())
def test_a_figure_is_the_same_bytes_twice_and_has_no_date(name: str, bore: WellSurvey, tmp_path: Path) -> None:
    for suffix in (".png", ".svg") if name == "coverage" else (".svg",):
        files = [tmp_path / f"{k}{suffix}" for k in range(2)]
        for file in files:
            style.save_figure(BUILDERS[name](bore), file)
        first, second = (file.read_bytes() for file in files)
        assert len(first) > 10_000
        assert first == second
    assert b"<dc:date>" not in first


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "across", "up"),
    [
        ("survey_design", 4, 4),
        ("uncertainty", 1, 3),  # one depth for all panels
        ("azimuth_error", 2, 2),
        ("weighting", 2, 2),
        ("coverage", 2, 2),
        ("wall", 4, 4),  # joints have names; the colours a label of their own
    ],
)
def test_labels_say_what_is_shown_and_its_unit(name: str, across: int, up: int, bore: WellSurvey) -> None:
    axes = BUILDERS[name](bore).axes
    labels = [[a.get_xlabel() for a in axes if a.get_xlabel()], [a.get_ylabel() for a in axes if a.get_ylabel()]]
    assert [len(found) for found in labels] == [across, up]
    for label in (*labels[0], *labels[1]):
        assert UNIT.search(label), label


def visible_texts(figure: Figure) -> list[tuple[str, np.ndarray]]:
    """Texts and their boxes (x0, y0, x1, y1) in pixels as drawn."""
    from matplotlib.text import Text

    renderer = figure.canvas.get_renderer()
    found = []
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip() and (text.axes is None or text.axes.get_visible()):
            box = text.get_window_extent(renderer).extents
            if np.all(np.isfinite(box)):
                found.append((text.get_text(), box))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", variants_in_study())
def test_no_text_lies_on_another_or_beyond_the_page(name: str, bore: WellSurvey) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    figure = BUILDERS[name](bore)
    canvas = FigureCanvasAgg(figure)
    with matplotlib.rc_context(style.STYLE):
        canvas.draw()
    width, height = canvas.get_width_height()
    ticks = [label for axes in figure.axes for axis in (axes.xaxis, axes.yaxis) for label in hidden_ticks(axis)]
    texts = [(text, box) for text, box in visible_texts(figure) if not any(np.allclose(box, t) for t in ticks)]
    for k, (text, (x0, y0, x1, y1)) in enumerate(texts):
        assert x0 >= -1.0, text
        assert y0 >= -1.0, text
        assert x1 <= width + 1.0, text
        assert y1 <= height + 1.0, text
        for other, (u0, v0, u1, v1) in texts[:k]:
            assert min(x1, u1) - max(x0, u0) <= 1.0 or min(y1, v1) - max(y0, v0) <= 1.0, (text, other)


def hidden_ticks(axis: matplotlib.axis.Axis) -> list[np.ndarray]:
    """Boxes of tick labels that are outside the axis and hence not drawn."""
    low, high = sorted(axis.get_view_interval())
    edge = 1e-9 * (high - low)
    out = []
    for tick in [*axis.get_major_ticks(), *axis.get_minor_ticks()]:
        if not low - edge <= tick.get_loc() <= high + edge:
            out += [tick.label1.get_window_extent().extents, tick.label2.get_window_extent().extents]
    return out


def test_survey_figure_has_an_ellipse_for_every_station_below_the_collar_in_each_view(bore: WellSurvey) -> None:
    figure = survey_of(bore)
    plan, stds, north, east = figure.axes
    assert [len(drawn(axes, "ellipse")) for axes in (plan, north, east, stds)] == [10, 10, 10, 0]
    assert not drawn(plan, "tolerance")
    assert plan.get_aspect() == 1.0
    assert north.yaxis_inverted()
    assert east.yaxis_inverted()
    assert north.get_aspect() == east.get_aspect()


def test_the_plan_has_east_to_the_right_and_the_ellipse_its_size(bore: WellSurvey) -> None:
    place = np.array([[0.0, 0.0, 0.0], [0.1, 0.3, 10.0]])
    covs = np.zeros((2, 3, 3))
    covs[1] = np.diag([0.01, 0.04, 0.02]) ** 2
    figure = plots.survey_figure(np.array([0.0, 10.0]), place, covs, 0.95, "one leg")
    (ellipse,) = drawn(figure.axes[0], "ellipse")
    assert ellipse.get_xy().mean(axis=0) == pytest.approx([30.0, 10.0], abs=0.2)  # cm
    assert np.ptp(ellipse.get_xy(), axis=0) / 2.0 == pytest.approx(100.0 * 2.4477 * np.array([0.04, 0.01]), rel=1e-3)


@pytest.mark.slow
def test_exaggeration_in_the_label_is_that_of_the_drawing(bore: WellSurvey, tmp_path: Path) -> None:
    figure = survey_of(bore)
    style.save_figure(figure, tmp_path / "a.png")
    north = figure.axes[2]
    factor = float(re.search(r"exaggerated (\d+) times", north.get_xlabel())[1])
    across, down = (north.transData.transform(p) - north.transData.transform((0.0, 0.0)) for p in ((100.0, 0), (0, 1)))
    assert across[0] / abs(down[1]) == pytest.approx(factor)  # a metre is 100 of the unit across and 1 down


def test_ticks_of_a_logarithmic_axis_are_plain_short_numbers(bore: WellSurvey) -> None:
    axis = survey_of(bore).axes[1].yaxis
    assert [axis.get_major_formatter()(10.0**k) for k in (-5, -1, 0, 2)] == ["0.00001", "0.1", "1", "100"]
    assert axis.get_major_formatter()(9.999999999999999e-06) == "0.00001"


def test_toe_out_of_tolerance_is_the_only_strong_colour(bore: WellSurvey) -> None:
    def strong(design: ColumnDesign) -> bool:
        return any(line.get_color() == style.WRONG for line in survey_of(bore, design).axes[0].lines)

    assert strong(ColumnDesign(length=20.0, tolerance=PRESETS["en-12716"]))
    assert not strong(ColumnDesign(length=20.0, inclination=np.radians(1.65), azimuth=np.radians(255.0)))


def test_many_stations_keep_few_ellipses_and_the_last(bore: WellSurvey) -> None:
    md = np.linspace(0.0, 1000.0, 1001)
    inclination, azimuth = np.linspace(0.0, 1.2, 1001), np.full(1001, 0.7)
    place = station_positions(Method.MINIMUM_CURVATURE, md, inclination, azimuth)
    covs = np.einsum("n,ij->nij", (1e-3 * md) ** 2, np.eye(3))
    figure = plots.survey_figure(md, place, covs, 0.95, "long")
    ellipses = drawn(figure.axes[0], "ellipse")
    assert 50 <= len(ellipses) <= style.MOST_ELLIPSES
    assert ellipses[-1].get_xy().mean(axis=0) == pytest.approx(place[-1, 1::-1], abs=0.1)
    assert "exaggerated" not in figure.axes[2].get_xlabel()


def test_printed_values_are_dots_and_ours_lines(bore: WellSurvey) -> None:
    figure = uncertainty_of(bore)
    assert len(figure.axes) == 3
    for axes in figure.axes:
        dashed = [line for line in axes.lines if line.get_linestyle() == "--"]
        assert len(axes.lines) == len(INSTRUMENTS) + 1
        assert len(dashed) == 1
        assert dashed[0].get_marker() != "None"
        assert axes.get_yscale() == "log"


def test_weighting_reduces_by_the_share_of_the_newest_reading() -> None:
    remaining, reduction = weighting_of().axes
    by_name = {line.get_label(): k for k, line in enumerate(remaining.lines) if not line.get_label().startswith("_")}
    assert list(by_name) == ["equal", "linear", "quadratic", "cubic"]
    ratios = [1.0 - line.get_ydata()[0] / 100.0 for line in reduction.lines]
    assert ratios == pytest.approx([1.0, 0.75, 0.536, 0.375], abs=1e-3)  # thesis Fig. 4.35
    assert len(drawn(remaining, "published")) == 1
    with pytest.raises(SurveyError, match="scheme equal"):
        weighting_figure(np.ones(1), {"linear": np.ones(1)}, "inclination", "x")


@pytest.mark.parametrize("trials", [1, 20, 500])
def test_the_band_of_coverage_is_that_of_the_binomial_distribution(trials: int) -> None:
    from scipy.stats import binom

    counts = np.arange(trials + 1)
    for confidence in (0.05, 0.5, 0.9, 0.99):
        low, high = binom.ppf([0.025, 0.975], trials, confidence)
        axes = coverage_figure(
            np.full(trials + 1, confidence), {"all": counts / trials}, trials, "every count there is"
        ).axes[0]
        marked = np.round(drawn(axes, "outside")[0].get_ydata() * trials / 100.0)
        assert marked.tolist() == counts[(counts < low) | (counts > high)].tolist()


def test_coverage_marks_what_is_outside_the_band() -> None:
    for axes in coverage_of().axes:
        good, bad = (line.get_xdata() for line in drawn(axes, "outside"))
        assert len(good) == 0
        assert len(bad) >= 3
    with pytest.raises(SurveyError, match="confidences"):
        coverage_figure(np.array([1.0]), {"a": np.array([1.0])}, 10, "x")


def test_wall_figure_shows_the_worst_joint_its_columns_and_the_extra_one() -> None:
    columns, found = made_wall()
    joint, depth = worst_joint(found)
    assert joint_name(columns, found, joint) == "P06–P07"
    figure = wall_of()
    over_depth, shades, plan, zoom = figure.axes[:4]
    assert over_depth.lines[0].get_label() == "P06–P07"
    assert over_depth.lines[0].get_color() == style.WRONG
    ring = drawn(shades, "worst")[0]
    assert (ring.get_xdata()[0], ring.get_ydata()[0]) == (joint, columns.depths[depth])
    assert len(drawn(plan, "column")) == 12
    assert len(drawn(zoom, "column")) == len(drawn(zoom, "ellipse")) >= 2
    assert len(drawn(zoom, "extra")) == 1


@pytest.mark.parametrize("shade", ["probability", "thickness"])
def test_what_is_missing_is_red_in_every_panel(shade: str) -> None:
    columns, found = made_wall(lean=0.0, spread=0.0, short=3)
    joint, depth = worst_joint(found)
    assert (joint_name(columns, found, joint), columns.depths[depth]) == ("P03–P04", 18.5)
    _, shades, plan, zoom = wall_of(shade, lean=0.0, spread=0.0, short=3).axes[:4]
    assert "crossed: missing" in shades.get_title("left")
    cells = drawn(shades, "missing")
    assert [(cell.get_x(), cell.get_width()) for cell in cells] == [(1.5, 1.0), (2.5, 1.0)]
    assert all(cell.get_facecolor() == to_rgba(style.WRONG) for cell in cells)
    assert all(cell.get_y() + cell.get_height() == 30.0 for cell in cells)
    assert len(drawn(plan, "missing")) == len(drawn(zoom, "missing")) == 1
    assert "column missing" in zoom.get_title("left")


def test_what_is_not_surveyed_is_hatched() -> None:
    columns, _ = made_wall(lean=0.0, spread=0.0)
    states = columns.states.copy()
    states[5, columns.depths > 20.0] = ColumnState.UNSURVEYED
    columns = replace(columns, states=states)
    found = judge_joints(columns, neighbours_in_line(12, closed=False), 0.8)
    shades = plots_wall.wall_figure(columns, found, 0.8, None, "Wall A").axes[1]
    assert len(drawn(shades, "unsurveyed")) == 2
    assert "hatched: not surveyed" in shades.get_title("left")


def test_a_good_wall_is_grey() -> None:
    figure = wall_of(lean=0.0, spread=0.0)
    assert all(line.get_color() != style.WRONG for axes in figure.axes for line in axes.lines)
    assert not drawn(figure.axes[3], "extra")


def test_band_of_thickness_holds_its_share_of_sampled_walls() -> None:
    columns, found = made_wall()
    joint, depth = worst_joint(found)
    a, b = found.pairs[joint]
    rng = np.random.default_rng(1)
    cov = columns.covs[a, depth] + columns.covs[b, depth]
    apart = (columns.centres[b] - columns.centres[a])[depth] + rng.multivariate_normal(np.zeros(2), cov, 40_000)
    thick = joint_thickness(np.hypot(*apart.T), 0.6)
    low, high = (joint_thickness(d, 0.6)[depth] for d in band_of_thickness(columns, found, joint))
    assert np.mean((thick > low) & (thick < high)) == pytest.approx(0.95, abs=0.006)
    assert thinness_ranking(found)[0] == joint
    limit = 2.0 * np.sqrt(0.6**2 - 0.4**2)
    assert found.probability[joint, depth] == pytest.approx(
        probability_beyond((columns.centres[b] - columns.centres[a])[depth], cov, limit)
    )


def test_wall_figure_refuses_options_that_are_none() -> None:
    columns, found = made_wall()
    with pytest.raises(SurveyError, match="probability, thickness"):
        plots_wall.wall_figure(columns, found, 0.8, None, "x", shade="colour")
    with pytest.raises(SurveyError, match="allowed in"):
        plots_wall.wall_figure(columns, found, 0.8, None, "x", allowed=0.7)


def test_survey_figure_refuses_arrays_that_do_not_fit() -> None:
    with pytest.raises(SurveyError, match=r"expected \(n,\), \(n, 3\)"):
        plots.survey_figure(np.arange(3.0), np.zeros((2, 3)), np.zeros((3, 3, 3)), 0.95, "x")


def test_save_is_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    figure = coverage_of()
    file = tmp_path / "plot.svg"
    style.save_figure(figure, file)
    good = file.read_bytes()
    assert [p.name for p in tmp_path.iterdir()] == ["plot.svg"]

    def breaks(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(figure, "savefig", breaks)
    with pytest.raises(SurveyError, match=r"plot\.svg: No space left"):
        style.save_figure(figure, file)
    assert file.read_bytes() == good
    assert [p.name for p in tmp_path.iterdir()] == ["plot.svg"]


@pytest.mark.parametrize("name", ["plot.bmp", "plot", "plot.csv"])
def test_an_unknown_suffix_names_the_known_and_leaves_the_old_file(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("old")
    with pytest.raises(SurveyError, match=r"expected one of \.pdf, \.png, \.svg"):
        style.save_figure(coverage_of(), tmp_path / name)
    assert (tmp_path / name).read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == [name]


@pytest.mark.slow
def test_pdf_is_the_same_bytes_twice_and_a_missing_folder_is_named(tmp_path: Path) -> None:
    for name in ("a.pdf", "b.PDF"):
        style.save_figure(weighting_of(), tmp_path / name)
    assert (tmp_path / "a.pdf").read_bytes() == (tmp_path / "b.PDF").read_bytes()
    with pytest.raises(SurveyError, match=r"nowhere.*expected a folder"):
        style.save_figure(weighting_of(), tmp_path / "nowhere" / "a.pdf")
