"""Whether a rig is well, from plain values: each alarm that may stand stands for its reason alone."""

from types import SimpleNamespace
from typing import Any

import pytest

from borechain.gauntlet import wellness
from borechain.gauntlet.gauntlet_rig import BIAS_AFTER
from sim.gauntlet.expected_doubts import EXPECTED
from sim.gauntlet.fault import TUBES
from sim.gauntlet.faulty_world import TUBE_LENGTH
from telemetry.messages import BASE

END = 9.0  # m, of the bit, where the last stop is
DRILLED_ON, STOPPED, LEFT = 700.0, 800.0, 830.0  # s, of the last drilling and of the last stop
MISLEADS_DEPTH = next(name for name, one in EXPECTED.items() if one.misleads == "depth")
ANOTHER = next(name for name, one in EXPECTED.items() if one.misleads != "depth")


def place(tube: int, bit: float = END) -> float:
    return bit - TUBE_LENGTH * (tube - 1)


def survey(tube: int, md: float | None = None, trust: str = "full") -> dict[str, Any]:
    return {"tube": tube, "md_m": place(tube) if md is None else md, "trust": trust}


def well_rig(**change: Any) -> Any:
    """A rig of which all is well: each tube surveyed the last stop and is believed."""
    answers = {
        "alarms": {"rig": change.pop("alarms", [])},
        "verdict": {"doubts": change.pop("doubts", ["setup", "unchecked"])},
        "measurements": {"measurements": change.pop("surveys", [survey(tube) for tube in TUBES])},
    }  # fmt: skip
    phases = [
        SimpleNamespace(kind=kind, start=begin, end=end)
        for kind, begin, end in (("drill", 100.0, 130.0), ("drill", DRILLED_ON, STOPPED), ("stop", STOPPED, LEFT))
    ]
    world = {"deceptions": (), "odd": {}, "slipped": False, "spoiled": False, "bit_depth": lambda _: END, "end": 900.0}
    world |= {name: change.pop(name) for name in tuple(change) if name in world}
    usual: dict[str, Any] = {
        "off": set(), "forgot_at": {}, "spoiled_until": {}, "stepper": SimpleNamespace(processes={}), "ground": None,
        "now": 900.0, "disk": lambda _: SimpleNamespace(handled=False),
        "inline": SimpleNamespace(ask=answers.__getitem__), "world": SimpleNamespace(**world, phases=phases),
    }  # fmt: skip
    return SimpleNamespace(**{**usual, **change})


def unwell(**change: Any) -> list[str]:
    return list(wellness.still_unwell(well_rig(**change)))


def alarm(code: str, subject: str, detail: str = "", level: str = "bad") -> dict[str, Any]:
    return {"code": code, "subject": subject, "detail": detail, "level": level}


def test_a_rig_that_is_well_says_nothing_and_each_thing_that_is_not_is_said() -> None:
    assert unwell() == []
    assert unwell(off={4, 2}) == ["without power: [2, 4]"]
    assert unwell(doubts=["setup", "clock", "stale"]) == ["the verdict is not live: clock, stale"]
    rows = [alarm("clock", "tube 3"), alarm("disk", "database"), alarm("tube_silent", "tube 2", level="notice")]
    assert unwell(alarms=rows) == ["still stand: clock of tube 3, disk of database"]


def test_every_tube_has_surveyed_the_last_stop_once_and_is_believed() -> None:
    usual = {tube: survey(tube) for tube in TUBES}
    first = min(TUBES)
    others = [one for tube, one in usual.items() if tube != first]
    assert unwell(surveys=others) == [f"tube {first}: no survey at the last stop"]
    twice = [*others, survey(first), survey(first, trust="unknown_yaw")]
    assert unwell(surveys=twice) == [f"tube {first}: full and unknown_yaw at the last stop"]
    assert unwell(surveys=[*others, survey(first, trust="undated")]) == [f"tube {first}: undated at the last stop"]
    assert unwell(surveys=[*others, survey(first), survey(first, md=3.0, trust="undated")]) == []
    assert unwell(surveys=others, forgot_at={first: 899.0}) == []
    assert unwell(surveys=others, deceptions=(MISLEADS_DEPTH,)) == []
    assert unwell(surveys=others, deceptions=(ANOTHER,)) == [f"tube {first}: no survey at the last stop"]


