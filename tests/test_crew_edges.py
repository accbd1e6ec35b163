"""The crew's screen at its edges: how long a verdict counts, which tube a key means, which alarm, for how long."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from borechain.crew.app import CrewApp
from borechain.crew.picture import FRESH_WITHOUT_WORD, Picture
from borechain.crew.screen_panels import strip_row, verdict_panel

VERDICT = {
    "verdict": "on_target", "by_surveys": "on_target", "line": "ON TARGET", "todo": "drill on", "why": [], "utc": "1",
}  # fmt: skip


class Source:
    """A ground station that notes what is ordered."""

    def __init__(self) -> None:
        self.ordered: list[tuple[str, dict[str, object]]] = []

    def ask(self, path: str, **parameters: object) -> dict[str, Any]:
        del path, parameters
        return {}

    def follow(self, path: str, call: object) -> None:
        """Nothing is published."""

    def order(self, name: str, by: str, **parameters: object) -> Any:
        assert by == "anna"
        self.ordered.append((name, parameters))
        return SimpleNamespace(state="done", detail="", tube=None, values={})


@pytest.mark.parametrize("good_for", [None, 1.5, 30.0])
def test_a_verdict_counts_for_exactly_as_long_as_it_says(good_for: float | None) -> None:
    """It says how long it is good; only where it does not, the screen's own time stands."""
    picture, lasts = Picture("rig-1"), FRESH_WITHOUT_WORD if good_for is None else good_for
    said = VERDICT if good_for is None else VERDICT | {"good_for_s": good_for}
    picture.on_answer("verdict", said, 1000.0)
    for age, is_live in ((0.0, True), (lasts, True), (lasts + 1e-6, False)):
        assert picture.is_live(1000.0 + age) == is_live
        assert (picture.verdict(1000.0 + age)["verdict"] == "on_target") == is_live
        assert verdict_panel(picture, 1000.0 + age).plain.startswith(" ON TARGET") == is_live


def test_the_lowest_tube_is_the_last_of_the_string() -> None:
    picture = Picture("rig-1")
    assert picture.lowest is None
    for tubes in ([7], [9, 4, 7], [3, 2, 1]):
        picture.on_answer("string", {"tubes": [{"tube": tube} for tube in tubes], "revision": 1, "utc": "1"}, 1000.0)
        assert picture.lowest == tubes[-1]


@pytest.mark.parametrize(
    ("used", "style"),
    [(0.0, ""), (79.99, ""), (80.0, "yellow"), (99.99, "yellow"), (100.0, "bold red"), (250.0, "bold red")],
)
def test_a_depth_is_marked_from_exactly_80_and_100_percent_on(used: float, style: str) -> None:
    assert strip_row({"used_percent": used, "md_m": 4.0}).style == style


async def test_the_chosen_alarm_is_one_of_those_and_is_shelved_for_half_an_hour() -> None:
    source = Source()
    app = CrewApp(source, "rig-1", "anna", lambda: 1000.0)
    app.paint = lambda: None  # type: ignore[method-assign]
    async with app.run_test(size=(80, 24)) as pilot:
        alarms = [{"number": number} for number in (40, 30, 20)]
        app.picture.on_answer("alarms", {"open": alarms, "revision": 1, "utc": "1"}, 1000.0)
        for step, chosen in ((1, 1), (1, 2), (1, 2), (1, 2), (-1, 1), (-1, 0), (-1, 0), (1, 1)):
            app.action_choose(step)
            assert app._chosen == chosen
        app.action_shelve()
        await app.workers.wait_for_complete()
        app.action_acknowledge()
        await app.workers.wait_for_complete()
        app.picture.on_answer("string", {"tubes": [{"tube": 5}, {"tube": 2}], "revision": 1, "utc": "1"}, 1000.0)
        app.action_take_survey()
        await app.workers.wait_for_complete()
        await pilot.pause()
    assert source.ordered == [
        ("alarm", {"action": "shelve", "number": 30, "minutes": 30}),
        ("alarm", {"action": "acknowledge", "number": 30}),
        ("take_survey", {"tube": 2}),
    ]
