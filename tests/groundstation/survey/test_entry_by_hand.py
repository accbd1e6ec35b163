"""What is entered, at its bounds; and what two small models of a hole say, by closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import integrate, stats

from groundstation.entry.quantity_ranges import RANGES
from groundstation.entry.station_plausibility import (
    departing_holes,
    design_warnings,
    radius_warnings,
    station_warnings,
)
from groundstation.errors import SurveyError
from groundstation.survey.adjustment import bends_among_holes as bends_room
from groundstation.survey.files.instrument_columns import instrument_column
from groundstation.survey.wall.wall_plausibility import _depths, _overlaps, _touches
from groundstation.survey.well.north_swing import inward_covs, inward_std
from telemetry.bounded_bytes import bounded_bytes, bounded_text

BY_HAND = {
    "azimuth_deg": (-720, 720, "deg"), "inclination_deg": (0, 180, "deg"), "declination_deg": (-180, 180, "deg"),
    "convergence_deg": (-180, 180, "deg"), "north_of_site_deg": (-360, 360, "deg"),
    "section_azimuth_deg": (-720, 720, "deg"), "gravity": (9, 10.5, "m/s^2"), "field_nt": (15_000, 75_000, "nT"),
    "dip_deg": (-90, 90, "deg"), "latitude_deg": (-90, 90, "deg"), "longitude_deg": (-180, 360, "deg"),
    "height_m": (-1000, 10_000, "m"), "coordinate": (-1e8, 1e8, "m"), "distance": (-1e6, 1e6, "m"),
    "depth": (-1e5, 1e5, "m"), "depth_rate": (0.001, 5, "m/s"), "depth_gap": (0.1, 600, "s"),
    "survey_after": (5, 3600, "s"), "stale_after": (1, 600, "s"), "station_tolerance": (0.001, 1, "m"),
}  # fmt: skip


def test_every_quantity_has_its_range_and_both_ends_of_it() -> None:
    assert set(RANGES) == set(BY_HAND)
    for name, (low, high, unit) in BY_HAND.items():
        for value in (low, high, 0.5 * (low + high)):
            assert RANGES[name].check("file", value) == value
        beyond = 1e-6 * (high - low)
        for value in (low - beyond, high + beyond, math.nan, math.inf):
            with pytest.raises(
                SurveyError, match=rf"^file: expected .* of {low:g}\.\.{high:g} ".replace("+", r"\+")
            ) as no:
                RANGES[name].check("file", value)
            assert f" {unit}, got " in str(no.value)


def test_a_file_may_be_exactly_as_large_as_it_may(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("0123456789")
    assert bounded_bytes(tmp_path / "a", 10) == b"0123456789"
    assert bounded_text(tmp_path / "a") == "0123456789"
    (tmp_path / "a").write_text("0123456789x")
    with pytest.raises(OSError, match="larger than 0 MiB"):
        bounded_bytes(tmp_path / "a", 10)


def warned(md: list[float], inclination_deg: list[float], azimuth_deg: list[float] | None = None) -> list[Any]:
    azimuth = np.radians(azimuth_deg or [0.0] * len(md))
    found = station_warnings(np.array(md), np.radians(inclination_deg), azimuth, "hole A")
    return [(one.kind, one.what, one.top, one.bottom, one.text) for one in found]


def test_a_hole_bends_by_two_degrees_and_one_a_metre() -> None:
    assert warned([0.0, 1.0, 4.0], [10.0, 12.99, 17.98]) == []
    assert warned([0.0, 1.0, 4.0], [10.0, 13.01, 14.0]) == [
        ("dogleg", "hole A", 0.0, 1.0,
         "hole A: a dogleg of 3.0 deg from 0 to 1 m, 90 deg in 30 m; expected at most 2 deg and 1 deg a metre"),
    ]  # fmt: skip
    (found,) = warned([0.0, 1.0, 4.0], [10.0, 12.0, 6.98])
    assert found[2:4] == (1.0, 4.0)
    # 60 deg of azimuth at 3 deg of inclination are 3 deg of direction, and at 90 deg all of them
    assert warned([0.0, 1.0], [2.9, 2.9], [0.0, 60.0]) == []
    assert warned([0.0, 1.0], [90.0, 90.0], [359.0, 1.5]) == []
    assert len(warned([0.0, 1.0], [90.0, 90.0], [359.0, 3.0])) == 1


def test_a_station_stands_alone_by_five_degrees_and_three_times_what_its_neighbours_differ_by() -> None:
    md = [0.0, 10.0, 20.0, 30.0]
    assert warned(md, [0.0, 4.99, 0.0, 0.0]) == []
    assert warned(md, [0.0, 5.01, 0.0, 0.0]) == [
        ("spike", "hole A", 0.0, 20.0,
         "hole A: the station at 10 m departs by 5.0 and 5.0 deg from its neighbours, which differ by 0.0: "
         "inclination 5.01 deg, azimuth 0 deg"),
    ]  # fmt: skip
    assert warned(md, [10.0, 18.99, 11.0, 11.0]) == []
    assert [one[0] for one in warned(md, [10.0, 19.01, 11.0, 11.0])] == ["spike"]
    # 40 deg out and back again is one mistake, not three; a bend elsewhere is told besides
    assert [one[:4] for one in warned([*md, 31.0], [0.0, 40.0, 0.0, 0.0, 4.0])] == [
        ("spike", "hole A", 0.0, 20.0), ("dogleg", "hole A", 30.0, 31.0),
    ]  # fmt: skip


def test_holes_side_by_side_are_not_one_hole() -> None:
    md = np.array([0.0, 10.0, 20.0, 0.0, 10.0, 20.0, 0.0, 1.0])
    hole = np.array([4, 4, 4, 7, 7, 7, 9, 9])
    straight = np.radians([0.0, 0.0, 0.0, 40.0, 40.0, 40.0, 0.0, 0.0])
    assert departing_holes(md, straight, np.zeros(8), hole) == set()
    spike, sharp = straight.copy(), straight.copy()
    spike[4] = math.radians(46.0)
    assert departing_holes(md, spike, np.zeros(8), hole) == {7}
    sharp[7] = math.radians(3.5)
    assert departing_holes(md, sharp, np.zeros(8), hole) == {9}


@pytest.mark.parametrize(("degrees", "count"), [(2.99, 0), (3.01, 1)])
def test_a_design_bends_by_three_degrees_a_metre(degrees: float, count: int) -> None:
    angles = np.radians([0.0, 2.0, 2.0 + 2.0 * degrees, 6.0 + 2.0 * degrees])
    tangents = np.column_stack([np.sin(angles), np.zeros(4), np.cos(angles)])
    found = design_warnings(np.array([0.0, 1.0, 3.0, 5.0]), tangents, "B")
    assert [(one.kind, one.top, one.bottom) for one in found] == [("dogleg", 1.0, 3.0)] * count
    assert radius_warnings(3.0, "B") == ()
    assert [one.text for one in radius_warnings(3.01, "B")] == ["B: a radius of 3.01 m; expected at most 3 m"]


PLAN = SimpleNamespace(design=SimpleNamespace(name="C1", length=10.0), drilled=None)


@pytest.mark.parametrize(("end", "count"), [(20.0, 0), (20.01, 1)])
def test_a_hole_is_surveyed_and_drilled_to_one_and_a_half_lengths_and_five_metres(end: float, count: int) -> None:
    plan: Any = PLAN
    hole: Any = SimpleNamespace(md=np.array([0.0, end]))
    words = f"to {end:g} m; it is designed to 10 m"
    assert [one.text for one in _depths(plan, hole)] == [f"column C1: surveyed {words}"] * count
    drilled: Any = SimpleNamespace(design=PLAN.design, drilled=end)
    none: Any = SimpleNamespace(md=np.array([]))
    assert [one.text for one in _depths(drilled, none)] == [f"column C1: drilled {words}"] * count


@pytest.mark.parametrize(("radius", "count"), [(2.0, 0), (2.01, 1)])
def test_a_radius_is_twice_the_spacing_at_most(radius: float, count: int) -> None:
    plans: Any = [
        SimpleNamespace(design=SimpleNamespace(name=name, head=(east, 0.0, 0.0), radius=size))
        for name, east, size in (("A", 0.0, 0.6), ("B", 1.0, radius), ("C", 9.0, 0.6))
    ]
    found = _overlaps(plans, np.array([[0, 1], [1, 2]]))
    assert [one.what for one in found] == ["A-B"] * count


@pytest.mark.parametrize(
    ("what", "top", "touches"),
    [
        ("A", 7.99, True),
        ("A", 8.01, False),
        ("B", 3.99, True),
        ("B", 4.01, False),
        ("C", 99.0, True),
        ("A", None, True),
    ],
)
def test_what_is_wrong_below_the_last_joint_of_a_column_touches_nothing(
    what: str, top: float | None, touches: bool
) -> None:
    """Heads at 1 m below the frame's plane; the joints of A end at 9 m, those of B at 5 m, a remedial C has none."""
    design = SimpleNamespace(head=(0.0, 0.0, 1.0), axis=np.array([0.0, 0.0, 1.0]))
    plans = [SimpleNamespace(design=SimpleNamespace(name=name, **vars(design))) for name in "ABCDE"]
    wall: Any = SimpleNamespace(
        plans=plans, built=SimpleNamespace(frame=np.eye(3)), pairs=np.array([[0, 3], [0, 4], [1, 4]]),
        tight_depths=np.array([[2.0, 6.0], [2.0, 9.0], [2.0, 5.0]]),
    )  # fmt: skip
    warning: Any = SimpleNamespace(what=what, top=top)
    assert _touches(wall, warning) == touches