@pytest.mark.parametrize(
    ("since", "until", "is_odd"),
    [
        (700.0, 899.0, True), (820.0, 899.0, True), (820.9, 830.1, True), (821.0, 899.0, False),  # it was made by then
        (810.0, 829.0, False), (700.0, 790.0, False),  # a second average was made in what was left
    ],
)  # fmt: skip
def test_a_tube_whose_force_is_none_of_gravity_owes_no_survey_but_the_word_of_it(
    since: float, until: float, is_odd: bool
) -> None:
    tube, other = TUBES
    others, odd = [survey(other)], {tube: (since, until)}
    missing = alarm("survey_missing", f"stop at {END:.2f} m, 2/800 s", f"tubes {tube}")
    assert (unwell(surveys=others, odd=odd, alarms=[missing]) == []) == is_odd
    assert unwell(surveys=others, odd=odd) != []
    assert unwell(surveys=others, odd=odd, alarms=[missing | {"detail": f"tubes {tube}, {other}"}]) != []
    earlier = missing | {"subject": "stop at 3.00 m, 2/300 s"}
    assert unwell(surveys=others, odd=odd, alarms=[earlier]) != []
    for quality, is_well in ((["gravity"], True), (["motion"], not is_odd), ([], not is_odd)):
        assert (unwell(surveys=[*others, survey(tube) | {"quality": quality}], odd=odd) == []) == is_well


@pytest.mark.parametrize(
    ("forgot", "spoiled", "is_ready"),
    [
        (DRILLED_ON - BIAS_AFTER, None, True),
        (DRILLED_ON - BIAS_AFTER + 0.1, None, False),
        (100.0, DRILLED_ON - BIAS_AFTER + 0.1, False),
        (100.0, DRILLED_ON - BIAS_AFTER, True),
        (DRILLED_ON - BIAS_AFTER + 0.1, 50.0, False),
    ],
)
def test_a_tube_is_ready_once_it_has_rested_for_its_bias(forgot: float, spoiled: float | None, is_ready: bool) -> None:
    rig = well_rig(forgot_at={2: forgot}, spoiled_until={} if spoiled is None else {2: spoiled})
    assert wellness.unready_tubes(rig) == (set() if is_ready else {2})


def test_doubts_that_a_minute_does_not_take_away() -> None:
    assert unwell(doubts=["yaw", "uncertain", "no_survey"], forgot_at={2: 899.0}) == []
    assert unwell(doubts=["yaw"]) == ["the verdict is not live: yaw"]
    for change in ({"deceptions": (ANOTHER,)}, {"slipped": True}):
        assert unwell(doubts=["contradiction", "uncertain", "depth"], **change) == []
    assert unwell(doubts=["contradiction"], forgot_at={2: 899.0}) == ["the verdict is not live: contradiction"]
    assert unwell(doubts=["yaw"], slipped=True) == ["the verdict is not live: yaw"]


def stands(row: dict[str, Any], **change: Any) -> bool:
    return not wellness._may_stand(well_rig(**change), row)


