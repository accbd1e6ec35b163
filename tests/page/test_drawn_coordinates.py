"""What the page draws, read from the drawing in a real browser: where, how large, which way.

The page's own files are served as they are; its answers are written here, so that what is drawn has a place that a
ruler gives. A drawing that is mirrored has the same label and the same number of dots.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect
from told_page import CONE, END, REGIONS, STATIONS, column, hear, read, row, tell, verdict

pytestmark = pytest.mark.slow


def shown(page: Page, stations: list[dict[str, Any]], end: dict[str, Any] | None = None, **more: Any) -> None:
    """Have the column drawn, at once."""
    if regions := more.get("regions"):
        tell(page, "uncertainty", regions)
    if "bit" in more:
        tell(page, "status", {"bit_md_m": more["bit"], "rig": "rig-1", "health": "good", "tubes": 1})
    tell(page, "column", column(*stations, end=end))
    expect(page.locator("#plan .path")).to_have_count(1)
    expect(page.locator("#plan .dot")).to_have_count(max(len(stations) - 1, 0))


def plan_scale(page: Page, limit: float) -> float:
    """Length on the plan of a centimetre: the limit is a ring whose size is told."""
    (ring,) = read(page, "#plan circle.limit.full")
    assert (ring["x"], ring["y"]) == (0.0, 0.0)
    return float(ring["r"] / limit)


def test_the_plan_has_north_up_and_east_to_the_right(page: Page) -> None:
    places = [(0.0, 0.0), (10.0, 0.0), (0.0, 8.0), (-6.0, 3.0), (4.0, -9.0)]
    shown(page, [row(float(k), north, east) for k, (north, east) in enumerate(places)])
    scale = plan_scale(page, 40.0)
    assert scale > 1.0
    dots = [(dot["x"] / scale, dot["y"] / scale) for dot in read(page, "#plan circle.dot")]
    assert dots == [pytest.approx((east, -north), abs=1e-6) for north, east in places[1:]]
    (path,) = read(page, "#plan polyline.path")
    assert [(x / scale, y / scale) for x, y in path] == [pytest.approx((e, -n), abs=1e-6) for n, e in places]
    letters = {text["text"]: text for text in read(page, "#plan text")}
    assert letters["N"]["y"] < -100.0
    assert letters["E"]["x"] > 100.0
    assert [ring["r"] / scale for ring in read(page, "#plan circle.limit")] == [pytest.approx(r) for r in (20, 32, 40)]
    step = float(next(text for text in letters if text.endswith(" cm") and "ring" not in text).removesuffix(" cm"))
    bar = next(d for d in read(page, "#plan path.toe") if "h" in d)
    assert float(bar.partition("h")[2].partition("v")[0]) / scale == pytest.approx(step)


def test_the_region_of_the_last_station_has_its_size_and_its_direction(page: Page) -> None:
    shown(page, STATIONS, regions=REGIONS)
    scale = plan_scale(page, 30.0)
    (region,) = read(page, "#plan ellipse.region")
    centre = region["centre"]
    assert (centre["x"] / scale, centre["y"] / scale) == pytest.approx((7.0, -12.0))
    for end, half_cm, azimuth in (("along", 8.0, 30.0), ("across", 3.0, 120.0)):
        east, north = (region[end]["x"] - centre["x"]) / scale, -(region[end]["y"] - centre["y"]) / scale
        assert math.hypot(east, north) == pytest.approx(half_cm)
        assert math.degrees(math.atan2(east, north)) % 180.0 == pytest.approx(azimuth)


def test_the_end_is_drawn_where_and_as_wide_as_it_is_foreseen(page: Page) -> None:
    shown(page, STATIONS, END)
    scale = plan_scale(page, 50.0)
    (circle,) = read(page, "#plan circle.cone")
    assert (circle["x"] / scale, circle["y"] / scale, circle["r"] / scale) == pytest.approx((-6.0, -30.0, 12.5))
    (way,) = read(page, "#plan polyline.ahead")
    assert [(x / scale, -y / scale) for x, y in way] == [
        pytest.approx(place) for place in ((7.0, 12.0), (1.0, 16.0), (-6.0, 30.0))
    ]
    cross = next(d for d in read(page, "#plan path.toe") if d.endswith("l-10,10"))
    assert [float(one) / scale for one in cross[1:].partition("l")[0].split(",")] == [
        pytest.approx(-6.0 - 5.0 / scale), pytest.approx(-30.0 - 5.0 / scale),
    ]  # fmt: skip


def strip_scales(page: Page) -> tuple[Callable[[float], float], Callable[[float], float]]:
    """Centimetres of a place across the strip and metres of one down it, by the letters at its edges."""
    texts = [text for text in read(page, "#strip text") if text["text"].isdecimal()]
    depths = [(float(t["text"]), t["y"] - 4.0) for t in texts if t["x"] < 34.0]
    widths = [(float(t["text"]), t["x"]) for t in texts if t["x"] > 34.0 and t["y"] < 22.0]
    (m0, y0), (m1, y1) = depths[0], depths[-1]
    (c1, x1) = widths[-1]
    assert (m0, m1 > 0.0) == (0.0, True)
    assert y0 < y1, "the collar is at the top"
    assert c1 > 0.0
    assert x1 > 34.0
    return lambda x: c1 * (x - 34.0) / (x1 - 34.0), lambda y: m1 * (y - y0) / (y1 - y0)


def near(points: list[tuple[float, float]]) -> list[Any]:
    return [pytest.approx(point, abs=1e-6) for point in points]


def test_the_strip_has_depth_downwards_and_deviation_to_the_right(page: Page) -> None:
    shown(page, STATIONS, END, bit=12.5)
    cm, m = strip_scales(page)

    def seen(selector: str) -> list[list[tuple[float, float]]]:
        return [[(cm(x), m(y)) for x, y in one] for one in read(page, selector)]

    off = [math.hypot(r["north_cm"], r["east_cm"]) for r in STATIONS]
    assert seen("#strip polyline.path") == [near(list(zip(off, (0.0, 5.0, 10.0), strict=True)))]
    assert [(cm(d["x"]), m(d["y"])) for d in read(page, "#strip circle.dot")] == near([(off[1], 5.0), (off[2], 10.0)])
    right = [(o + 2.0 * r["sigma_cm"], r["md_m"]) for o, r in zip(off, STATIONS, strict=True)]
    left = [(max(o - 2.0 * r["sigma_cm"], 0.0), r["md_m"]) for o, r in zip(off, STATIONS, strict=True)]
    assert seen("#strip polygon.band") == [near(right + left[::-1])]
    limits = [(20.0, 0.0), (25.0, 5.0), (30.0, 10.0), (50.0, 20.0)]
    assert seen("#strip polyline.limit") == [near([(part * c, d) for c, d in limits]) for part in (0.5, 0.8, 1.0)]
    start, far = (off[2], 10.0), [(r["deviation_cm"], r["half_width_cm"], r["md_m"]) for r in CONE]
    assert seen("#strip polyline.ahead") == [near([start, *((c, d) for c, _, d in far)])]
    sides = [(c + h, d) for c, h, d in far] + [(c - h, d) for c, h, d in far[::-1]]
    assert seen("#strip polygon.cone") == [near([start, *sides])]
    (bit,) = read(page, "#strip line.bit")
    assert m(bit["y1"]) == pytest.approx(12.5)


def looked_at(page: Page, azimuth: float, elevation: float) -> None:
    page.evaluate(
        """async ([azimuth, elevation]) => {
          const space = await import("/static/js/space.js");
          Object.assign(space.view, { azimuth, elevation });
        }""",
        [azimuth, elevation],
    )
    tell(page, "column", column(*STATIONS, end=None), 3)
    expect(page.locator("#plan svg")).to_have_attribute(
        "aria-label", f"3-D: towards {azimuth} degrees, {elevation} degrees from above"
    )


def test_the_hole_in_space_is_seen_from_where_one_looks(page: Page) -> None:
    """Who looks towards an azimuth has the next quarter clockwise to the right; from above the farther is higher."""
    shown(page, STATIONS, regions=REGIONS)
    page.click("#space")
    across = 2.0 * 118.0 * 0.34 / 30.0  # of a drawing of 118 either side of its middle; the widest limit is 30 cm
    for azimuth, elevation in ((0, 0), (0, 90), (90, 25), (200, 40), (300, 90)):
        looked_at(page, azimuth, elevation)
        a, rise = math.radians(azimuth), math.sin(math.radians(elevation))
        along = 2.0 * 0.74 * 118.0 / 20.0 * math.cos(math.radians(elevation))

        def seen(north: float, east: float, md: float, a: float = a, rise: float = rise, along: float = along) -> Any:
            right = east * math.cos(a) - north * math.sin(a)
            away = north * math.cos(a) + east * math.sin(a)
            return pytest.approx((right * across, (md - 10.0) * along - away * across * rise), abs=0.02)

        (path,) = read(page, "#plan polyline.path")
        assert [tuple(p) for p in path] == [seen(r["north_cm"], r["east_cm"], r["md_m"]) for r in STATIONS]
        needle = read(page, "#plan polyline.axis")[-1]
        assert [tuple(p) for p in needle] == [seen(0.0, 0.0, 0.0), seen(15.0, 0.0, 0.0)]
        outline, tilt = read(page, "#plan polygon.region")[-1], math.radians(30.0)
        for k in range(0, 48, 12):
            u, v = math.cos(math.tau * k / 48), math.sin(math.tau * k / 48)
            north = 12.0 + 8.0 * u * math.cos(tilt) - 3.0 * v * math.sin(tilt)
            east = 7.0 + 8.0 * u * math.sin(tilt) + 3.0 * v * math.cos(tilt)
            assert tuple(outline[k]) == seen(north, east, 10.0)


MOMENTS = [
    {"moment": k, "at_s": 100.0 * k, "md_m": 2.0 * k, "deviation_cm": 1.0, "limit_cm": 40.0, "used_percent": used}
    for k, used in ((1, 10.0), (2, 30.0), (3, 55.0), (4, 20.0))
]


def test_the_course_of_the_hole_rises_with_what_is_used(page: Page) -> None:
    tell(page, "history", {"moments": MOMENTS})
    tell(page, "verdict", verdict(1))
    expect(page.locator("#course .path")).to_have_count(1)
    lines = read(page, "#course line.limit")
    levels = {50.0: lines[0]["y1"], 80.0: lines[1]["y1"], 100.0: lines[2]["y1"]}
    (path,) = read(page, "#course polyline.path")
    a_percent = (levels[100.0] - levels[50.0]) / 50.0
    assert a_percent < 0.0
    assert levels[80.0] == pytest.approx(levels[50.0] + 30.0 * a_percent)
    used = [50.0 + (y - levels[50.0]) / a_percent for _, y in path]
    assert used == [pytest.approx(moment["used_percent"]) for moment in MOMENTS]
    xs = [x for x, _ in path]
    assert xs == sorted(xs)


def norths(page: Page) -> list[float]:
    """How far north the dots of the plan are, cm."""
    (ring,) = read(page, "#plan circle.limit.full")
    return [round(-dot["y"] / ring["r"] * 40.0, 3) for dot in read(page, "#plan circle.dot")]


def test_a_late_answer_does_not_take_the_place_of_the_moment_that_is_chosen(page: Page) -> None:
    """The answers of two moments come in the wrong order, and the column of now comes while one of them is shown."""
    asked: dict[str, Route] = {}
    page.route("**/api/column?moment=*", lambda route: asked.update({route.request.url.rpartition("=")[2]: route}))
    tell(page, "history", {"moments": MOMENTS})
    shown(page, [row(0.0, 0.0, 0.0), row(2.0, 33.0, 0.0)])
    assert norths(page) == [33.0]

    def choose(place: int) -> str:
        page.evaluate(
            """(place) => { const slider = document.getElementById("moment"); slider.value = String(place);
            slider.dispatchEvent(new Event("input")); }""",
            place,
        )
        return str(MOMENTS[place]["moment"])

    def answer(moment: str, north: float) -> None:
        while moment not in asked:
            page.evaluate("() => null")  # the route is called while the driver runs
        before = page.evaluate("window.answered")
        asked.pop(moment).fulfill(json=column(row(0.0, 0.0, 0.0), row(2.0, north, 0.0)))
        page.wait_for_function("(before) => window.answered > before", arg=before)

    for _ in range(2):
        first, second = choose(0), choose(2)
        answer(second, 5.0)
        expect(page.locator("#then")).to_contain_text("rig time 300 s")
        assert norths(page) == [5.0]
        answer(first, 11.0)
        assert norths(page) == [5.0]
        tell(page, "column", column(row(0.0, 0.0, 0.0), row(2.0, 22.0, 0.0)), 5)
        tell(page, "verdict", verdict(5))  # has all painted at once
        assert norths(page) == [5.0]
        page.click("#live")
        assert norths(page) == [22.0]
        third = choose(1)
        page.click("#live")
        answer(third, 14.0)
        assert norths(page) == [22.0]


def test_an_older_answer_changes_nothing_and_another_start_of_the_ground_station_everything(page: Page) -> None:
    judged = page.evaluate(
        """async () => {
          const { Picture } = await import("/static/js/picture.js");
          const picture = new Picture(), found = [], at = { steady: 0, wall: 0 };
          const said = (revision, second) => {
            picture.onAnswer("column", { revision, utc: `2026-01-01T00:00:${second}Z` }, at);
            found.push(picture.answers.column.revision);
          };
          said(5, "05"); said(4, "04"); said(6, "06"); said(6, "05"); said(1, "07");  // the last began anew
          return found;
        }"""
    )
    assert judged == [5, 5, 6, 6, 1]
    tell(page, "string", {"tubes": [{"tube": 1, "md_m": 2.0, "stale": False}]}, 9)
    expect(page.locator("#tubes tr")).to_have_count(1)
    for start in ("2", "3"):
        hear(page, "hello", {"build": "1", "start": start, "hole": "H1"})
        expect(page.locator("#tubes tr")).to_have_count(0)
        tell(page, "string", {"tubes": [{"tube": 1, "md_m": 2.0, "stale": False}]}, 1)
        expect(page.locator("#tubes tr")).to_have_count(1)


def test_of_string_and_state_of_a_tube_the_newer_is_shown(page: Page) -> None:
    found = page.evaluate(
        """async () => {
          const { Picture } = await import("/static/js/picture.js");
          const picture = new Picture(), at = { steady: 0, wall: 0 };
          const shown = (string, node) => {
            picture.forget();
            picture.onAnswer("string", { revision: string, utc: "a", tubes: [{ tube: 1, yaw_deg: 10 }] }, at);
            picture.onAnswer("nodes/1", { revision: node, utc: "a", yaw_deg: 20 }, at);
            return picture.tubes()[0].yaw_deg;
          };
          return [shown(5, 4), shown(5, 5), shown(5, 6)];
        }"""
    )
    assert found == [10, 20, 20]


def test_the_quickest_way_counts_of_the_last_sixty_answers(page: Page) -> None:
    late = page.evaluate(
        """async () => {
          const { Picture } = await import("/static/js/picture.js");
          const picture = new Picture(), utc = "2026-01-01T00:00:00Z", wall = Date.parse(utc);
          const found = [picture.lateness(utc, wall + 1000)];
          for (let k = 0; k < 59; k++) found.push(picture.lateness(utc, wall + 4000));
          found.push(picture.lateness(utc, wall + 4000), picture.lateness(utc, wall + 4500));
          return [found[0], found[1], found[59], found[60], found[61]];
        }"""
    )
    assert late == [0, 3000, 3000, 0, 500]


def test_the_newest_orders_stand_there_the_newest_first(page: Page) -> None:
    orders = [
        {"order": k, "tube": None, "arguments": {}, "command": f"order_{k}", "action": None, "state": "done",
         "detail": "", "by": "anna", "ordered_utc": f"2026-01-01T00:00:{k:02}Z"}
        for k in range(1, 13)
    ]  # fmt: skip
    tell(page, "orders", {"orders": orders})
    expect(page.locator("#orders li")).to_have_count(8)
    texts = page.locator("#orders li").all_inner_texts()
    assert [text.partition(":")[0] for text in texts] == [f"order {k}" for k in range(12, 4, -1)]


def test_the_joint_that_most_likely_leaks_stands_first(page: Page) -> None:
    joints = [
        {
            "joint": f"J{k}",
            "thickness_m": 1.0,
            "thinnest_at_m": 1.0,
            "probability_where_surveyed": p,
            "surveyed_percent": 100,
        }
        for k, p in enumerate((0.02, 0.3, None, 0.1))
    ]
    wall = {"name": "w", "hole": "H", "problem": None, "required_thickness_m": 0.8, "allowed_probability": 0.05}
    wall |= {"verdict": "not_tight", "findings": [f"void {k}" for k in range(9)]}
    tell(page, "wall", {"wall": wall | {"joints": joints}})
    expect(page.locator("#joints tr")).to_have_count(4)
    assert [text.split()[0] for text in page.locator("#joints tr").all_inner_texts()] == ["J1", "J3", "J0", "J2"]


@pytest.mark.parametrize(
    ("verdict", "word"),
    [("tight", "tight; "), ("not_proven", "NOT PROVEN to be tight; "), ("not_tight", "NOT TIGHT so far; ")],
)
def test_what_speaks_against_a_wall_stands_beside_its_joints(page: Page, verdict: str, word: str) -> None:
    """A void is in no joint: of nine reasons six are told, with how many more there are."""
    joint = {"joint": "A-B", "thickness_m": 1.0, "thinnest_at_m": 1.0, "probability_where_surveyed": 1e-9}
    wall = {"name": "w", "hole": "H", "problem": None, "required_thickness_m": 0.8, "allowed_probability": 0.05}
    wall |= {"joints": [joint | {"surveyed_percent": 75}], "verdict": verdict}
    counts = ((9, [*(f"void {k}" for k in range(6)), "and 3 more"]), (1, ["void 0"]), (0, []))
    for revision, (count, told) in enumerate(counts, 1):
        tell(page, "wall", {"wall": wall | {"findings": [f"void {k}" for k in range(count)]}}, revision)
        expect(page.locator("#wall-findings li")).to_have_text(told)
    expect(page.locator("#wall-problem")).to_have_text(f"{word}required 80 cm")
    expect(page.locator("#joints tr td").last).to_have_text("1e-9, 75 % surveyed")


def test_the_end_is_shared_between_ground_and_survey_by_variance(page: Page) -> None:
    """Three centimetres of nine, squared: a ninth is surveyed, eight ninths are the ground's."""
    shown(page, STATIONS, END)
    expect(page.locator("#spread-end")).to_contain_text("Of that 89 parts in 100 are how the ground may bend")
    expect(page.locator("#spread-end")).to_contain_text("11 are what was surveyed")
