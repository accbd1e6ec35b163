"""The client on a real bus: typed answers, streams without gaps or doubles, errors in a line, and the examples."""

import dataclasses
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import playwright
import pytest
from hand_fed import Rig
from page_client import free_port
from served import Served, serving

from borechain.client import (
    Alarm,
    AnsweredVerdict,
    AnswerError,
    Ground,
    NoAnswerError,
    Off,
    Order,
    RefusedError,
    Station,
    Steer,
    connect_to_ground,
    live_rigs,
    shape_answer,
)
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.service.answers.answer_table import ANSWERS
from groundstation.service.answers.shapes.answer_fields import Fields, fields_of_answer
from telemetry.media.zenoh_bus import open_client

pytestmark = pytest.mark.slow
EXAMPLES = Path(__file__).parents[1] / "examples"
NODE = Path(playwright.__file__).parent / "driver" / "node"  # the Node.js that comes with the browser's driver


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    rig = Rig(tmp_path_factory.mktemp("ground"), target=20.0)
    rig.run(5.0)
    for stop, inclination_deg in ((1, 0.3), (2, 0.3), (3, 2.2)):
        rig.drill(stop, inclination_deg)
    with serving(rig, PageSettings("127.0.0.1", free_port())) as served:
        yield served


@pytest.fixture
def ground(served: Served) -> Iterator[Ground]:
    with connect_to_ground(served.endpoint, timeout=10.0) as ground:
        yield ground


@pytest.mark.parametrize(
    ("shape", "answer"),
    [
        (AnsweredVerdict, ANSWERS["verdict"].fields),
        (Alarm, fields_of_answer(Alarm)),
        (Station, fields_of_answer(ANSWERS["stations/{n}"].shape)),
        (Order, fields_of_answer(ANSWERS["orders/{n}"].shape)),
    ],
)
def test_every_type_has_only_fields_that_its_key_promises(shape: type, answer: Fields) -> None:
    promised = {field.name: field for field in answer}
    assert {field.name for field in dataclasses.fields(shape)} <= promised.keys()
    for name, part in (("off", Off), ("steer", Steer)):
        if shape is AnsweredVerdict:
            assert [field.name for field in dataclasses.fields(part)] == [f.name for f in promised[name].fields]


def test_answers_have_their_types(ground: Ground) -> None:
    verdict = ground.verdict()
    assert verdict.by_surveys == "out"  # bent by 1 deg/m over the last leg: no correction is likely to bring it back
    assert (type(verdict), type(verdict.off), type(ground.alarms()[0])) == (AnsweredVerdict, Off, Alarm)
    assert verdict.utc.endswith("+00:00")
    assert verdict.off is not None
    assert verdict.off.wind == "N"
    assert [station.md_m for station in ground.stations()] == [2.0, 4.0, 6.0]
    assert "projection" in {alarm.code for alarm in ground.alarms()}


def test_a_stream_gives_each_row_once_from_the_first_on_and_goes_on(ground: Ground, served: Served) -> None:
    served.happen()
    served.happen()
    rows = ground.stream("events", timeout=20.0)
    seen = [next(rows)["seq"], next(rows)["seq"]]
    served.happen()
    served.happen()
    seen += [next(rows)["seq"], next(rows)["seq"]]
    assert seen == [1, 2, 3, 4]
    assert [row["seq"] for row in ground.stream("events", since=2, timeout=0.1)] == [3, 4]


def test_an_order_has_its_outcome_and_a_wrong_one_is_refused(ground: Ground) -> None:
    number = next(alarm.number for alarm in ground.alarms() if alarm.code == "projection")
    done = ground.order("alarm", "anna", action="acknowledge", number=number)
    assert (done.state, done.done, done.by) == ("done", True, "anna")
    with pytest.raises(RefusedError, match="anna has acknowledged it"):
        ground.order("alarm", "bert", action="acknowledge", number=number)
    with pytest.raises(RefusedError, match="no stream; expected one of events"):
        next(ground.stream("status"))


def test_another_rig_is_told_which_live(served: Served) -> None:
    with open_client(served.endpoint, timeout=10.0) as bus:
        assert live_rigs(bus) == ["rig-1"]
        with pytest.raises(NoAnswerError, match="rigs with a ground station: rig-1"):
            Ground(bus, "rig-7").verdict()


def test_an_answer_of_an_older_ground_station_is_named() -> None:
    with pytest.raises(
        AnswerError, match="Steer: the answer lacks wind, before_md_m, left_m, missed, sure_percent, best_percent"
    ):
        shape_answer(Steer, {"azimuth_deg": 1.0})


def lines_of(*words: str | Path) -> list[str]:
    """What an example prints."""
    done = subprocess.run([*map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_the_example_in_python_runs(served: Served) -> None:
    lines = lines_of(sys.executable, EXAMPLES / "follow_a_rig.py", served.endpoint, "rig-1", "0.2")
    assert lines[1].startswith("tube 1 at 2.0 m: 0.30 deg")
    assert len([line for line in lines if line.startswith("tube 1 at")]) == 3
    assert any(line.startswith("alarm ") and "projection" in line for line in lines)


def test_the_example_in_javascript_runs_in_node(served: Served) -> None:
    assert served.page is not None
    lines = lines_of(NODE, EXAMPLES / "follow_a_rig.mjs", served.page.url, "1")
    assert [line for line in lines if line.startswith("tube 1 at")] == [
        "tube 1 at 2.0 m: 0.30 deg", "tube 1 at 4.0 m: 0.30 deg", "tube 1 at 6.0 m: 2.20 deg",
    ]  # fmt: skip
    assert served.rig.ask("verdict")["line"] in lines
    assert any(line.startswith("alarm ") and "projection" in line for line in lines)
    unanswered = subprocess.run(
        [NODE, EXAMPLES / "follow_a_rig.mjs", f"http://127.0.0.1:{free_port()}"], capture_output=True, check=False
    )
    assert unanswered.returncode == 1