def test_a_missing_survey_is_of_an_earlier_stop_or_of_a_tube_that_could_make_none() -> None:
    earlier, last = (alarm("survey_missing", f"stop at {md:.2f} m, 4/61 s", "tubes 2, 3") for md in (5.0, END))
    others = [survey(tube) for tube in TUBES if tube not in (2, 3)]
    assert not stands(earlier, surveys=others)
    assert stands(earlier, surveys=[*others, survey(3, place(3, 5.0))])
    assert stands(last, surveys=others)
    assert stands(last, surveys=others, forgot_at={2: 899.0})
    assert not stands(last, surveys=others, forgot_at={2: 899.0, 3: 899.0})
    assert not stands(last, surveys=others, deceptions=(MISLEADS_DEPTH,))
    near = alarm("survey_missing", f"stop at {END + 0.04:.2f} m, 4/61 s", "tubes 2")
    assert stands(near, surveys=others)
    assert not stands(near | {"subject": f"stop at {END + 0.06:.2f} m, 4/61 s"}, surveys=others)


def test_an_untrusted_survey_is_of_an_earlier_stop_or_of_a_tube_that_can_not_know_its_yaw() -> None:
    row = alarm("survey_untrusted", "tube 2")
    assert stands(row)
    assert stands(row, surveys=[survey(2, trust="unknown_yaw")])
    assert not stands(row, surveys=[survey(2, 3.0, "unknown_yaw")])
    assert stands(row, surveys=[survey(3, 3.0, "unknown_yaw")])
    assert stands(row, surveys=[survey(2, 3.0, "undated")])
    assert not stands(row, forgot_at={2: 899.0})


def waiting(tube: int, at: float, epoch: int = 4) -> Any:
    return SimpleNamespace(message=SimpleNamespace(tube=tube, station_at=at, epoch=epoch))


def test_a_survey_without_a_place_is_of_before_the_string_was_drilled_on() -> None:
    """Rig time is 1000 s less than the truth's, so the string was drilled on 200 s ago, at -300 s."""

    def ground(*some: Any) -> Any:
        string = SimpleNamespace(time=SimpleNamespace(epoch=4, rig_now=-100.0))
        return SimpleNamespace(model=SimpleNamespace(string=string, placement=SimpleNamespace(waiting=list(some))))

    row = alarm("survey_unplaced", "tube 2")
    assert not stands(row)
    assert not stands(row, ground=ground(waiting(2, -300.1)))
    assert stands(row, ground=ground(waiting(2, -300.0)))
    assert stands(row, ground=ground(waiting(2, -400.0), waiting(2, -200.0)))
    assert not stands(row, ground=ground(waiting(3, -200.0)))
    assert not stands(row, ground=ground(waiting(2, -200.0, epoch=3)))
    assert not stands(row, ground=ground(waiting(2, -200.0)), deceptions=(MISLEADS_DEPTH,))


@pytest.mark.parametrize(
    ("row", "reason", "other"),
    [
        (alarm("survey_set_aside", "tube 2"), {"spoiled": True}, {"slipped": True}),
        (alarm("tube_sensor", "tube 2"), {"forgot_at": {2: 899.0}}, {"forgot_at": {3: 899.0}}),
        (alarm("blunder", "tube 2"), {"deceptions": (ANOTHER,)}, {"spoiled": True}),
        (alarm("joint", "joint of tubes 2 and 1"), {"deceptions": (ANOTHER,)}, {"slipped": True}),
        (alarm("depth_contradicts", "depth"), {"deceptions": (MISLEADS_DEPTH,)}, {"deceptions": (ANOTHER,)}),
        (
            alarm("numbers_lost", "tube 2"),
            {"disk": lambda address: SimpleNamespace(handled=address == BASE)},
            {"disk": lambda address: SimpleNamespace(handled=address == 200)},
        ),
        (
            alarm("numbers_lost", "tube 2"),
            {"disk": lambda address: SimpleNamespace(handled=address == max(TUBES))},
            {"spoiled": True},
        ),
    ],
)
def test_an_alarm_stands_for_its_own_reason(row: dict[str, Any], reason: Any, other: Any) -> None:
    assert not stands(row, **reason)
    assert stands(row, **other)
    assert stands(row)


def test_numbers_are_read_out_of_words() -> None:
    assert wellness._numbers("tubes 2, 13, x4 and 5 m") == [2, 13, 5]