def column_of(name: str, *cells: str) -> dict[str, list[float]]:
    found = instrument_column(Path("a.csv"), name, cells, range(2, 2 + len(cells)), ".")
    return {key: values.tolist() for key, values in found.items()}


@pytest.mark.parametrize(
    ("name", "good", "bad", "words"),
    [
        ("sigma_yaw_deg", "180", "180.1", "0 or more and at most 180"),
        ("sigma_systematic_deg", "0", "-0.1", "0 or more and at most 180"),
        ("sigma_force_mps2", "100", "100.1", "0 or more and at most 100"),
        ("measurements", "1", "0.9", "1 or more"),
        ("temperature_c", "0", "-999.25", "0 or more"),
    ],
)
def test_a_column_of_an_instrument_has_its_bounds_and_the_collar_what_the_first_station_has(
    name: str, good: str, bad: str, words: str
) -> None:
    assert column_of(name, "", good, "2") == {name: [float(good), float(good), 2.0]}
    assert column_of(name, "", " ", "") == {}
    assert column_of(name, "3", good) == {name: [3.0, float(good)]}
    for cells, line, cell in (((good, bad), 3, bad), ((good, ""), 3, ""), ((bad, good), 2, bad), (("",), 2, "")):
        if any(cells):
            with pytest.raises(SurveyError) as no:
                column_of(name, *cells)
            assert f"line {line}: {name}: expected a number of {words}, got {cell!r}" in str(no.value)
    assert column_of("time_s", "-1e9", "5") == {"time_s": [-1e9, 5.0]}


