"""Bad days: what is wrong without a word, of one node and of a rig, how a day is drawn, and a share's interval."""

import numpy as np
import pytest
from scipy.stats import chi2, norm

from borechain.studies.bad_days.one_node import NodeDay, day_row, run_day, surveys_beyond
from borechain.studies.bad_days.run import count_steps, verdict_lines
from borechain.studies.bad_days.shares import wilson_interval
from borechain.studies.bad_days.whole_rig import BEYOND, RIGS, RigDay, rig_jobs, rig_row, tables_of_day
from borechain.studies.blunders.answer_given import AnswerGiven
from borechain.studies.drawn_rigs import tables_of
from sim.string.direct_string import DirectString
from sim.string.result import StringSurvey
from sim.studies.field.run import chosen_cases, drawn_setup
from sim.studies.field.third_world import MILD
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.frozen import replace
from telemetry.messages import NodeFlag

ON_TARGET = AnswerGiven("on_target", (), (), ())


@pytest.mark.parametrize(("share", "trials"), [(0.0, 40), (0.25, 40), (1.0, 7), (0.031, 1000)])
def test_the_ends_of_an_interval_are_the_shares_of_which_the_one_seen_is_1_96_sigmas_off(
    share: float, trials: int
) -> None:
    for end in wilson_interval(share, trials):
        if 1e-12 < end < 1.0 - 1e-12:
            assert abs(share - end) / np.sqrt(end * (1.0 - end) / trials) == pytest.approx(norm.isf(0.025))
        else:
            assert end == pytest.approx(share, abs=1e-12)


def test_a_first_mark_misread_is_wrong_in_every_cycle_and_survey_and_a_clean_string_in_none() -> None:
    (wrong,), (clean,) = chosen_cases("first-mark"), chosen_cases("random-phase")
    misread, right = run_day((wrong, 1)), run_day((clean, 1))
    assert misread.untold == 1.0
    assert misread.yaw_beyond.tolist() == misread.azimuth_beyond.tolist() == [True, True]
    assert right.untold == 0.0
    assert right.yaw_beyond.tolist() == right.azimuth_beyond.tolist() == [False, False]


def test_a_survey_that_is_told_of_is_not_untold_and_is_judged_as_it_was_said_last() -> None:
    (wrong,) = chosen_cases("first-mark")
    world = World(scenario_of(drawn_setup(wrong, 1)), 1)
    run = DirectString(world).drill()
    silent = np.zeros(world.cycles, np.bool_)
    assert [found.tolist() for found in surveys_beyond(world, run, silent)] == [[True, True], [True, True]]
    silent[run.surveys[0].cycle] = True
    assert [found.tolist() for found in surveys_beyond(world, run, silent)] == [[False, True], [False, True]]
    _, second = run.surveys
    flagged = replace(second.measurement, flags=NodeFlag.YAW_UNTRUSTED)
    run.revisions[:] = [StringSurvey(second.cycle, 1, 0.0, second.measurement, second.said + 5)]
    assert surveys_beyond(world, run, silent)[0].tolist() == [False, False]
    run.revisions[:] = [StringSurvey(second.cycle, 1, second.error, flagged, second.said + 5)]
    assert surveys_beyond(world, run, np.zeros_like(silent))[0].tolist() == [True, False]


def test_a_row_of_days_counts_seeds_and_surveys() -> None:
    none, one = np.array([False, False]), np.array([True, False])
    days = [NodeDay(0.0, none, none), NodeDay(0.021, one, none), NodeDay(0.02, one, one), NodeDay(0.5, none, none)]
    row = day_row("a day", days)
    assert (row["case"], row["seeds"], row["surveys"]) == ("a day", 4, 8)
    assert row["much_untold_percent"] == 50.0
    assert row["untold_percent"] == pytest.approx(100.0 * 0.541 / 4.0)
    assert (row["yaw_beyond_percent"], row["azimuth_beyond_percent"]) == (25.0, 12.5)
    # surveys of one seed are no two trials
    assert (row["yaw_beyond_low"], row["yaw_beyond_high"]) == pytest.approx(
        tuple(100.0 * end for end in wilson_interval(0.25, 4))
    )


def test_a_station_counts_where_its_direction_is_beyond_three_sigmas_and_nothing_is_told() -> None:
    assert chi2.sf(BEYOND, 2) == pytest.approx(2.0 * norm.sf(3.0), rel=1e-3)
    far = np.array([1.0, 12.0])
    doubted = [AnswerGiven("on_target", ("d",), (), ()), AnswerGiven("on_target", (), ("belt",), ()),
               AnswerGiven("on_target", (), (), ("c",))]  # fmt: skip
    clocks = AnswerGiven("on_target", (), ("clock",), ())
    answers = [*doubted, clocks, ON_TARGET]
    row = rig_row(RIGS[0], [*(RigDay(far, answer) for answer in answers), RigDay(np.array([11.8]), ON_TARGET)])
    assert (row["rigs"], row["stations"]) == (6, 11)
    assert row["beyond_percent"] == pytest.approx(100.0 * 5 / 11)
    assert row["untold_percent"] == pytest.approx(100.0 * 2 / 11)
    assert row["told_percent"] == 50.0


def test_a_rig_on_its_day_is_one_of_the_set_up_with_the_disturbances_of_the_field() -> None:
    for case in RIGS:
        (found, draw), *_ = rig_jobs(case, 2, 11)
        assert (found, draw.seed, draw.inclination_deg) == (case, 11, case.inclination_deg)
        tables, usual = tables_of_day(draw), tables_of(draw)
        same = ("path", "joints", "setup", "accelerometer", "schedule")
        assert {key: tables[key] for key in same} == {key: usual[key] for key in same}
        assert tables["told"]["lengths_off_m"] == usual["told"]["lengths_off_m"][:5]
        assert tables["rough"]["samples_hz"] == 1000.0
        assert tables["rough"]["drive"]["stop_spread_deg"] == 360.0
        assert 5 <= sum(came(tables, one) for one in MILD) <= 8
        scenario_of(dict(tables))


def came(tables: object, mild: object) -> bool:
    """Whether the keys of a disturbance are there."""
    if not isinstance(mild, dict):
        return True
    return isinstance(tables, dict) and all(key in tables and came(tables[key], mild[key]) for key in mild)


def test_a_verdict_names_shares_intervals_and_bounds() -> None:
    assert count_steps(10, 3, 1) == 10 + 2 * 3
    none = np.zeros(2, np.bool_)
    day = day_row("a day", [NodeDay(0.03 if k == 0 else 0.0, none, none) for k in range(20)])
    rig = rig_row(RIGS[0], [RigDay(np.array([1.0]), ON_TARGET)])
    first, second = verdict_lines({"cases": [day], "rig_cases": [rig]})
    assert first == (
        "a day: 5.0 % (0.9 to 23.6) of seeds leave more than 2 % untold, at most 3 is missed; "
        "0.0 % (0.0 to 16.1) of surveys beyond 3 sigma untold, at most 1 holds"
    )
    assert second == (
        "a bad day, 2 deg of lean, known as in set-up: 0.0 % (0.0 to 79.3) of stations beyond 3 sigma untold, "
        "at most 1 holds"
    )
