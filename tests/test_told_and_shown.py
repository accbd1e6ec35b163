"""The log of a run, the live hole as a file, figures of radio links, the summary of a campaign: line by line."""

from __future__ import annotations

import datetime
import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from borechain.crew.log import FOLLOWED, RunLog
from groundstation.errors import SurveyError
from groundstation.report.plots_radio import draw_pipe, draw_soil, draw_soil_map
from groundstation.survey.exports.live_hole import LivePlace, place_of_text, site_of_live
from sim.campaign.summary import INTERVAL, accuracy_rows, honesty_rows
from telemetry.radio.link_request import PipeRequest, SoilRequest


class Told:
    """A log and what it wrote, without the time of people."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.log = RunLog(self.lines.append)

    def new(self) -> list[str]:
        found = []
        for line in self.lines:
            match = re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ +([\d.]+) s (\w+) +(.*)", line)
            assert match is not None, line
            found.append(f"{match[1]} {match[2]}: {match[3]}")
        self.lines.clear()
        return found


def tick(phase: str, rig_time: float) -> Any:
    return SimpleNamespace(phase=phase, rig_time=rig_time, begin=100.0, end=400.0)


def test_phases_and_restarts_are_told_once_each() -> None:
    told = Told()
    assert told.log.on_tick(tick("drill", 110.4), {"node-1": 0})
    assert not told.log.on_tick(tick("drill", 111.0), {"node-1": 0})
    assert not told.log.on_tick(tick("drill", 112.0), {"node-1": 1, "base": 2})
    assert not told.log.on_tick(tick("drill", 113.0), {"node-1": 1, "base": 2})
    assert told.log.on_tick(tick("stop", 150.0), {"node-1": 3, "base": 2})
    assert told.new() == [
        "10.4 phase: drill, at 10 of 300 s",
        "12.0 restart: process node-1, 1 so far",
        "12.0 restart: process base, 2 so far",
        "50.0 restart: process node-1, 3 so far",
        "50.0 phase: stop, at 50 of 300 s",
    ]


def survey(seq: int, trust: str = "full", replaces: int | None = None) -> dict[str, Any]:
    return {
        "seq": seq, "tube": 2, "md_m": 4.125, "inclination_deg": 3.456, "azimuth_deg": 71.6, "trust": trust,
        "replaces": replaces,
    }  # fmt: skip


def alarm(number: int, state: str, level: str, **more: Any) -> dict[str, Any]:
    plain = {"code": "gap", "subject": "tube 1", "detail": "1 missing", "wind": None, "md_m": None, "azimuth_deg": None}
    return plain | {"number": number, "state": state, "level": level} | more


def test_answers_are_told_once_until_they_change_and_anew_of_another_hole() -> None:
    told = Told()
    say = told.log.on_answer
    say("measurements", {"measurements": [survey(5), survey(3, "no_yaw"), survey(4, "full", 3)]})
    say("measurements", {"measurements": [survey(5)]})
    assert told.new() == [
        "0.0 survey: tube 2 at 4.12 m: 3.46 deg to 72 deg",
        "0.0 survey: tube 2 at 4.12 m: 3.46 deg to 72 deg, no yaw",
        "0.0 survey: tube 2 at 4.12 m: 3.46 deg to 72 deg, again",
    ]
    first, far = alarm(7, "raised", "grave"), alarm(8, "raised", "low", wind="ENE", azimuth_deg=67.5, md_m=6.04)
    say("alarms", {"open": [first], "closed": [far]})
    say("alarms", {"open": [alarm(7, "acknowledged", "grave")], "closed": [far]})
    say("alarms", {"open": [alarm(7, "acknowledged", "serious")], "closed": []})
    assert told.new() == [
        "0.0 alarm: 7 raised, grave, gap tube 1: 1 missing",
        "0.0 alarm: 8 raised, low, gap tube 1 at 6.0 m to 67.5 deg ENE: 1 missing",
        "0.0 alarm: 7 acknowledged, grave, gap tube 1: 1 missing",
        "0.0 alarm: 7 acknowledged, serious, gap tube 1: 1 missing",
    ]
    joint = {"joint": "A-B", "state": "open", "probability_where_surveyed": 0.01234, "surveyed_percent": 40}
    say("wall", {"wall": None})
    say("wall", {"wall": {"joints": [joint, joint | {"joint": "B-C", "probability_where_surveyed": None}]}})
    say("wall", {"wall": {"joints": [joint, joint | {"surveyed_percent": 50}]}})
    for word in ("good", "good", "bad"):
        say("verdict", {"verdict": word, "line": f"it is {word}"})
    whole = [
        "0.0 joint: A-B open: P(opening) 0.012, 40 % surveyed",
        "0.0 joint: B-C open: not surveyed",
        "0.0 joint: A-B open: P(opening) 0.012, 50 % surveyed",
        "0.0 verdict: it is good",
        "0.0 verdict: it is bad",
    ]
    assert told.new() == whole
    told.log.on_hole("K2")
    say("measurements", {"measurements": [survey(5)]})
    say("alarms", {"open": [alarm(7, "acknowledged", "serious")], "closed": []})
    say("wall", {"wall": {"joints": [joint]}})
    say("verdict", {"verdict": "bad", "line": "it is bad"})
    assert [line.split(":")[0] for line in told.new()] == [
        "0.0 hole",
        "0.0 survey",
        "0.0 alarm",
        "0.0 joint",
        "0.0 verdict",
    ]


def test_what_did_not_come_is_asked_for_after_the_newest_and_all_of_it_in_the_end() -> None:
    told, asked = Told(), list[tuple[str, dict[str, str]]]()
    answers: dict[str, dict[str, Any]] = {
        "measurements": {"measurements": []},
        "alarms": {"open": [], "closed": []},
        "verdict": {"verdict": "", "line": ""},
        "wall": {"wall": None},
    }

    def ask(path: str, parameters: dict[str, str]) -> dict[str, Any]:
        asked.append((path, parameters))
        return answers[path]

    told.log.on_answer("measurements", {"measurements": [survey(9), survey(4)]})
    told.log.poll(ask)
    told.log.poll(ask, 0)
    others = [(path, {}) for path in FOLLOWED if path != "measurements"]
    assert asked == [("measurements", {"since": "9"}), *others, ("measurements", {"since": "0"}), *others]
    followed: list[str] = []
    ground: Any = SimpleNamespace(follow=lambda path, _: followed.append(path))
    told.new()
    for _ in range(2):
        told.log.join("tcp/a:1", "r", ground)
    assert followed == list(FOLLOWED)
    assert told.new() == ["0.0 open: tcp/a:1: borechain crew --endpoint tcp/a:1 --rig r"]


def point(k: int) -> dict[str, Any]:
    cov = [[1.0 + k, 0.0, 0.0], [0.0, 2.0 + k, 0.0], [0.0, 0.0, 3.0 + k]]
    return {
        "md_m": 2.0 * k, "inclination_deg": 3.0 + k, "azimuth_deg": 365.0 - 10.0 * k, "north_m": 0.1 * k,
        "east_m": 0.2 * k, "tvd_m": 1.9 * k, "covariance_m2": cov,
    }  # fmt: skip


COLUMN = {
    "design": {"radius_m": 0.6},
    "stations": [{"north_cm": 1.0, "east_cm": 2.0}, {"north_cm": -3.0, "east_cm": 4.0}],
}


@pytest.mark.parametrize(
    ("origin", "grid", "axis"),
    [("", "", [0.2, 0.1, -1.9]), ("1000,200,30", "EPSG:1", [200.2, 1000.1, 28.1])],
)
def test_a_live_hole_is_exported_as_it_is_answered(origin: str, grid: str, axis: list[float]) -> None:
    site = site_of_live(
        "rig-1", {"points": [point(0), point(1)]}, COLUMN, place_of_text(origin, grid), datetime.date(2026, 2, 3)
    )
    (hole,) = site.holes
    assert (site.name, site.crs, site.day) == ("rig-1", grid, "2026-02-03")
    assert (hole.name, hole.radius, hole.north) == ("rig-1", 0.6, "site")
    assert hole.md.tolist() == [0.0, 2.0]
    assert hole.inclination_deg.tolist() == [3.0, 4.0]
    assert hole.azimuth_deg.tolist() == [5.0, 355.0]
    assert hole.local[1].tolist() == [0.1, 0.2, 1.9]
    assert hole.axis[1] == pytest.approx(axis)
    assert hole.covs is not None
    assert hole.covs[1].tolist() == point(1)["covariance_m2"]
    assert hole.deviation == pytest.approx([-0.03, 0.04])


def test_a_hole_without_a_station_and_a_place_that_is_none_are_refused() -> None:
    with pytest.raises(SurveyError, match="rig-1: no station below the collar yet"):
        site_of_live("rig-1", {"points": [point(0)]}, COLUMN, LivePlace(), datetime.date(2026, 2, 3))
    for text, grid, words in (
        ("1,2", "", "expected NORTHING,EASTING,HEIGHT in m, got '1,2'"),
        ("1,2,x", "", "expected NORTHING,EASTING,HEIGHT"),
        ("", "EPSG:1", "--grid-crs: expected --origin"),
        ("nan,2,3", "", "--origin"),
    ):
        with pytest.raises(SurveyError, match=words):
            place_of_text(text, grid)


def columns(**values: list[Any]) -> Any:
    return {name: np.array(value) for name, value in values.items()}


def test_a_campaign_s_honesty_is_that_of_its_runs() -> None:
    """Two runs at one hop; chunk by chunk, each run counted once by the mean of its epochs."""
    one = columns(
        run=[1, 1, 1, 1], hop=[2, 2, 2, 2], turning=[False, False, False, True], known=[True, True, False, True],
        yaw_error=[0.03, -0.01, 9.0, 0.5], systematic_error=[0.01, 0.01, 0.0, 0.1], yaw_var=[4e-4, 1e-4, 1.0, 0.04],
        systematic_var=[5e-4, 1e-4, 0.0, 0.05],
    )  # fmt: skip
    other = columns(
        run=[7], hop=[2], turning=[False], known=[True], yaw_error=[2.0 * math.pi + 0.05], systematic_error=[0.02],
        yaw_var=[1e-4], systematic_var=[1e3],
    )  # fmt: skip
    resting, turning = honesty_rows([one, other])
    assert [(row["state"], row["hop"], row["count"]) for row in (resting, turning)] == [
        ("at rest", 2, 3),
        ("turning", 2, 1),
    ]
    squares = [0.02**2, 0.02**2, 0.03**2]
    assert resting["yaw_rms_deg"] == pytest.approx(math.degrees(math.sqrt(sum(squares) / 3.0)))
    runs = [(1.0 + 4.0) / 2.0, 9.0]  # NEES of each run: its own errors over its own variances
    half = INTERVAL * math.sqrt((runs[1] - runs[0]) ** 2 / 2.0 / 2.0)
    found = [resting[key] for key in ("nees", "nees_low", "nees_high")]
    assert found == pytest.approx([sum(runs) / 2.0, sum(runs) / 2.0 - half, sum(runs) / 2.0 + half])
    totals = [(9e-4 / 9e-4 + 1e-4 / 2e-4) / 2.0, (2.0 * math.pi + 0.05) ** 2 / (1e3 + 1e-4)]
    assert resting["nees_total"] == pytest.approx(sum(totals) / 2.0)
    assert resting["inside_95_percent"] == 100.0
    assert turning["nees"] == pytest.approx(0.16 / 0.04)
    assert math.isnan(turning["nees_low"])
    assert turning["inside_95_percent"] == 100.0  # 0.25 over 0.09 is 2.8, below 3.84


def test_a_campaign_s_accuracy_counts_what_is_trusted() -> None:
    surveys = columns(
        run=[1, 2, 2, 3], md=[2.0004, 2.0, 2.0, 4.0], trusted=[True, True, False, True],
        inclination_error=[0.01, 0.02, 0.03, 0.04], azimuth_error=[0.1, 0.3, 9.0, math.nan],
    )  # fmt: skip
    upper, lower = accuracy_rows([surveys])
    assert (upper["md_m"], upper["count"], upper["untrusted"]) == (2.0, 3, 1)
    assert upper["inclination_rms_deg"] == pytest.approx(math.degrees(math.sqrt((1.0 + 4.0 + 9.0) / 3.0)) * 0.01)
    squares = [0.01, 0.09]
    half = INTERVAL * (squares[1] - squares[0]) / 2.0
    assert upper["azimuth_rms_deg"] == pytest.approx(math.degrees(math.sqrt(0.05)))
    assert upper["azimuth_high_deg"] == pytest.approx(math.degrees(math.sqrt(0.05 + half)))
    assert upper["azimuth_low_deg"] == 0.0  # 0.05 less its half width is below nothing
    assert (lower["md_m"], lower["count"], lower["untrusted"]) == (4.0, 1, 0)
    assert math.isnan(lower["azimuth_rms_deg"])


def test_received_power_is_drawn_over_twice_the_distances() -> None:
    request = SoilRequest(waters=(0.01, 0.4), distances=(0.2, 0.3), threshold_dbm=-100.0, frequency_mhz=433.0)
    figure = draw_soil(request)
    (axes,) = figure.axes
    *curves, threshold = axes.lines
    assert [line.get_label() for line in axes.lines] == ["1 % water", "40 % water", "threshold"]
    for line in curves:
        x = np.asarray(line.get_xdata(), float)
        assert (x[0], x[-1], len(x)) == (pytest.approx(0.1), pytest.approx(0.45), 200)
        assert np.all(np.diff(line.get_ydata()) < 0.0)
    dry, wet = (np.asarray(line.get_ydata(), float) for line in curves)
    assert np.all(dry > wet)
    assert list(threshold.get_ydata()) == [-100.0, -100.0]
    assert figure.get_suptitle() == "Received power at 433 MHz, 30 % sand, 30 % clay"
    mapped = draw_soil_map(request)
    titles = [panel.get_title(loc="left") for panel in mapped.axes]
    assert titles[:2] == ["1 % water", "40 % water"]
    assert mapped.get_suptitle() == "Margin through 0.3 m of soil at 433 MHz"
    assert [panel.get_xlabel() for panel in mapped.axes[:2]] == ["Sand (%)"] * 2
    assert mapped.axes[0].get_ylabel() == "Clay (%)"


def test_attenuation_is_drawn_from_the_cut_off_on_and_over_the_carbon() -> None:
    """alpha of TM is R_s / (a eta) / sqrt(1 - (fc/f)^2); zeros of J1', J0 and J2'."""
    rho, radius = 1.7e-7, 0.03
    over_frequency, over_carbon = draw_pipe(PipeRequest(radius_cm=3.0, frequency_ghz=5.0), rho).axes
    assert over_frequency.get_title(loc="left") == "17e-8 ohm m"
    assert over_carbon.get_title(loc="left") == "TE11 at 5 GHz"
    for k, zero in enumerate((1.84118, 2.40483, 3.05424)):
        curve, border = over_frequency.lines[2 * k : 2 * k + 2]
        lowest = zero * 0.299792458 / (math.tau * radius)  # GHz
        assert border.get_xdata()[0] == pytest.approx(lowest, rel=1e-5)
        x = np.asarray(curve.get_xdata(), float)
        assert x[0] == pytest.approx(1.01 * lowest, rel=1e-5)
        assert x[-1] == pytest.approx(4.0 * 1.84118 * 0.299792458 / (math.tau * radius), rel=1e-5)
        if k == 1:
            f = x[200] * 1e9
            surface = math.sqrt(math.pi * f * 4e-7 * math.pi * rho)
            alpha = surface / (radius * 376.730) / math.sqrt(1.0 - (lowest * 1e9 / f) ** 2)
            assert curve.get_ydata()[200] == pytest.approx(20.0 / math.log(10.0) * alpha, rel=1e-4)
    labels = [line.get_label() for line in over_carbon.lines]
    assert labels == ["20 C", "100 C", "200 C", "400 C"]
    lost = [float(line.get_ydata()[50]) for line in over_carbon.lines]
    assert lost == sorted(lost)
    assert (over_carbon.lines[0].get_xdata()[0], over_carbon.lines[0].get_xdata()[-1]) == (0.06, 1.22)
    narrow = draw_pipe(PipeRequest(radius_cm=1.0, frequency_ghz=5.0), rho).axes[1]
    assert not narrow.lines  # below the cut-off nothing propagates
