"""The setup on the page: what is missing in red, what it costs, and the form that tells it, by role."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import pytest
from beating import Beating, beating
from page_client import PASSWORD
from playwright.sync_api import Page, expect

pytestmark = pytest.mark.slow
Open = Callable[..., Page]


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Beating]:
    """A rig whose crew has not told north, nor whether its mounts are aligned."""
    untold = dict.fromkeys(("north_std_deg", "north_check_deg", "north_check_std_deg", "mount_tilt_std_deg"))
    with beating(tmp_path_factory.mktemp("ground"), (0.3, 0.3, 0.3), **untold) as rig:
        yield rig


def test_what_is_missing_is_named_told_by_a_driller_and_taken_back(rig: Beating, watched: Open) -> None:
    page = watched(rig.url)
    expect(page.locator("#word")).to_have_text("DON'T KNOW")
    expect(page.locator("#told")).to_have_text("not told: north")
    expect(page.locator("#ready")).to_have_text("NOT READY TO DRILL, not told: north")
    expect(page.locator("#next")).to_contain_text("Next: tell north")
    expect(page.locator("#worst")).to_have_text(re.compile(r"Costs most at the toe: .*, [0-9.]+ cm"))
    expect(page.locator("#how")).to_have_text("by the form below, or cmd/north?action=tell;angle_deg=..;sigma_deg=..")
    first = page.locator("#setup-items tr").first
    expect(first).to_have_class("grave")
    expect(first.locator("td").nth(2)).to_have_text("any")

    page.fill("#tell-angle_deg", "12.5")
    page.fill("#tell-sigma_deg", "0.3")
    page.click("#tell button[type=submit]")
    page.fill("#who", "anna")
    page.fill("#password", PASSWORD)
    page.click("#sign-now")
    expect(page.locator("#ready")).to_have_text("NOT READY TO DRILL, not checked: north")
    expect(page.locator("#told")).to_have_text("north was told once, check it by a second bearing")
    expect(page.locator("#setup-items tr", has_text="north")).to_have_class("grave")
    page.select_option("#tell-kind", "check north")
    page.fill("#tell-angle_deg", "12.4")
    page.fill("#tell-sigma_deg", "0.3")
    page.click("#tell button[type=submit]")
    expect(page.locator("#ready")).to_have_text("Ready to drill: north and every joint are told")
    expect(page.locator("#word")).to_have_text("ON TARGET")
    todo = rig.served.rig.ask("setup")["todo"].partition(":")[0]
    assert "north" not in todo
    expect(page.locator("#next")).to_have_text(f"Next: {todo}")
    told = page.locator("#setup-items tr", has_text="north")
    expect(told).to_contain_text("told: by anna")
    expect(told).to_contain_text("0 min")
    expect(page.locator("#orders")).to_contain_text("north is 12.5 ± 0.3 deg; 3 surveys were adjusted to it")

    expect(told).to_contain_text("checked by 12.4 ± 0.3 deg of anna")

    page.click("#take-back")
    expect(page.locator("#ready")).to_have_text("NOT READY TO DRILL, not checked: north")
    page.click("#take-back")
    expect(page.locator("#ready")).to_have_text("NOT READY TO DRILL, not told: north")


def test_the_form_asks_for_what_an_order_needs_and_shows_what_is_refused(rig: Beating, watched: Open) -> None:
    page = watched(rig.url)
    page.select_option("#tell-kind", "joint")
    assert page.locator("#tell-fields input").evaluate_all("(inputs) => inputs.map((one) => one.name)") == [
        "tube", "angle_deg", "sigma_deg", "used_deg", "upper",
    ]  # fmt: skip
    for name, value in (("tube", "1"), ("angle_deg", "5"), ("sigma_deg", "0.1")):
        page.fill(f"#tell-{name}", value)
    page.click("#tell button[type=submit]")
    page.fill("#who", "anna")
    page.fill("#password", PASSWORD)
    page.click("#sign-now")
    expect(page.locator("#message")).to_contain_text("joint 2-1: the node of tube 2 was told its angle")
    expect(page.locator("#message")).to_contain_text("expected used_deg=..")
