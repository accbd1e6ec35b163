"""The setup: what is told with its sigma turns the surveys, is kept before it counts, and one order takes it back."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hand_fed import FOLLOWED, TOLD, Rig
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tapes import write
from told_rig import azimuths, drilled, item, order, started_again

from groundstation.config import checked_config
from groundstation.errors import ConfigurationError, SelectorError, StoreError
from groundstation.recording.ground_replay import replay_file
from groundstation.recording.recording_file import Recording
from groundstation.service.setup.setup_book import SetupBook
from groundstation.service.setup.setup_correction import chain_of, corrected_yaw
from groundstation.service.setup.setup_items import setup_items
from groundstation.service.setup.setup_priors import SetupPriors, setup_priors
from groundstation.service.setup.told_value import (
    DamagedSetupError,
    SetupKind,
    ToldValue,
    told_of_text,
    told_to_text,
)
from telemetry.errors import CommandError
from telemetry.messages import NodeFlag

NOTHING_TOLD = dict.fromkeys(TOLD)
ANY_YAW = math.pi**2 / 3.0  # rad^2, second moment of an angle that is uniform on the circle


def test_without_north_the_answer_is_dont_know_with_its_name(tmp_path: Path) -> None:
    rig = drilled(tmp_path, north_std_deg=None)
    verdict = rig.ask("verdict")
    assert (verdict["verdict"], verdict["doubts"]) == ("dont_know", ["setup", "uncertain"])
    assert verdict["line"] == "DON'T KNOW: not told: north"
    setup = rig.ask("setup")
    assert (setup["ready"], setup["missing"]) == (False, ["north"])
    assert setup["todo"].startswith("tell north: cmd/north?action=tell")
    assert setup["items"][0]["item"] == "north"
    order(rig, "north", action="tell", angle_deg=0, sigma_deg=0.1)
    assert rig.ask("verdict")["verdict"] == verdict["by_surveys"]


@pytest.mark.parametrize("action", ["tell", "check"])
def test_a_bearing_of_the_encoders_zero_answers_the_alarm_that_it_may_have_slipped(tmp_path: Path, action: str) -> None:
    rig = drilled(tmp_path, north_std_deg=0.2)
    rig.ground.model.rig_alarms.alert("reference", "encoder", "tubes 1, 2 at 1007 s")
    order(rig, "stick_up", action="tell", height_m=0.1, sigma_m=0.01)
    assert "reference" in rig.alarms()
    order(rig, "north", action=action, angle_deg=0, sigma_deg=0.1)
    assert "reference" not in rig.alarms()


@pytest.mark.parametrize("north_deg", [30.0, -170.0, 359.0])
def test_north_turns_every_survey_of_before_and_is_taken_back(tmp_path: Path, north_deg: float) -> None:
    rig = drilled(tmp_path, 3)
    before, toe = rig.ask("stations")["stations"], rig.ask("trajectory")["points"][-1]
    detail = order(rig, "north", action="tell", angle_deg=north_deg, sigma_deg=0.2)
    assert detail.startswith(f"north is {north_deg:g} ± 0.2 deg; 3 surveys were adjusted to it")
    assert azimuths(rig) == pytest.approx([north_deg % 360.0] * 3, abs=1e-9)
    turned, closure = rig.ask("trajectory")["points"][-1], math.hypot(toe["north_m"], toe["east_m"])
    assert math.hypot(turned["north_m"], turned["east_m"]) == pytest.approx(closure, rel=1e-9)
    assert order(rig, "setup", action="undo").startswith("north is taken back; 3 surveys were adjusted")
    assert rig.ask("stations")["stations"] == before


def test_told_before_or_after_the_surveys_is_the_same_and_so_is_a_start_upon_the_database(tmp_path: Path) -> None:
    early = Rig(tmp_path / "early", target=20.0)
    early.run(5.0)
    order(early, "north", action="tell", angle_deg=12.5, sigma_deg=0.2)
    for stop in (1, 2):
        early.drill(stop, 2.0)
    late = drilled(tmp_path / "late")
    order(late, "north", action="tell", angle_deg=12.5, sigma_deg=0.2)
    assert early.ask("stations")["stations"] == late.ask("stations")["stations"]
    shown = late.ask("trajectory")["points"]
    assert started_again(late).ask("trajectory")["points"] == shown
    assert item(late, "north")["by"] == "anna"


def test_a_node_that_was_not_told_its_joint_is_named_and_its_azimuth_is_right_once_it_is(tmp_path: Path) -> None:
    """The hole leans to 240 deg: the joint has 70 deg that the yaws of tube 1 lack."""
    rig = Rig(tmp_path, target=20.0, **FOLLOWED)
    rig.untold = {2: NodeFlag.LOWER_UNTOLD}
    rig.run(5.0)
    rig.drill(1, 2.0)
    rig.yaw, rig.systematic_var = math.radians(170.0), ANY_YAW + math.radians(0.05) ** 2
    rig.drill(2, 2.0)
    verdict, missing = rig.ask("verdict"), rig.ask("setup")["missing"]
    assert missing == ["joint.2-1"]
    assert verdict["doubts"][0] == "setup"
    assert verdict["why"][0] == "not told: joint 2-1"
    second = rig.ask("stations")["stations"][1]
    assert second["sigma_azimuth_deg"] > 100.0
    order(rig, "joint", tube=1, angle_deg=70.0, sigma_deg=0.3)
    second = rig.ask("stations")["stations"][1]
    assert second["azimuth_deg"] == pytest.approx(240.0, abs=1e-6)
    assert 0.3 < second["sigma_azimuth_deg"] < 0.5
    assert rig.ask("setup")["ready"]
    assert "setup" not in rig.ask("verdict")["doubts"]
    assert started_again(rig).ask("stations")["stations"][1] == second


def test_a_tube_that_hung_from_the_head_by_a_joint_that_was_not_told_is_missed_too(tmp_path: Path) -> None:
    """Its survey of then is still in the hole when another tube hangs there."""
    rig = Rig(tmp_path, target=20.0)
    rig.untold = {1: NodeFlag.DRIVE_UNTOLD}
    rig.yaw, rig.systematic_var = math.radians(170.0), ANY_YAW + math.radians(0.05) ** 2
    rig.run(5.0)
    rig.drill(1, 2.0)
    rig.untold, rig.yaw, rig.systematic_var = {}, math.radians(200.0), 1e-8
    rig.drill(2, 2.0)
    assert rig.ask("setup")["missing"] == ["joint.drive-1"]
    order(rig, "joint", tube=1, upper=0, angle_deg=30.0, sigma_deg=0.3)
    assert azimuths(rig) == pytest.approx([200.0, 200.0], abs=1e-6)
    assert rig.ask("setup")["ready"]


def test_a_joint_that_its_node_was_told_is_corrected_by_what_it_was_told(tmp_path: Path) -> None:
    rig = drilled(tmp_path, **FOLLOWED)
    with pytest.raises(SelectorError, match=r"joint 2-1: the node of tube 2 was told its angle.*; expected used_deg"):
        order(rig, "joint", tube=1, angle_deg=12.0, sigma_deg=0.1)
    order(rig, "joint", tube=1, angle_deg=12.0, sigma_deg=0.1, used_deg=10.0)
    assert azimuths(rig) == pytest.approx([0.0, 2.0], abs=1e-6)  # the first stop was made when it hung from the head
    assert item(rig, "joint.2-1")["detail"] == "by anna, its node computes by 10 deg"


def test_a_joint_told_twice_is_told_back_and_both_are_kept(tmp_path: Path) -> None:
    rig = drilled(tmp_path, **FOLLOWED)
    order(rig, "joint", tube=1, angle_deg=12.0, sigma_deg=0.1, used_deg=10.0)
    detail = order(rig, "joint", tube=1, angle_deg=13.0, sigma_deg=0.2, used_deg=10.0)
    assert "joint.2-1 is 13 ± 0.2 deg" in detail
    assert "before it was 12 ± 0.1 deg by anna, which is kept too" in detail
    assert [told.values for told in rig.ground.store.told()] == [(math.radians(12.0),), (math.radians(13.0),)]
    assert item(rig, "joint.2-1")["times_told"] == 2
    order(rig, "setup", action="undo")
    assert item(rig, "joint.2-1")["value"] == [pytest.approx(12.0)]
    order(rig, "setup", action="undo")
    assert azimuths(rig) == pytest.approx([0.0, 0.0], abs=1e-9)
    with pytest.raises(SelectorError, match="there is nothing to take back"):
        order(rig, "setup", action="undo")


@pytest.mark.parametrize(
    ("name", "parameters", "expected"),
    [
        ("joint", {"tube": 7, "angle_deg": 1, "sigma_deg": 1}, "tube 7: not in the string; expected one of 2, 1"),
        ("joint", {"tube": 1, "angle_deg": 1, "sigma_deg": 1, "upper": 5}, "joint 2-1 above tube 1, or upper=0"),
        ("length", {"tube": 9, "length_m": 2, "sigma_m": 0.01}, "tube 9: not in the string"),
        ("length", {"tube": 1, "length_m": -2, "sigma_m": 0.01}, "parameter length_m: expected 0.1..20, got '-2'"),
        ("north", {"action": "tell", "angle_deg": 1, "sigma_deg": 0}, r"sigma_deg: expected 0.0001..180, got '0'"),
        ("north", {"action": "tell", "angle_deg": 1}, r"expected cmd/north\?action=tell;angle_deg=..;sigma_deg=.."),
        ("north", {"angle_deg": 1, "sigma_deg": 1}, r"expected cmd/north\?action=tell\|check, got ''"),
        ("collar", {"action": "tell", "inclination_deg": 200, "azimuth_deg": 0, "sigma_deg": 1}, "expected 0..180"),
        ("setup", {"action": "undo"}, "there is nothing to take back"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_a_line_and_nothing_is_kept(
    tmp_path: Path, name: str, parameters: dict[str, Any], expected: str
) -> None:
    rig = drilled(tmp_path)
    before = rig.ask("stations")["stations"]
    with pytest.raises(SelectorError, match=expected):
        order(rig, name, **parameters)
    assert rig.ground.store.told() == []
    assert rig.ask("stations")["stations"] == before


@pytest.fixture(scope="module")
def lasting(tmp_path_factory: pytest.TempPathFactory) -> Rig:
    return drilled(tmp_path_factory.mktemp("ground"), 1)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    angle=st.floats(-1e4, 1e4) | st.sampled_from([math.nan, math.inf, 0.0]),
    sigma=st.floats(-1.0, 400.0) | st.sampled_from([math.nan, -math.inf, 0.0, 1e-9]),
)
def test_any_north_is_taken_whole_or_refused_whole(lasting: Rig, angle: float, sigma: float) -> None:
    kept, book = len(lasting.ground.store.told()), lasting.ground.model.setup
    version = book.version
    is_right = abs(angle) <= 360.0 and 1e-4 <= sigma <= 180.0
    try:
        order(lasting, "north", action="tell", angle_deg=repr(angle), sigma_deg=repr(sigma))
    except SelectorError:
        assert not is_right
        assert (len(lasting.ground.store.told()), book.version) == (kept, version)
        return
    assert is_right
    assert len(lasting.ground.store.told()) == kept + 1
    assert azimuths(lasting)[0] == pytest.approx(angle % 360.0, abs=1e-6) or angle % 360.0 > 359.99


@given(
    kind=st.sampled_from([SetupKind.NORTH, SetupKind.STICK_UP]),
    value=st.floats(-7.0, 7.0),
    sigma=st.floats(1e-6, 3.0),
    by=st.text(min_size=1, max_size=20),
    used=st.none() | st.floats(-6.0, 6.0),
)
def test_what_was_told_comes_back_from_its_text(
    kind: SetupKind, value: float, sigma: float, by: str, used: float | None
) -> None:
    told = ToldValue(3, kind, "", (value,), sigma, by, "2026-01-01T00:00:00.000+00:00", used)
    assert told_of_text(told_to_text(told)) == told


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"kind": "north"}', told_to_text(
    ToldValue(1, SetupKind.JOINT, "4 to 3", (1.0,), 1.0, "anna", "")
), told_to_text(ToldValue(1, SetupKind.NORTH, "", (math.nan,), 1.0, "anna", ""))])  # fmt: skip
def test_a_damaged_text_is_no_value(text: str) -> None:
    with pytest.raises(DamagedSetupError, match="of the setup, got"):
        told_of_text(text)


def test_a_disk_that_refuses_is_told_and_nothing_counts(tmp_path: Path) -> None:
    rig = drilled(tmp_path)
    before = rig.ask("stations")["stations"]
    (tmp_path / "ground.sqlite").rename(tmp_path / "elsewhere.sqlite")
    with pytest.raises(StoreError, match="was removed or replaced"):
        order(rig, "north", action="tell", angle_deg=30, sigma_deg=0.1)
    assert rig.ask("stations")["stations"] == before
    assert rig.ground.model.setup.entries == []


def test_a_collar_that_the_first_station_contradicts_is_told_back(tmp_path: Path) -> None:
    rig = drilled(tmp_path)
    detail = order(rig, "collar", action="tell", inclination_deg=9, azimuth_deg=180, sigma_deg=0.1)
    assert "the station at 2.0 m contradicts it by" in detail
    assert "it leans 2.00 deg to 0 deg" in detail
    detail = order(rig, "collar", action="tell", inclination_deg=2, azimuth_deg=0, sigma_deg=0.1)
    assert "contradicts" not in detail
    toe = rig.ask("trajectory")["points"][-1]
    assert toe["north_m"] == pytest.approx(4.0 * math.sin(math.radians(2.0)), rel=1e-6)


def test_a_longer_tube_below_lifts_what_was_surveyed_above_it(tmp_path: Path) -> None:
    rig = drilled(tmp_path, 1)
    rig.speak(2)
    rig.depth(4.0)
    rig.survey(2, 1)
    rig.speak(2)
    assert [row["md_m"] for row in rig.ask("stations")["stations"]] == [2.0]
    order(rig, "length", tube=1, length_m=2.3, sigma_m=0.005)
    assert [row["md_m"] for row in rig.ask("stations")["stations"]] == pytest.approx([1.7, 2.0])
    order(rig, "stick_up", action="tell", height_m=0.5, sigma_m=0.01)
    assert [row["md_m"] for row in rig.ask("stations")["stations"]] == pytest.approx([1.2, 1.5])


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        ({"north_deg": 3.0}, "expected north_std_deg beside the value that it is of"),
        ({"collar_inclination_deg": 3.0}, "expected collar_std_deg beside"),
        ({"stick_up_m": 0.3}, "expected stick_up_std_m beside"),
        ({"north_std_deg": 0.0}, "north_std_deg: Input should be greater than 0"),
        ({"joints": [["4-x", 1.0, 0.1]]}, "joints.0.0: String should match pattern"),
        ({"joints": [["4-3", 1.0, 0.0]]}, "joints.0.2: Input should be greater than 0"),
    ],
)
def test_a_configuration_tells_with_a_sigma_or_not_at_all(tmp_path: Path, told: dict[str, Any], expected: str) -> None:
    with pytest.raises(ConfigurationError, match=expected):
        checked_config(folder=tmp_path, **told)


def test_the_configuration_tells_where_no_order_did(tmp_path: Path) -> None:
    rig = drilled(tmp_path, north_deg=40.0, north_std_deg=0.5, joints=[["2-1", 5.0, 0.1]])
    assert azimuths(rig) == pytest.approx([40.0, 40.0], abs=1e-6)  # the nodes say that they were told their joints
    assert item(rig, "north")["detail"] == "configuration"
    order(rig, "north", action="tell", angle_deg=50, sigma_deg=0.1)
    assert azimuths(rig) == pytest.approx([50.0, 50.0], abs=1e-6)
    order(rig, "setup", action="undo")
    assert azimuths(rig) == pytest.approx([40.0, 40.0], abs=1e-6)


def test_every_command_of_the_setup_has_a_sigma_and_no_setup_command_goes_to_a_tube() -> None:
    from telemetry.application.commands import ObeyedBy, find_command

    for name, action in (("north", "tell"), ("collar", "tell"), ("joint", ""), ("length", ""), ("stick_up", "tell")):
        spec = find_command(name, action)
        assert spec.by is ObeyedBy.GROUND
        sigma = next(one for one in spec.arguments if one.quantity.name == "sigma")
        assert sigma.needed
        assert sigma.quantity.low > 0.0
    with pytest.raises(CommandError):
        find_command("setup", "forget")


def test_a_recording_repeats_what_was_told(tmp_path: Path) -> None:
    rig = drilled(tmp_path / "ground")
    order(rig, "north", action="tell", angle_deg=12.5, sigma_deg=0.2)
    order(rig, "joint", tube=1, angle_deg=3.0, sigma_deg=0.1, used_deg=1.0)
    order(rig, "setup", action="undo")
    write(tmp_path / "shift.mcap", rig.ground)
    again = replay_file(Recording(tmp_path / "shift.mcap"), tmp_path / "again").ground
    assert again.operator.ask("stations")["stations"] == rig.ask("stations")["stations"]
    assert [told.name for told in again.store.told()] == ["north", "joint.2-1", "joint.2-1"]
    again.close()


def test_priors_are_one_frozen_record_by_name(tmp_path: Path) -> None:
    """What nothing tells has a sigma that is wide enough to be true, and what is told its own."""
    rig = drilled(tmp_path, **NOTHING_TOLD)
    model = rig.ground.model

    def priors() -> SetupPriors:
        return setup_priors(setup_items(model.config, model.setup, model.string), model.setup.version)

    before = priors()
    assert before.by_name["north"].sigma == pytest.approx(math.sqrt(ANY_YAW))
    assert before.by_name["north"].mean == ()
    assert before.by_name["collar"].sigma == pytest.approx(math.radians(1.0))
    assert before.by_name["mount.2"].sigma == pytest.approx(math.radians(0.5))
    expected = {"joint.2-1", "joint.drive-2", "joint.drive-1", "length.1", "stick_up", "depth_scale"}
    assert expected <= before.by_name.keys()
    assert {"accelerometer.1", "gyroscope.2", "mount_turn.1", "play", "path", "gravity"} <= before.by_name.keys()
    order(rig, "north", action="tell", angle_deg=12.5, sigma_deg=0.2)
    after = priors()
    assert after.version > before.version
    assert after.by_name["north"].mean == (pytest.approx(math.radians(12.5)),)
    assert after.by_name["north"].sigma == pytest.approx(math.radians(0.2))
    assert all(prior.sigma > 0.0 for prior in after.by_name.values())
    with pytest.raises(AttributeError):
        after.version = 7  # type: ignore[misc]


@given(st.data())
def test_a_yaw_has_the_angles_and_the_errors_of_the_joints_above_it_each_by_itself(data: st.DataObject) -> None:
    """Whatever was told to nodes and to the ground station, beside sums that a node's bound does not touch."""
    count = data.draw(st.integers(1, 6))
    by_node = data.draw(st.lists(st.booleans(), min_size=count, max_size=count))  # from the drive head down
    by_ground = data.draw(st.lists(st.booleans(), min_size=count, max_size=count))
    angles = data.draw(st.lists(st.floats(-3.0, 3.0), min_size=count, max_size=count))
    book = SetupBook(checked_config(folder=Path("unused")))
    tubes, sigma, mark, mount = list(range(count, 0, -1)), 0.01, math.radians(0.05), 1e-6
    for place, tube in enumerate(tubes):
        drive = NodeFlag.NONE if place or by_node[0] else NodeFlag.DRIVE_UNTOLD
        lower = NodeFlag.NONE if tube == 1 or by_node[place + 1] else NodeFlag.LOWER_UNTOLD
        book.on_flags(tube, place + 1, drive | lower)
    names = [f"drive-{count}", *(f"{tube + 1}-{tube}" for tube in tubes[1:])]
    told = [place for place in range(count) if by_ground[place] and not by_node[place]]
    book.add(
        ToldValue(number, SetupKind.JOINT, names[place], (angles[place],), sigma, "anna", "")
        for number, place in enumerate(told, 1)
    )
    said, turn, var = mount, 0.0, mount
    for place, tube in enumerate(tubes):
        said = min(said - mount + (mark**2 if by_node[place] else ANY_YAW), ANY_YAW) + mount  # as nodes hand it down
        turn += angles[place] if place in told else 0.0
        var += mark**2 if by_node[place] else sigma**2 if place in told else ANY_YAW
        found = corrected_yaw(said, chain_of(tube, tubes[:place][::-1]), book)
        assert found[0] == pytest.approx(turn, abs=1e-12)
        assert found[1] == pytest.approx(var, rel=1e-9)
