"""What the tubes say on the page: calm where nothing is wrong, what is wrong with its cost, of what the ± is made."""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import pytest
from beating import Beating, beating
from full_stops import survey_stop
from playwright.sync_api import Page, expect

pytestmark = pytest.mark.slow
Open = Callable[..., Page]
AXE = files("axe_playwright_python").joinpath("axe.min.js").read_text()
FINDINGS = "axe.run().then((found) => found.violations.map((v) => `${v.impact} ${v.id}: ${v.nodes[0].html}`))"
STOPS = 7
STEP_MPS2 = 0.16  # 16.3 mg
RIG = {
    "accelerometer_bias_std_deg": 0.06, "mount_tilt_std_deg": 0.05, "north_std_deg": 0.3, "collar_std_deg": 0.2,
}  # fmt: skip


def survey(rig: Beating, step_mps2: float) -> None:
    """All stops of the hole."""
    for stop in range(1, STOPS + 1):
        rig.do(lambda hand, stop=stop: survey_stop(hand, stop, step_mps2))


def numbers_of(page: Page, column: int) -> list[float]:
    """Numbers in a column of what the ± is made of."""
    texts = page.locator(f"#parts tr td:nth-child({column})").all_inner_texts()
    return [float(text.replace("< ", "").removesuffix(" %")) for text in texts]


def test_a_hole_in_which_all_fits_is_calm_and_its_uncertainty_opens_where_it_stands(
    tmp_path: Path, watched: Open
) -> None:
    with beating(tmp_path, **RIG) as rig:
        page = watched(rig.url)
        expect(page.locator("#fit")).to_have_text("Nothing was surveyed below the collar yet")
        survey(rig, 0.0)
        expect(page.locator("#fit")).to_have_text("All 28 readings fit together: nothing is wrong")
        expect(page.locator("#fit")).to_have_class("")
        expect(page.locator("#blunders li")).to_have_count(0)
        expect(page.locator("#next-stop")).to_contain_text(re.compile("^Next stop: (any angle|turn the string)"))
        expect(page.locator("#parts")).to_be_hidden()

        page.click("#open-spread")
        expect(page.locator("#parts")).to_be_visible()
        expect(page.locator("#spread-end")).to_contain_text("parts in 100 are how the ground may bend the hole")
        expect(page.locator("#left-out")).to_contain_text("Not in it: mistakes too small to find")
        told = page.locator("#spread-toe").inner_text()
        sigma = float(re.match(r"σ ([0-9.]+) cm at the last station, 14.0 m", told).group(1))  # type: ignore[union-attr]
        sigmas, percents = numbers_of(page, 1), numbers_of(page, 2)
        assert sum(one**2 for one in sigmas) ** 0.5 == pytest.approx(sigma, rel=0.1)  # each in hundredths of a cm
        assert sum(percents) == pytest.approx(100.0, abs=5.0)
        assert percents == sorted(percents, reverse=True)
        expect(page.locator("#parts")).to_contain_text("north, as it was told")

        page.locator("#unfound summary").click()
        steps = page.locator("#unfound-list li", has_text="step of the accelerometer")
        expect(steps).to_have_count(1)  # of the tube where it does most: the one at the bit, alone at the last station
        expect(steps).to_have_text(
            re.compile(
                r"A step of the accelerometer of tube 1 is (not found below|found from) [0-9.]+ mg.* the toe [0-9.]+ cm"
            )
        )
        page.evaluate(AXE)
        assert page.evaluate(FINDINGS) == []
        page.set_viewport_size({"width": 360, "height": 740})
        assert page.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth") == 0


def test_what_is_wrong_is_told_with_both_explanations_its_cost_and_what_to_do(tmp_path: Path, watched: Open) -> None:
    with beating(tmp_path, **RIG) as rig:
        page = watched(rig.url, color_scheme="light")
        survey(rig, STEP_MPS2)
        expect(page.locator("#fit")).to_have_text("1 thing is wrong, found among 28 readings and put right")
        expect(page.locator("#fit")).to_have_class("wrong")
        item = page.locator("#blunders li")
        best = item.locator(".what").inner_text()
        found = re.match(
            r"▲ Accelerometer of tube 3 steps by ([0-9.]+) ± ([0-9.]+) mg from the stop at 10.0 m on", best
        )
        assert found is not None, best
        size, sigma = map(float, found.groups())
        assert abs(size - STEP_MPS2 / 9.80665e-3) < 4.0 * sigma
        expect(item.locator(".or")).to_contain_text(
            re.compile(r"or mount of tube 3 tilted by .* \((far|some hundred times) less likely\)")
        )
        expect(item.locator(".cost")).to_contain_text(re.compile(r"Not put right it would have the toe [0-9.]+ cm off"))
        expect(item.locator(".todo")).to_have_text(
            "Do: go on, it is put right; calibrate tube 3 or change it when it is out."
        )
        expect(page.locator("#alarm-list")).to_contain_text("accelerometer of tube 3 steps by")
        page.evaluate(AXE)
        assert page.evaluate(FINDINGS) == []
