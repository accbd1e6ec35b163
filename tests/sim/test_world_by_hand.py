"""The simulated world by other means: its paths integrated, its readings differentiated, its shafts as sums."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import cumulative_simpson

from sim.world.borehole import Borehole, read_displacements
from sim.world.motion import Motion, Trapezoid
from sim.world.radio import RadioLinks
from sim.world.radio_section import RadioSection
from sim.world.scenario_file import TorsionSection
from sim.world.torsion import StringTorsion, polar_moment, product_rule, smooth_step
from sim.world.truth import TubeTruth

Array = npt.NDArray[np.float64]
DEG = math.pi / 180.0
G = 9.81


def bent_hole() -> Borehole:
    """Stations whose legs differ in length, bend and plane."""
    return Borehole(
        np.array([0.0, 6.0, 15.0, 20.0]),
        np.array([5.0, 20.0, 24.0, 60.0]) * DEG,
        np.array([0.0, 40.0, 130.0, 100.0]) * DEG,
    )


def test_a_hole_is_the_integral_of_its_tangent_and_this_of_its_curvature() -> None:
    hole, md = bent_hole(), np.linspace(0.0, 20.0, 20001)
    tangents, curvatures = hole.tangent(md)
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=1), 1.0, atol=1e-12)
    path = cumulative_simpson(tangents, x=md, axis=0, initial=0.0)
    for k in (1, 3000, 6000, 9999, 17000, 20000):
        np.testing.assert_allclose(hole.position(float(md[k])), path[k], atol=1e-6)
    inside = np.r_[100:5900, 6100:14900, 15100:19900]
    numeric = np.gradient(tangents, md, axis=0)
    np.testing.assert_allclose(curvatures[inside], numeric[inside], atol=1e-6)


def test_a_record_of_displacements_goes_where_its_columns_say(tmp_path: Path) -> None:
    """Two metres down, 10 cm along +A, which is east; then 20 cm along -B, which is north."""
    (tmp_path / "record.csv").write_text("md_m,a_cm,b_cm\n0,0,0\n2,10,0\n4,0,-20\n")
    md, inclination, azimuth = read_displacements(tmp_path / "record.csv")
    assert md.tolist() == [0.0, 2.0, 4.0]
    assert inclination.tolist() == pytest.approx([0.0, math.asin(0.05), math.asin(0.1)])
    assert np.degrees(azimuth[1:]).tolist() == pytest.approx([90.0, 0.0])


def motion(tubes: int = 3, at_start: int = 0) -> Motion:
    return Motion(100.0, 20.0, 5.0, 30.0, 10.0, Trapezoid(9.0, 1.2, 0.4), tubes, 2.0, 0.7, at_start=at_start)


def test_a_turn_is_the_integral_of_its_rate_and_this_of_its_acceleration() -> None:
    for turn in (Trapezoid(9.0, 1.2, 0.4), Trapezoid(0.5, 1.2, 0.4)):  # the second has no flat part
        u = np.linspace(0.0, turn.duration, 40001)
        angle, rate, _ = turn.turned(u)
        np.testing.assert_allclose(angle, cumulative_simpson(rate, x=u, initial=0.0), atol=1e-4)
        assert angle[-1] == pytest.approx(turn.angle)
        assert rate.max() <= 1.2 + 1e-9
        for share in (0.001, 0.1, 0.5, 0.9, 0.999):
            at = turn.time_of(share * turn.angle)
            assert float(turn.turned(np.array([at]))[0][0]) == pytest.approx(share * turn.angle, abs=1e-9)
        np.testing.assert_allclose(
            turn.times_of(np.array([0.1, 0.4])), [turn.time_of(0.1), turn.time_of(0.4)], atol=1e-12
        )


def test_the_bit_advances_by_a_tube_in_each_block_from_where_it_was() -> None:
    for at_start, first in ((0, 0.0), (2, 4.0)):
        one = motion(tubes=4, at_start=at_start)
        ends = [phase.end for phase in one.phases if phase.kind == "drill"]
        depths = one.depth(np.array([one.begin, *ends]))[0]
        np.testing.assert_allclose(depths, first + 2.0 * np.arange(len(ends) + 1), atol=1e-9)


def test_a_tube_is_on_top_from_the_moment_its_joint_is_closed() -> None:
    one = motion()
    closed = one.make_ups
    assert one.tops(closed).tolist() == [1, 2, 3]
    assert one.tops(closed - 1e-6).tolist() == [1, 1, 2]


def test_a_shaft_is_the_difference_of_two_solid_ones() -> None:
    assert polar_moment(0.1, 0.0) == pytest.approx(math.pi * 0.1**4 / 32.0)
    assert polar_moment(0.1, 0.08) == pytest.approx(polar_moment(0.1, 0.0) - polar_moment(0.08, 0.0))


def test_a_smooth_step_and_a_product_are_the_integrals_of_their_derivatives() -> None:
    t = np.linspace(-1.0, 6.0, 70001)
    step, other = smooth_step(t, 5.0), (np.sin(2.0 * t), 2.0 * np.cos(2.0 * t), -4.0 * np.sin(2.0 * t))
    assert (step[0][0], step[0][-1]) == (0.0, pytest.approx(1.0))
    for value, rate, bend in (step, product_rule(step, other)):
        np.testing.assert_allclose(value - value[0], cumulative_simpson(rate, x=t, initial=0.0), atol=1e-9)
        np.testing.assert_allclose(rate - rate[0], cumulative_simpson(bend, x=t, initial=0.0), atol=1e-7)


SECTION: dict[str, Any] = {
    "outer_diameter_m": 0.1, "inner_diameter_m": 0.08, "shear_modulus_gpa": 80.0, "bit_torque_nm": 300.0,
    "wall_friction_nm_per_m": 50.0, "wind_s": 2.0, "release_after_s": 1.0, "release_s": 2.0, "stick_slip": 0.0,
}  # fmt: skip


def test_a_string_winds_by_the_sum_of_its_slices_and_keeps_what_is_trapped() -> None:
    section = TorsionSection(**{k: v for k, v in SECTION.items() if k in TorsionSection.model_fields})
    one = motion()
    trapped = np.array([0.1, 0.25, 0.4])
    torsion = StringTorsion(section, one, 2.0, one.lengths, trapped)
    rigidity = 80e9 * (math.pi / 32.0) * (0.1**4 - 0.08**4)  # G J, N m^2
    drills = [phase for phase in one.phases if phase.kind == "drill"]

    def wound(tube: int, block: int, at: float) -> float:
        """Slices of a millimetre from the tube's lower end to the top: T_bit, and friction below each."""
        depth = float(one.depth(np.array([at]))[0][0])
        s = np.arange(2.0 * (tube - 1), 2.0 * (block + 1), 1e-3) + 0.5e-3
        return float(np.sum((300.0 + 50.0 * np.minimum(s, depth)) / rigidity * 1e-3))

    for block, phase in enumerate(drills):
        late = np.array([phase.end - 0.1])
        for tube in range(1, block + 2):
            assert float(torsion.twist(tube, late)[0][0]) == pytest.approx(wound(tube, block, late[0]), rel=1e-4)
            rest = np.array([phase.end + 10.0])
            kept = trapped[block] * wound(tube, block, phase.end)
            assert float(torsion.twist(tube, rest)[0][0]) == pytest.approx(kept, rel=1e-4)
        if block:
            start = np.array([phase.start])
            kept = trapped[block - 1] * wound(1, block - 1, drills[block - 1].end)
            assert float(torsion.twist(1, start)[0][0]) == pytest.approx(kept, rel=1e-4)
    t = np.linspace(drills[1].start - 1.0, drills[1].end + 6.0, 40001)
    angle, rate, _ = torsion.twist(1, t)
    np.testing.assert_allclose(angle - angle[0], cumulative_simpson(rate, x=t, initial=0.0), atol=1e-6)


