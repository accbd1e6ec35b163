"""What a node tells at the edges: bounds at exactly their value, lists that are full, and a second time."""

from __future__ import annotations

import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from test_told_figures import AROUND, tube
from test_tube_process import noisy

from node.errors import NodeConfigurationError
from node.firmware.alignment_orders import alignment_in_use, angles_of
from node.firmware.edge_interpolation import UNKNOWN, stopped_at
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading
from node.firmware.torque import TorqueSettings
from node.firmware.tube import Tube
from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from node.kernels.arithmetic.formats import DEG
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.kernels.record.sensor_record import new_mount
from node.kernels.sensors.alignment import CIRCLE
from node.process.encoder_process import EncoderProcess
from node.process.tube_process import TubeProcess
from telemetry.messages import UNKNOWN_YAW_STD, Event, ImuMean, NodeFlag, SurveyMeasurement


@pytest.mark.parametrize(
    ("var", "told"),
    [(0.0, 1e-3 * DEG), (1e-12, 1e-3 * DEG), ((1e-3 * DEG) ** 2, 1e-3 * DEG), (4e-6, 2e-3), (1e4, 10.0)],
)
def test_a_yaw_is_told_no_better_than_a_thousandth_of_a_degree_and_no_worse_than_any(var: float, told: float) -> None:
    one = tube()
    one.state["now_P"][2, 2] = one.state["surveyed_var"] = var
    assert math.sqrt(one.yaw_var) == pytest.approx(told, rel=1e-12)
    for message in (one.reporter.report(1000.0, AROUND, (1, bytes(8))), one.reporter.survey(1000.0, AROUND)):
        assert math.sqrt(message.yaw_var) == pytest.approx(told, rel=1e-12)
    revised = one.reporter.revised_survey(1060.0, AROUND)
    assert revised is not None
    assert math.sqrt(revised.yaw_var) == pytest.approx(told, rel=1e-12)
    assert math.sqrt(one.reporter.estimate(AROUND).yaw_var) == pytest.approx(told, rel=1e-12)


@pytest.mark.parametrize(("number", "is_told", "flagged"), [(1, False, False), (2, False, True), (2, True, False)])
def test_the_lowest_tube_has_no_joint_below_that_it_could_lack(number: int, is_told: bool, flagged: bool) -> None:
    config = default_config()
    lower = MakeUpAngle(0.3, 1e-3) if is_told else MakeUpAngle(std=UNKNOWN_YAW_STD)
    settings = TubeSettings(number, MakeUpAngle(0.5, 1e-3), lower)
    one = Tube(settings, config, new_node(config), iter(range(1, 99)).__next__, restored=False)
    assert (NodeFlag.LOWER_UNTOLD in one.flags(AROUND, 1000.0)) == flagged


def test_a_reading_that_an_imu_of_a_cluster_has_not_given_is_none_and_not_zero() -> None:
    config = default_config()
    settings = TubeSettings(3, imus=(ImuSettings(), ImuSettings(noise=2.0)))
    one = Tube(settings, config, new_node(config), iter(range(1, 99)).__next__, restored=False)
    for k in range(3):
        one.on_cycle(ImuReading(0.5 * k, 0.5 * k + 0.5, (0.1, 0.0, 0.2), (0.0, 1.0, -9.7)), AROUND)
        assert np.isnan(one._readings[1]).all()
        assert one.raw.rate == pytest.approx((0.1, 0.0, 0.2))
        assert one.raw.force == pytest.approx((0.0, 1.0, -9.7))


def test_a_saved_yaw_is_worth_the_time_in_which_a_string_at_rest_may_turn_by_its_sigma() -> None:
    """Var = walk^2 t: by hand, for a sigma of 0.3 deg and a walk of 0.02 deg in a root of a second, 225 s."""
    config = default_config()
    config["still_walk"] = 0.02 * DEG
    nodes = new_node(config)
    state = nodes[0]["filter"]
    state["yaw_known"], state["now_P"][2, 2] = 1, (0.3 * DEG) ** 2
    one = Tube(TubeSettings(3), config, nodes, iter(range(1, 99)).__next__, restored=True)
    told = one.boot_event(0.0).arguments["worth_h"]
    assert isinstance(told, float)
    assert 3600.0 * told == pytest.approx(225.0, rel=1e-6)


