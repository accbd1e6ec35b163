"""Sheets and figures of calibrations from numbers that all differ: every cell and every line that is drawn."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from groundstation.calibration.allan_analysis import AllanReading, AllanResult
from groundstation.calibration.allan_fit import AllanFit, Estimate
from groundstation.calibration.applied_series import AppliedSeries
from groundstation.calibration.attitudes import AttitudeFit
from groundstation.calibration.bias_model import FilterNoise
from groundstation.calibration.mwd_model import Triad
from groundstation.calibration.mwd_solve import MwdErrors, MwdFit
from groundstation.calibration.quality import QualityReport, QualityVerdict
from groundstation.report.calibration_plots import (
    allan_panels,
    linear_panels,
    quality_panels,
    series_panels,
    triad_panels,
)
from groundstation.report.calibration_sheets import (
    AttitudeErrors,
    TriadErrors,
    allan_sheet,
    linear_sheet,
    quality_sheet,
    triad_sheet,
)
from groundstation.report.figure_panels import Panel

MINUS = "\N{MINUS SIGN}"
T_95 = {5: 2.5705818}  # Student's t at 0.975


def drawn(panel: Panel) -> list[Any]:
    """The axes of a panel."""
    figure = Figure()
    FigureCanvasAgg(figure)
    panel.draw(figure)
    return list(figure.axes)


def lines_of(axes: Any) -> list[tuple[list[float], list[float]]]:
    return [(list(map(float, line.get_xdata())), list(map(float, line.get_ydata()))) for line in axes.lines]


MATRIX = np.array([[1.01, 0.02, 0.03], [0.04, 1.05, 0.06], [0.07, 0.08, 1.09]])
STDS = np.arange(1.0, 13.0) * 1e-3  # bias x, y, z, then the matrix row by row
RESIDUALS = np.array([[0.1, -0.2, 0.3], [-0.4, 0.5, -0.6]])
FIT = AttitudeFit(
    MATRIX, np.array([0.11, -0.12, 0.13]), np.diag(STDS**2), RESIDUALS, 1.2345, 4, np.array([3.0, 12.0]), degrees=5
)
AT = AttitudeErrors(("flat", "steep"), "deg/s", np.array([2.0, 3.0]), np.array([0.2, 0.4]))


def test_of_a_linear_calibration_every_cell() -> None:
    sheet = linear_sheet("Calibration", FIT, AT, ", m,", [("Method", "by hand")])
    matrix, errors, wide, rows = sheet.tables
    assert [*map(tuple, matrix.rows)] == [
        ("x", "1.010000", "0.02000000", "0.03000000", "0.1100000"),
        ("y", "0.04000000", "1.050000", "0.06000000", "\N{MINUS SIGN}0.1200000"),
        ("z", "0.07000000", "0.08000000", "1.090000", "0.1300000"),
    ]
    stds = {"x": (4, 5, 6, 1), "y": (7, 8, 9, 2), "z": (10, 11, 12, 3)}  # thousandths; the bias stands last
    for table, factor in ((errors, 1.0), (wide, T_95[5])):
        for axis, *cells in table.rows:
            assert [float(cell) for cell in cells] == pytest.approx([1e-3 * factor * n for n in stds[axis]], rel=6e-3)
    assert wide.title == "Expanded uncertainty, 95 %: 2.57 standard errors"
    assert [*map(tuple, rows.rows)] == [
        ("flat", "0.100", "\N{MINUS SIGN}0.200", "0.300", "3.0", "2.00", "0.200"),
        ("steep", "\N{MINUS SIGN}0.400", "0.500", "\N{MINUS SIGN}0.600", "12.0", "3.00", "0.400"),
    ]
    rms = math.sqrt(sum(n * n for n in range(1, 7)) / 6.0) / 10.0
    assert sheet.facts == (
        ("Method", "by hand"),
        ("Residual rms", f"{rms:.4f} deg/s"),
        ("Degrees of freedom", "5 for each axis"),
        ("Design", "2 attitudes, rank 4 of 4, condition 1.234"),
    )
    (warning,) = sheet.warnings
    assert "attitude steep moves a parameter by up to 12 units" in warning


@pytest.mark.parametrize(("lever", "count"), [(10.0, 0), (10.1, 1)])
def test_a_lever_warns_beyond_ten(lever: float, count: int) -> None:
    fit = AttitudeFit(MATRIX, FIT.bias, FIT.cov, RESIDUALS, 1.0, 4, np.array([lever, 3.0]))
    sheet = linear_sheet("", fit, AT, "", [])
    assert len(sheet.warnings) == count
    assert dict(sheet.facts)["Degrees of freedom"] == "of known covariances"


def test_residuals_and_errors_are_drawn_where_they_are() -> None:
    first, second = linear_panels(FIT, AT)
    assert (first.caption, second.caption) == ("Residuals at each attitude", "Errors before and after")
    (axes,) = drawn(first)
    zero, *axis_lines = lines_of(axes)
    assert zero[1] == [0.0, 0.0]
    for k, (x, y) in enumerate(axis_lines):
        assert x == pytest.approx([1.0 + 0.12 * (k - 1), 2.0 + 0.12 * (k - 1)])
        assert y == RESIDUALS[:, k].tolist()
    assert [text.get_text() for text in axes.get_legend().get_texts()][1:] == ["x", "y", "z"]
    assert "rms 0.389 deg/s" in axes.get_legend().get_texts()[0].get_text()
    band = axes.patches[0].get_extents().transformed(axes.transData.inverted())
    assert (band.y0, band.y1) == pytest.approx((-0.38944, 0.38944), rel=1e-4)
    (axes,) = drawn(second)
    assert lines_of(axes) == [([1.0, 2.0], [2.0, 3.0]), ([1.0, 2.0], [0.2, 0.4])]
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["before", "after"]
    assert [text.get_text() for text in axes.get_xticklabels()] == ["flat", "steep"]


def triad(axes: str, parameters: int) -> tuple[MwdFit, dict[str, float]]:
    powers = range(1 if parameters == 12 else 4)
    scale, bias = np.zeros((3, 4)), np.zeros((3, 4))
    coefficients: dict[str, float] = {}
    for i, axis in enumerate(axes):
        for p in powers:
            scale[i, p], bias[i, p] = (2.0 + 0.1 * i) * 10.0 ** (-2 * p), (0.01 + 0.002 * i) * 10.0 ** (-2 * p)
            coefficients[f"SF_{axis}{p}"], coefficients[f"B_{axis}{p}"] = scale[i, p], bias[i, p]
    for k, pair in enumerate(("01", "02", "10", "12", "20", "21")):
        coefficients[f"m_{axes[int(pair[0])]}{axes[int(pair[1])]}"] = -1e-3 * (k + 1)
    fit = MwdFit(
        Triad(axes, scale, bias, np.zeros(6)), parameters, 7, 0.01234, coefficients,
        {name: 0.1 * abs(value) for name, value in coefficients.items()},
        MwdErrors(0.5, 0.25, math.radians(2.0), math.radians(1.0)),
        MwdErrors(0.05, 0.025, math.radians(0.2), math.radians(0.1)),
        0.0061, math.radians(0.37), (21.0, 77.0), ("warned",),
    )  # fmt: skip
    return fit, coefficients


@pytest.mark.parametrize(("axes", "unit", "angle"), [("ABC", "g", "tilt"), ("XYZ", "µT", "dip")])
@pytest.mark.parametrize(("parameters", "powers"), [(12, 1), (30, 4)])
def test_of_a_triad_every_cell(axes: str, unit: str, angle: str, parameters: int, powers: int) -> None:
    fit, coefficients = triad(axes, parameters)
    sheet = triad_sheet("Triad", fit, [("Record", "one")])
    errors, values, stds, crossed = sheet.tables
    assert list(errors.columns) == ["", f"size, largest, {unit}", "rms", f"{angle}, largest, deg", "rms"]
    assert [*map(tuple, errors.rows)] == [
        ("before", "0.500", "0.250", "2.00", "1.00"),
        ("after", "0.0500", "0.0250", "0.200", "0.100"),
    ]
    names = [f"{kind}_{axis}" for kind in ("SF", "B") for axis in axes]
    for table, factor in ((values, 1.0), (stds, 0.1)):
        assert len(table.columns) == 1 + powers
        assert [row[0] for row in table.rows] == names
        for name, *cells in table.rows:
            wanted = [factor * coefficients[f"{name}{p}"] for p in range(powers)]
            assert [float(cell.replace(MINUS, "-")) for cell in cells] == pytest.approx(
                wanted, rel=0.05 if factor < 1.0 else 1e-5
            )
    assert [*map(tuple, crossed.rows)][1] == (f"m_{axes[0]}{axes[2]}", "\N{MINUS SIGN}2.0000", "0.2000")
    assert len(crossed.rows) == 6
    facts = dict(sheet.facts)
    assert facts["Temperature"] == "21.00 to 77.00 °C"
    assert facts["Largest error elsewhere"] == f"0.0061 {unit} and 0.37 deg, one standard deviation"
    assert facts["Search"] == "7 iterations, E = 0.01234"
    assert sheet.warnings == ("warned",)


@pytest.mark.parametrize(("axes", "small"), [("ABC", 1e-3), ("XYZ", 1.0)])
def test_errors_and_curves_of_a_triad_are_drawn_where_they_are(axes: str, small: float) -> None:
    fit, _ = triad(axes, 30)
    before = TriadErrors(np.array([0.4, -0.2, 0.3]), np.array([5.0, 6.0, -7.0]))
    after = TriadErrors(np.array([0.01, -0.02, 0.03]), np.array([0.1, -0.2, 0.3]))
    warm = np.array([20.0, 50.0, 80.0])
    panels = triad_panels(fit, ("tool face, deg", np.array([0.0, 100.0, 300.0])), warm, before, after, 2.0)
    first, second = drawn(panels[0])
    assert lines_of(first) == [([1.0, 2.0, 3.0], [0.4, 0.2, 0.3]), ([1.0, 2.0, 3.0], [0.01, 0.02, 0.03])]
    assert lines_of(second) == [([1.0, 2.0, 3.0], [5.0, 6.0, 7.0]), ([1.0, 2.0, 3.0], [0.1, 0.2, 0.3])]
    size, angle, *_ = drawn(panels[1])
    for part, values in ((size, after.size / small), (angle, after.angle)):
        dots = part.collections[0]
        assert dots.get_offsets().tolist() == [
            [x, pytest.approx(y)] for x, y in zip((0.0, 100.0, 300.0), values, strict=True)
        ]
        assert dots.get_array().tolist() == warm.tolist()
    scale, bias = drawn(panels[2])
    for k in range(3):
        t, off = lines_of(scale)[k]
        assert (t[0], t[-1], len(t)) == (21.0, 77.0, 200)
        for i in (0, 199):
            powers = [(t[i] - 30.0) ** p for p in range(4)]
            value = sum((2.0 + 0.1 * k) * 10.0 ** (-2 * p) * powers[p] for p in range(4))
            assert off[i] == pytest.approx(100.0 * (value / 2.0 - 1.0))
            value = sum((0.01 + 0.002 * k) * 10.0 ** (-2 * p) * powers[p] for p in range(4))
            assert lines_of(bias)[k][1][i] == pytest.approx(value / small)
    plain, _ = triad(axes, 12)
    assert len(triad_panels(plain, ("tilt", warm), warm, before, after, 2.0)) == 2


FACES = np.radians(np.array([0.0, 90.0, 200.0]))
QUALITY = QualityReport(
    FACES, np.radians(np.array([10.0, 10.2, 10.6])), np.radians(np.array([359.0, 0.0, 3.0])),
    np.array([1.0, 1.001, 1.004]),
    (
        QualityVerdict("inclination", "rad", math.radians(0.6), math.radians(0.5)),
        QualityVerdict("azimuth", "rad", math.radians(4.0), math.radians(8.0)),
        QualityVerdict("G_L", "g", 0.004, 0.005),
    ),
)  # fmt: skip


def test_of_a_quality_control_every_cell_and_every_line() -> None:
    sheet = quality_sheet(QUALITY, [("Record", "one")])
    assert sheet.facts == (("Verdict", "FAIL"), ("Record", "one"))
    verdicts, rows = sheet.tables
    assert [*map(tuple, verdicts.rows)] == [
        ("inclination", "0.600", "0.500", "deg", "FAIL"),
        ("azimuth", "4.00", "8.00", "deg", "pass"),
        ("G_L", "0.00400", "0.00500", "g", "pass"),
    ]
    assert [*map(tuple, rows.rows)] == [
        ("0.00", "10.0000", "359.000", "1.00000"),
        ("90.00", "10.2000", "0.000", "1.00100"),
        ("200.00", "10.6000", "3.000", "1.00400"),
    ]
    inclination, azimuth, size = drawn(quality_panels(QUALITY)[0])
    for axes, limit, values, title in (
        (inclination, 0.5, [-0.3, -0.1, 0.3], "FAIL: 0.6 of 0.5 deg"),
        (azimuth, 8.0, [-2.0, -1.0, 2.0], "pass: 4 of 8 deg"),
        (size, 5.0, [-2.0, -1.0, 2.0], "pass: 4 of 5 mg"),
    ):
        low, high, (x, y) = lines_of(axes)
        assert (low[1][0], high[1][0]) == pytest.approx((-limit / 2.0, limit / 2.0))
        assert x == pytest.approx([0.0, 90.0, 200.0])
        assert y == pytest.approx(values)
        assert axes.get_title() == title
    assert inclination.get_ylabel() == "inclination \N{MINUS SIGN} 10.30, deg"
    assert azimuth.get_ylabel() == "azimuth \N{MINUS SIGN} 1.00, deg"
    assert size.get_ylabel() == "G_L \N{MINUS SIGN} 1002.00, mg"
    assert size.get_ylim() == pytest.approx((-4.0, 4.0))  # 1.6 of the limit
    assert inclination.get_ylim() == pytest.approx((-0.48, 0.48))  # 1.6 of the spread, which is the larger


def allan(number: int, walk: float | None, chi2: float) -> AllanResult:
    n, f = 0.1 * number, 0.01 * number
    estimate = None if walk is None else Estimate(walk, 0.0, 0.0, 0.0)
    fit = AllanFit(Estimate(n, 0.0, 0.9 * n, 1.2 * n), Estimate(f, 0.0, 0.8 * f, 1.3 * f), estimate, chi2, 8, 0.0)
    return AllanResult(
        np.array([0.1, 1.0, 30.0]), np.array([3.0, 2.0, 1.0]) * n, np.array([0.01, 0.02, 2.0]), fit,
        AllanReading(1.0, 2.0 * n, 0.02), AllanReading(30.0, 1.1 * n, 0.25),
    )  # fmt: skip


def test_of_an_allan_deviation_every_cell_and_every_line() -> None:
    results = [allan(1, 0.003, 19.9), allan(2, None, 20.0), allan(3, None, 20.1)]
    noises = [FilterNoise(0.1, 0.02, 30.0), FilterNoise(0.2, 0.03, 40.0, is_bound=True), FilterNoise(0.3, 0.04, 50.0)]
    drifts: list[list[dict[str, Any]]] = [
        [{"predicted": 1.0 + 10 * k + i, "seen": None if i == 2 else 2.0 + 10 * k + i} for i in range(3)]
        for k in range(3)
    ]
    sheet = allan_sheet(results, noises, drifts, "deg/s", [])
    terms, raw, taken, drifted = sheet.tables
    assert [*map(tuple, terms.rows)] == [
        ("x", "0.1000", "0.09000", "0.1200", "0.01000", "0.008000", "0.01300", "0.00300"),
        ("y", "0.2000", "0.1800", "0.2400", "0.02000", "0.01600", "0.02600", ""),
        ("z", "0.3000", "0.2700", "0.3600", "0.03000", "0.02400", "0.03900", ""),
    ]
    assert [*map(tuple, raw.rows)] == [
        ("x", "0.2000", "2 %", "30.00", "0.1100", "25 %"),
        ("y", "0.4000", "2 %", "30.00", "0.2200", "25 %"),
        ("z", "0.6000", "2 %", "30.00", "0.3300", "25 %"),
    ]
    assert [*map(tuple, taken.rows)] == [
        ("x", "0.1000", "0.02000", "30.00", ""),
        ("y", "0.2000", "0.03000", "40.00", "at most, none is seen"),
        ("z", "0.3000", "0.04000", "50.00", ""),
    ]
    assert tuple(drifted.rows[1]) == ("y", "11.0", "12.0", "12.0", "13.0", "13.0", "")
    assert list(drifted.columns) == ["axis", "in 60 s", "seen", "in 300 s", "seen", "in 900 s", "seen"]
    assert drifted.title == "Drift after 60 s at rest, deg"
    (warning,) = sheet.warnings  # chi^2 of 8 + 3 * 4 is still consistent
    assert warning.startswith("axis z: the curve is not of the fitted shape, chi^2 20 of 8 degrees")
    for k, axes in enumerate(drawn(allan_panels(results, "deg/s")[0])):
        number, walk = k + 1, (0.003, 0.0, 0.0)[k]
        curve, (tau, model), point, floor = lines_of(axes)
        assert curve == ([0.1, 1.0, 30.0], pytest.approx([0.3 * number, 0.2 * number, 0.1 * number]))
        assert (tau[0], tau[-1]) == pytest.approx((0.1, 9.0))  # to where ten clusters are left of three
        wanted = [math.sqrt((0.1 * number) ** 2 / t + (0.01 * number) ** 2 + walk**2 * t / 3.0) for t in tau]
        assert model == pytest.approx(wanted)
        assert point == ([1.0], [pytest.approx(0.1 * number)])
        assert floor[1][0] == pytest.approx(0.01 * number)
        band = axes.collections[0].get_paths()[0].vertices
        assert band[:, 1].max() == pytest.approx(0.303 * number)  # 1 % above the highest, 0.3 above the lowest
        assert band[:, 1].min() == pytest.approx(0.01 * number)  # a tenth of the curve at least


def test_a_series_is_drawn_axis_by_axis_before_and_after() -> None:
    times = np.array([0.0, 1.0])
    before, after = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]), np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]])
    panels = series_panels(
        [AppliedSeries("gyroscope", times, before, after), AppliedSeries("accelerometer", times, after, before)]
    )
    assert [panel.caption for panel in panels] == ["Gyroscope in time", "Accelerometer in time"]
    for panel, one, other in zip(panels, (before, after), (after, before), strict=True):
        for k, axes in enumerate(drawn(panel)):
            assert lines_of(axes) == [([0.0, 1.0], one[:, k].tolist()), ([0.0, 1.0], other[:, k].tolist())]
            assert axes.get_ylabel().startswith(f"{'xyz'[k]}, ")
