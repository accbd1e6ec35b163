"""When a survey gets its depth: on arrival where that is known, so that one transaction is enough; and once only."""

import contextlib
from collections.abc import Iterator
from pathlib import Path

import pytest
import sqlalchemy as sa
from hand_fed import COV, Rig

from borechain.load.placing_calls import CALLS_AT_MOST, TUBES, count_placing_calls
from groundstation.survey.fusion.fusion import Weighting
from telemetry.messages import DepthReading, ImuMean, NodeFlag, Stand, SurveyMeasurement
from telemetry.presentation.msgpack_codec import encode_message

HERE, THERE = 2.0, 2.5  # m


@pytest.fixture
def rig(tmp_path: Path) -> Iterator[Rig]:
    """One tube, at rest."""
    rig = Rig(tmp_path)
    rig.run(3.0)
    rig.speak(1)
    rig.depth(HERE)
    yield rig
    rig.ground.close()


def take(rig: Rig, sequence: int, at: float) -> None:
    """A survey of ``at`` (s) comes, and is acknowledged."""
    imus = (ImuMean((0.0, 0.0, -9.81), COV),)
    rig.ground.on_message(
        SurveyMeasurement(1, sequence, at, 1, imus, 0.0, 1e-8, 1e-8, 32, 20.0, NodeFlag.NONE), rig.now
    )
    rig.ground.before_frames()


def stored(rig: Rig) -> list[float | None]:
    """Depths (m) of the surveys as the database has them."""
    return [one.md for one in rig.ground.store.messages()]


@contextlib.contextmanager
def statements(rig: Rig) -> Iterator[list[str]]:
    """First words of what is asked of the database meanwhile."""
    seen: list[str] = []

    def note(_connection: object, _cursor: object, statement: str, *_rest: object) -> None:
        seen.append(statement.split(maxsplit=1)[0])

    engine = rig.ground.store._engine
    sa.event.listen(engine, "before_cursor_execute", note)
    yield seen
    sa.event.remove(engine, "before_cursor_execute", note)


def test_a_depth_that_is_known_is_stored_with_its_survey_and_not_again(rig: Rig) -> None:
    with statements(rig) as written:
        take(rig, 1, rig.now)
        assert stored(rig) == [HERE]
        rig.now += 0.5
        rig.read_depth(HERE)
    assert "UPDATE" not in written
    assert rig.ground.model.newest_row("measurements") == 1
    assert rig.ground.model.placement.waiting == []


def test_a_depth_that_is_not_known_yet_is_stored_when_it_is(rig: Rig) -> None:
    take(rig, 1, rig.now + 0.25)
    assert stored(rig) == [None]
    rig.now += 0.5
    rig.read_depth(HERE)
    assert stored(rig) == [HERE]
    assert rig.ground.model.newest_row("measurements") == 1


def test_a_depth_that_is_doubted_before_the_survey_is_fused_is_taken_back(rig: Rig, tmp_path: Path) -> None:
    """After a start the depth of an older survey is that of a stand, which another stand may contradict."""
    at = rig.now - 0.75
    rig.ground.close()
    again = Rig(tmp_path)
    again.now, again.md, again.source = rig.now, rig.md, rig.source
    again.tube, again.hops = rig.tube, rig.hops
    again.run(3.0)
    again.speak(1)
    take(again, 1, at)
    assert stored(again) == [HERE]
    epoch, model = again.ground.model.string.time.epoch, again.ground.model
    other = Stand(epoch, at - 0.25, at + 0.25, THERE)
    again.now += 0.5
    again.ground.on_depth(encode_message(DepthReading(1000, again.now, HERE, (other,), epoch)), again.now)
    assert stored(again) == [None]
    assert [one.md for one in model.placement.waiting] == [None]
    assert model.newest_row("measurements") == 0
    again.ground.close()


@pytest.mark.slow
@pytest.mark.parametrize("weighting", [*CALLS_AT_MOST])
def test_one_more_measurement_is_placed_in_few_calls(tmp_path: Path, weighting: Weighting) -> None:
    """From the arrival of its message to the hole that is worked out; the last tube of a stop costs as the first."""
    counts = count_placing_calls(tmp_path, weighting)
    assert len(counts) == TUBES
    assert CALLS_AT_MOST[Weighting.BAYES] == 300
    assert max(counts) <= CALLS_AT_MOST[weighting]
    assert counts[-1] - min(counts) < 30