def test_an_alignment_is_told_with_pitch_and_roll_of_each_imu_and_the_errors_of_either() -> None:
    mount = new_mount()[0]
    mount["method"] = CIRCLE
    wanted = ((0.03, -0.05, 1e-3, 4e-3), (-0.02, 0.01, 2e-3, 7e-3))
    for k, (pitch, roll, pitch_std, roll_std) in enumerate(wanted):
        mount["axis"][k] = math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)
        mount["std"][k] = pitch_std, roll_std
    found = alignment_in_use(mount, 2)
    for place, name in enumerate(("pitch", "roll", "pitch_std", "roll_std")):
        assert found[name] == pytest.approx(tuple(row[place] for row in wanted), abs=1e-12)
    one = tube()
    one._mount["axis"][0], one._mount["std"][0] = mount["axis"][0], (1e-3, 4e-3)
    assert one.reporter.report(1000.0, AROUND, (1, bytes(8))).alignment == pytest.approx((0.03, -0.05, 4e-3), abs=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_axis_that_rounding_has_made_longer_than_one_has_angles(sign: float) -> None:
    pitch, roll = angles_of(np.array([sign * (1.0 + 2e-16), 0.0, 0.0]))
    assert pitch == pytest.approx(sign * math.pi / 2.0)
    assert roll == 0.0


POWERS, PLACES = (1.5, 2.0, 3.0), (np.arange(32) + 0.5) / 32.0  # of decision 16, and its steps of the place


def least_squares(t: np.ndarray, edge_std: float) -> float:
    """Smallest weighted sum of squares of any power and place, by a solver of its own."""
    smallest = math.inf
    for p, x in itertools.product(POWERS, PLACES):
        y = (np.arange(len(t)) + x) ** (1.0 / p)
        a, late = np.stack([np.ones_like(y), -y, -(y**2)], axis=1), None
        b, g = 1.0 / (y[-1] - y[0]), 0.0
        for _ in range(2):
            slope = np.abs((b + 2.0 * g * y) * y ** (1.0 - p) / p)
            late = edge_std * np.maximum(slope, 1e-9)
            found = np.linalg.lstsq(a / late[:, None], t / late, rcond=None)[0]
            b, g = found[1], found[2]
        smallest = min(smallest, float(np.sum(((a @ found - t) / late) ** 2)))
    return smallest


@pytest.mark.parametrize("edges", [8, 10, 12])
def test_a_stop_fits_up_to_two_and_a_half_times_its_degrees_of_freedom(edges: int) -> None:
    """Three are taken by T, b and g; what is off is put on two edges until the fit is refused."""
    std = 0.05
    sound = np.sqrt(np.arange(edges) + 0.4) / 20.0

    def is_refused(off: float) -> bool:
        moved = sound.copy()
        moved[2], moved[5] = moved[2] + off, moved[5] - off
        return stopped_at(tuple(1e3 - moved), std) == UNKNOWN

    low, high = 0.0, 5e-3
    assert is_refused(high)
    assert not is_refused(low)
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if is_refused(middle) else (middle, high)
    moved = sound.copy()
    moved[2], moved[5] = moved[2] + low, moved[5] - low
    t = -(moved - moved[0]) / (moved[-1] - moved[0])
    assert least_squares(t, std) == pytest.approx(2.5 * (edges - 3), rel=0.03)


@pytest.mark.parametrize(("part", "is_taken"), [(-1e-9, False), (0.0, True), (1.0, True), (1.0 + 1e-9, False)])
def test_all_or_nothing_of_a_torque_may_stay_in_a_released_string(part: float, is_taken: bool) -> None:
    if is_taken:
        assert TorqueSettings(100.0, part).trapped_fraction == part
    else:
        with pytest.raises(NodeConfigurationError, match="trapped_fraction"):
            TorqueSettings(100.0, part)


def survey(tube_number: int, sequence: int) -> SurveyMeasurement:
    cov = ((1e-6, 0.0, 0.0), (0.0, 1e-6, 0.0), (0.0, 0.0, 1e-6))
    imus = (ImuMean((0.1, 0.0, -9.8), cov),)
    return SurveyMeasurement(tube_number, sequence, 100.0, 1, imus, 1.0, 1e-6, 1e-6, 32, 20.0, NodeFlag.NONE, 5)


def test_of_more_surveys_than_go_together_the_earliest_are_sent_again(tmp_path: Path) -> None:
    """A ground station goes on with its next order where the answer ended."""
    process = TubeProcess(TubeSettings(3), tmp_path)
    for sequence in range(1, 71):
        process._keep(survey(3, sequence), 10.0)
    process.endpoint.mail._outbox._parcels.clear()
    begin, sent = 3, []
    while begin <= 70:
        count, complete_from = process._resend(begin, 70)
        sent += [list(process.endpoint.mail._outbox._parcels)[-count:]]
        assert complete_from == 0
        begin += count
    assert sent == [list(range(3, 67)), list(range(67, 71))]


def test_a_queue_that_was_full_is_told_once_and_again_when_more_was_dropped(tmp_path: Path) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    told: list[tuple[object, object]] = []
    process._send_event = lambda _severity, code, arguments: (  # type: ignore[method-assign]
        told.append((arguments["dropped"], arguments["since_start"])) if code == "queue_full" else None
    )
    for minute, dropped in enumerate((0, 3, 3, 3, 10, 10)):
        process.endpoint.mail._outbox.dropped = dropped
        for second in (0.0, 30.0):
            process._report_drops(61.0 * minute + second)
    assert told == [(3, 3), (7, 10)]


def test_numbers_of_an_encoder_go_on_over_every_start(tmp_path: Path) -> None:
    """A tube must take no measurement of a later start for one that it has used."""
    before = 0
    for _ in range(3):
        process = EncoderProcess(tmp_path / "encoder")
        numbers = []
        process.endpoint.send_aiding = lambda aiding, now, kept=numbers: kept.append(aiding.sequence)  # type: ignore[method-assign]
        for k in range(1, 60):
            process.on_cycle([0.5 * k - 0.5, 100 * k, 0.5 * k - 0.1, 1], 0.5 * k)
        assert numbers == sorted(set(numbers))
        assert numbers[0] > before
        before = numbers[-1]


def test_an_event_is_kept_under_the_number_that_it_was_given_once(tmp_path: Path) -> None:
    process = TubeProcess(TubeSettings(3), tmp_path)
    noisy(process, 30)
    process.endpoint.clock.exchanges = 0
    kept: list[Event] = []
    process._keep = lambda said, now: kept.append(said)  # type: ignore[method-assign,assignment]
    for _ in range(2):
        process._announce(100.0, 10.0)
    assert len({event.sequence for event in kept}) == len(kept) == 1