# small models of a hole


def test_a_north_that_is_off_brings_positions_inward_and_the_region_holds_what_it_says() -> None:
    """Across z sigma, inward z^2 sigma^2 / 2: a quadratic in z^2 says which part of all turns is inside of 95 %."""
    covs = inward_covs(np.array([[3.0, -4.0, 10.0], [0.0, 0.0, 7.0]]), 0.02)
    level = np.array([3.0, -4.0, 0.0])
    assert covs[0] == pytest.approx((1.05 * 0.02**2) ** 2 * np.outer(level, level))
    assert not covs[1].any()
    sigma = 0.03
    inward = inward_std(sigma) / sigma**2
    limit, steep = stats.chi2(2).ppf(0.95), 1.0 / (2.0 * inward) ** 2
    z_squared = (math.sqrt(1.0 + 4.0 * steep * limit) - 1.0) / (2.0 * steep)
    assert stats.chi2(1).cdf(z_squared) == pytest.approx(0.934, abs=5e-4)
    assert inward_std(3.0) == 1.0  # never farther than to the axis


def expected_of(seen: list[float], free: list[float], monkeypatch: pytest.MonkeyPatch) -> tuple[float, Any]:
    """What is expected of a hole that was stated as 0.02 rad/m and has shown so much."""
    monkeypatch.setattr(bends_room, "bends_seen", lambda _: (np.array(seen), np.array(free)))
    found: Any = SimpleNamespace(path=SimpleNamespace(curvature_std=0.02))
    return bends_room.expected_curvature(found)


def test_a_hole_bends_among_all_holes_as_is_stated_until_it_shows_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, legs = expected_of([0.0, 0.0], [0.0, 0.0], monkeypatch)
    assert whole == pytest.approx(0.02**2, rel=0.01)  # the mean square of all holes
    assert legs == pytest.approx([whole])
    for x in (-1.0, 0.4, 2.0):  # of a hole of many legs the sizes are as close as they are tried
        size = 0.01 * math.exp(math.sqrt(math.log(2.0)) * x)
        whole, legs = expected_of([0.0, 4000.0 * size**2, 0.0], [0.0, 4000.0, 2.0], monkeypatch)
        assert whole == pytest.approx(size**2, rel=0.02)
        assert legs == pytest.approx([(4.0 * whole + 4000.0 * size**2) / 4004.0, 4.0 * whole / 6.0])
    for seen, free in ((3e-4, 4.0), (5e-3, 6.0), (2e-4, 9.0)):

        def likely(x: float, seen: float = seen, free: float = free) -> float:
            """Of a deviation of the logarithm from half of what is stated; free directions show a sum of squares."""
            variance = (0.01 * math.exp(math.sqrt(math.log(2.0)) * x)) ** 2
            return math.exp(-0.5 * x**2 - 0.5 * seen / variance) * variance ** (-0.5 * free)

        def times(x: float, likely: Any = likely) -> float:
            return likely(x) * (0.01 * math.exp(math.sqrt(math.log(2.0)) * x)) ** 2

        total, _ = integrate.quad(likely, -4.0, 4.0, limit=200)
        mean, _ = integrate.quad(times, -4.0, 4.0, limit=200)
        found, legs = expected_of([0.4 * seen, 0.6 * seen], [1.0, free - 1.0], monkeypatch)
        assert found == pytest.approx(mean / total, rel=0.01)
        assert legs == pytest.approx([(4.0 * found + 0.6 * seen) / (3.0 + free)])