def lag(t: Array) -> tuple[Array, Array, Array]:
    """A string that winds."""
    return 0.3 * np.sin(0.2 * t), 0.06 * np.cos(0.2 * t), -0.012 * np.sin(0.2 * t)


def test_what_a_sensor_reads_is_the_derivative_of_its_attitude_and_of_its_place() -> None:
    """R' = R [w]x and f = R^T (a - g), by differences of attitude and of the place of a sensor off the axis."""
    hole, one, radius = bent_hole(), motion(tubes=9), 0.03
    truth = TubeTruth(hole, one, 1.5, 0.4, radius, G, lag)
    phase = [phase for phase in one.phases if phase.kind == "drill"][4]
    step = 1e-4
    for t in np.linspace(phase.start + 1.0, phase.end - 1.0, 7):
        if min(abs(t - phase.start - 3.0), abs(phase.end - 3.0 - t)) < 0.01:
            continue  # where the acceleration of the head jumps
        times = t + step * np.array([-1.0, 0.0, 1.0])
        attitude = truth.attitude(times)
        spin = attitude[1].T @ (attitude[2] - attitude[0]) / (2.0 * step)
        np.testing.assert_allclose(truth.rate(times)[1], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-5)
        bits = one.depth(times)[0] - 1.5
        place = np.array([hole.position(float(md)) for md in bits]) + radius * attitude[:, :, 0]
        acceleration = (place[2] - 2.0 * place[1] + place[0]) / step**2
        force = attitude[1].T @ (acceleration - np.array([0.0, 0.0, G]))
        np.testing.assert_allclose(truth.force(times)[1, 2], force[2], atol=2e-3)
        rate, angular = (float(one.drive(times)[k][1] - lag(times)[k][1]) for k in (1, 2))
        bare = TubeTruth(hole, one, 1.5, 0.4, 0.0, G, lag).force(times)[1]
        np.testing.assert_allclose(truth.force(times)[1] - bare, [-radius * rate**2, radius * angular, 0.0], atol=1e-12)
        without = np.array([hole.position(float(md)) for md in bits])
        pushed = (without[2] - 2.0 * without[1] + without[0]) / step**2
        np.testing.assert_allclose(bare, attitude[1].T @ (pushed - np.array([0.0, 0.0, G])), atol=2e-5)


def test_a_tube_lags_the_head_by_its_twist() -> None:
    truth = TubeTruth(bent_hole(), motion(), 0.0, 0.4, 0.0, G, lag)
    t = np.linspace(120.0, 160.0, 5)
    np.testing.assert_allclose(truth.yaw(t), motion().drive(t)[0] - 0.3 * np.sin(0.2 * t) + 0.4, atol=1e-12)


def test_every_joint_fades_by_itself() -> None:
    section = RadioSection(mode="pipe", frequency_mhz=3500.0, fade_std_db=3.0)
    links = RadioLinks(section, 5, 8, 2.0, 0.0, 100.0, lambda t: 10.0, lambda md: md)
    margins = [links.margin((joint,), 1.0) for joint in range(1, 9)]
    assert len({round(one, 6) for one in margins}) == 8
    assert 0.5 < float(np.std(margins)) < 8.0
