"""Between the numbers of a chip's step and those of native messages: each in its unit, by fractions, at its bounds."""

from __future__ import annotations

import ctypes
import math
from fractions import Fraction
from pathlib import Path

import pytest
from c_library import load_checked
from hypothesis import example, given
from hypothesis import strategies as st
from needed_programs import needs_gcc

from node.translation.c_file import write_c_files
from telemetry.messages import NodeFlag
from telemetry.presentation.can_c_codec import NATIVE_HEADER, write_native_codec

FIRMWARE = Path(__file__).parents[2] / "firmware"
ANGLES, TIMES = -215, -331  # level 0 of rad^2 and of s^2, half decibels
NEVER = -(1 << 62)
ANY_YAW = math.pi**2 / 3.0  # rad^2, of a joint that may be any
STATE = [
    "tube",
    "at",
    "hops",
    "mode",
    "yaw",
    "yaw_var",
    "systematic_var",
    "gyro_bias_x",
    "gyro_bias_y",
    "gyro_bias_z",
    "scale_factor",
    "innovation",
    "innovation_var",
    "aiding_age",
    "clock_var",
    "flags",
    "cycles",
    "overruns",
    "alignment_x",
    "alignment_y",
    "alignment_z",
    "epoch",
    "numbered",
]
AIDING = [
    "yaw",
    "yaw_var",
    "systematic_var",
    "offset",
    "rate",
    "sequence",
    "hops",
    "torque",
    "torsion_var",
    "under_torque",
    "valid_at",
    "epoch",
]
pytestmark = needs_gcc


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("signals")
    (folder / "borechain_step.h").write_text(write_c_files().header)
    (folder / NATIVE_HEADER).write_text(write_native_codec().header)
    sources = [FIRMWARE / "tube" / "node_signals.c", FIRMWARE / "levels.c", FIRMWARE / "chip_clock.c"]
    shim = Path(__file__).parent / "signals_shim.c"
    includes = (f"-I{folder}", f"-I{FIRMWARE}", f"-I{FIRMWARE / 'tube'}", "-DCHIP_END_ROOM=480u")
    loaded = load_checked(folder, [*sources, shim], *includes)
    for name in ("q28_of_us", "node_yaw_var", "node_var_q56", "us2_of_level"):
        getattr(loaded, name).restype = ctypes.c_int64
    return loaded


def set_all(library: ctypes.CDLL, **values: int) -> None:
    """Members of the node by their names: two underscores are a point, three begin an index."""
    library.shim_clear()
    for name, value in values.items():
        assert library.shim_set(_member(name).encode(), ctypes.c_int64(value)) == 0, name


def _member(name: str) -> str:
    head, *places = name.split("___")
    return head.replace("__", ".") + "".join(f"[{place}]" for place in places)


def state_of(library: ctypes.CDLL, now_us: int = 0) -> dict[str, int]:
    out = (ctypes.c_int64 * len(STATE))()
    library.shim_state(ctypes.c_int64(now_us), out)
    return dict(zip(STATE, out, strict=True))


def words(given: dict[str, int]) -> ctypes.Array[ctypes.c_int64]:
    return (ctypes.c_int64 * len(AIDING))(*(given[name] for name in AIDING))


def level_value(level: int, first: int) -> float:
    return 10.0 ** ((first + level) / 20.0) if level else 0.0


def nearest_count(angle: float) -> int:
    """Of 2^-24 of a turn, either side of zero."""
    return (round(angle / math.tau * 2**24) + 2**23) % 2**24 - 2**23


@given(st.integers(-(10**14), 10**14))
@example(999_999)
@example(1_000_000)
@example(-1)
def test_microseconds_are_seconds_to_the_last_bit_towards_zero(library: ctypes.CDLL, us: int) -> None:
    expected = Fraction(us * 2**28, 10**6)
    assert library.q28_of_us(ctypes.c_int64(us)) == math.trunc(expected)


@given(st.integers(0, 10**15))
@example(10**13)
@example(10**13 - 1)
@example(1)
def test_a_clock_s_variance_is_that_in_seconds_up_to_ten(library: ctypes.CDLL, us2: int) -> None:
    expected = min(us2, 10**13) * 1e-12 * 2.0**56
    assert library.node_var_q56(ctypes.c_int64(us2)) == pytest.approx(expected, rel=1e-6, abs=1.0)


@given(st.integers(1, 330))
def test_a_level_of_time_is_no_smaller_in_microseconds(library: ctypes.CDLL, level: int) -> None:
    found, exact = library.us2_of_level(level), 1e12 * level_value(level, TIMES)
    assert exact * (1.0 - 1e-4) - 1e-3 <= found <= exact * 1.0001 + 1.0


def test_no_yaw_is_said_better_than_a_thousandth_of_a_degree(library: ctypes.CDLL) -> None:
    floor = round(math.radians(1e-3) ** 2 * 2**56)
    assert abs(library.node_yaw_var(ctypes.c_int64(0)) - floor) <= 1
    for var in (floor + 2, 10 * floor):
        assert library.node_yaw_var(ctypes.c_int64(var)) == var


@given(
    st.integers(0, 2**24 - 1),
    st.integers(-(2**23), 2**23 - 1),
    st.integers(-(10**6), 10**6),
    st.tuples(*[st.integers(1, 255)] * 3),
    st.integers(0, 3 * 10**14),
)
def test_an_aiding_is_the_step_s_in_its_units(
    library: ctypes.CDLL, yaw: int, offset: int, rate: int, levels: tuple[int, int, int], valid_us: int
) -> None:
    given_numbers = dict.fromkeys(AIDING, 0) | {
        "yaw": yaw, "offset": offset, "rate": rate, "yaw_var": levels[0], "systematic_var": levels[1],
        "torsion_var": levels[2], "sequence": 2**40 + 7, "hops": 9, "torque": 480, "under_torque": 1, "epoch": 3,
        "valid_at": 12345,
    }  # fmt: skip
    out = (ctypes.c_int64 * 12)()
    library.shim_for_step(words(given_numbers), ctypes.c_int64(valid_us), ctypes.c_int64(250_000), out)
    turn = 2.0 * math.pi / 2**24 * 2**40
    assert abs(out[0] - yaw * turn) <= 9.0  # of 2^-40 rad: the constant has its last bit in Q60
    assert abs(out[3] - offset * turn) <= 9.0  # of 2^-40 rad: the constant has its last bit in Q60
    for place, level in zip((1, 2, 9), levels, strict=True):
        assert out[place] == pytest.approx(min(level_value(level, ANGLES) * 2**56, 2.0**61), rel=1e-5, abs=2.0)
    assert abs(out[4] - rate * 1e-5 * 2**46) <= 1.0 + 0.25 * abs(rate)
    assert out[5] == math.trunc(Fraction(valid_us * 2**28, 10**6))
    assert (out[6], out[7], out[8], out[10]) == (2**40 + 7, 9, 480 << 20, 1)
    assert out[11] == pytest.approx(0.25e-6 * 2**56, rel=1e-6)


@given(st.floats(-7.0, 7.0), st.tuples(*[st.floats(-9.0, 1.0)] * 2))
@example(math.pi, (-4.0, -5.0))
@example(-math.pi, (-4.0, -5.0))
def test_the_measurement_goes_down_unchanged_and_the_path_is_that_of_the_record(
    library: ctypes.CDLL, offset: float, powers: tuple[float, float]
) -> None:
    heard = {name: 11 + k for k, name in enumerate(AIDING)}
    systematic, torsion = (10.0**power for power in powers)
    set_all(
        library,
        record__down_offset=round(offset * 2**40),
        record__down_systematic=round(systematic * 2**56),
        record__down_torsion=round(torsion * 2**56),
    )
    out = (ctypes.c_int64 * len(AIDING))()
    library.shim_for_below(words(heard), out)
    said = dict(zip(AIDING, out, strict=True))
    for name in ("yaw", "yaw_var", "rate", "sequence", "torque", "under_torque", "valid_at", "epoch"):
        assert said[name] == heard[name], name
    assert said["hops"] == heard["hops"] + 1
    apart = (said["offset"] - offset / math.tau * 2**24 + 2**23) % 2**24 - 2**23
    assert abs(apart) <= 0.52  # to the nearest count
    assert -(2**23) <= said["offset"] < 2**23
    for name, var in (("systematic_var", systematic), ("torsion_var", torsion)):
        level = said[name]
        assert level_value(level, ANGLES) >= var * (1.0 - 1e-6)
        assert level == 1 or level_value(level - 1, ANGLES) < var * (1.0 + 1e-6)


def flags_of(library: ctypes.CDLL, now: float = 1000.0, *, is_dated: bool = True, **values: int) -> NodeFlag:
    usual = {
        "record__filter__yaw_known": 1, "record__filter__last_aided": round(997.5 * 2**28),
        "settings__aiding_old_after": 3 << 28, "worth": -1, "record__filter__mode": 3, "identity__tube": 2,
        "kept__hops": 1,
    }  # fmt: skip
    set_all(library, **usual | values)
    return NodeFlag(library.shim_flags(ctypes.c_int64(round(now * 2**28)), int(is_dated)))


UNTOLD = round(ANY_YAW * 2**56)
TOLD = 1 << 56  # rad^2, just so much is told


@pytest.mark.parametrize(
    ("change", "flags"),
    [
        ({}, NodeFlag.NONE),
        ({"record__guard__gyro__fault": 4}, NodeFlag.SENSOR_FAULT | NodeFlag.YAW_UNTRUSTED),
        ({"record__guard__force__fault": 4}, NodeFlag.SENSOR_FAULT),
        ({"record__guard__ratio__told": 1}, NodeFlag.YAW_UNTRUSTED),
        ({"record__filter__yaw_known": 0}, NodeFlag.YAW_UNTRUSTED),
        ({"record__filter__last_aided": NEVER}, NodeFlag.AIDING_OLD),
        ({"record__filter__last_aided": 997 << 28}, NodeFlag.NONE),
        ({"record__filter__last_aided": (997 << 28) - 1}, NodeFlag.AIDING_OLD),
        ({"record__filter__rejected": 1}, NodeFlag.INNOVATION_REJECTED),
        ({"record__filter__rate_exceeded": 1}, NodeFlag.RATE_EXCEEDED),
        ({"worth": 0}, NodeFlag.RESTORED),
        ({"record__filter__mode": 1}, NodeFlag.BIAS_UNKNOWN),
        ({"refused": 1}, NodeFlag.NOT_SAVED),
        ({"settings__drive_var": UNTOLD}, NodeFlag.DRIVE_UNTOLD),
        ({"settings__drive_var": TOLD}, NodeFlag.NONE),
        ({"settings__drive_var": UNTOLD, "kept__hops": 2}, NodeFlag.NONE),
        ({"settings__lower_var": UNTOLD}, NodeFlag.LOWER_UNTOLD),
        ({"settings__lower_var": TOLD}, NodeFlag.NONE),
        ({"settings__lower_var": UNTOLD, "identity__tube": 1}, NodeFlag.NONE),
    ],
)
def test_each_flag_has_its_reason_and_no_other(library: ctypes.CDLL, change: dict[str, int], flags: NodeFlag) -> None:
    assert flags_of(library, **change) == flags
    assert flags_of(library, is_dated=False, **change) == flags | NodeFlag.CLOCK_UNSYNCHRONISED


def test_a_state_has_every_number_in_its_unit(library: ctypes.CDLL) -> None:
    q46, q40, q56 = 2.0**46, 2.0**40, 2.0**56
    set_all(
        library,
        identity__tube=7,
        identity__mount_var=round(2e-6 * q56),
        kept__hops=5,
        is_told_hops=1,
        kept__mail__next_number=4321,
        record__cycles=123456,
        record__overruns=17,
        record__filter__mode=4,
        record__filter__yaw_known=1,
        record__filter__now_yaw=0x12345678,
        record__filter__now_P___2___2=round(3e-5 * q56),
        record__filter__systematic_var=round(5e-6 * q56),
        record__filter__static_bias___0=round(1e-3 * q46),
        record__filter__static_bias___1=round(-2e-3 * q46),
        record__filter__static_bias___2=round(3e-3 * q46),
        record__filter__bias___0=round(1e-4 * q46),
        record__filter__bias___1=round(2e-4 * q46),
        record__filter__bias___2=round(-5e-4 * q46),
        record__filter__scale=round(-1.25e-3 * q46),
        record__filter__innovation=round(-0.01 * q40),
        record__filter__innovation_var=round(4e-5 * q56),
        record__filter__last_aided=round(95.5 * 2**28),
        record__mount__method=1,
        record__mount__axis___0___0=round(0.02 * 2**30),
        record__mount__axis___0___1=round(-0.03 * 2**30),
        record__mount__std___0___0=round(4e-4 * q40),
        clock__exchanges=3,
        clock__told__epoch=9,
        clock__told__rig_us=5_000_000_000,
        clock__told__replied_us=90_000_000,
        clock__told__rig_rate=1_000_000_000,
        clock__told__rig_var=400,
        settings__aiding_old_after=3 << 28,
        worth=-1,
    )
    state = state_of(library, 100_000_000)
    assert (state["tube"], state["hops"], state["mode"], state["numbered"]) == (7, 5, 4, 4320)
    assert (state["cycles"], state["overruns"], state["epoch"]) == (123456, 17, 9)
    assert state["at"] == (5_000_000_000 + 10_000_000) // 10
    assert state["yaw"] == 0x123456
    assert [state[f"gyro_bias_{axis}"] for axis in "xyz"] == pytest.approx([11000, -18000, 25000], abs=1.01)
    assert state["scale_factor"] == pytest.approx(-1250, abs=1.01)
    assert state["innovation"] == nearest_count(-0.01)
    assert [state[f"alignment_{axis}"] for axis in "xyz"] == pytest.approx([20000, -30000, 400], abs=1.01)
    assert state["aiding_age"] == 450
    assert state["flags"] == NodeFlag.AIDING_OLD
    for name, var in (("yaw_var", 3e-5), ("systematic_var", 7e-6), ("innovation_var", 4e-5)):
        assert var * (1.0 - 1e-6) <= level_value(state[name], ANGLES) < var * 10.0 ** (1.0 / 20.0) * (1.0 + 1e-6), name


@pytest.mark.parametrize(("yaw", "counts"), [(0x7F, 0), (0x80, 1), (0xFFFFFF7F, 0xFFFFFF), (0xFFFFFF80, 0)])
def test_a_yaw_is_rounded_and_full_scale_is_zero_again(library: ctypes.CDLL, yaw: int, counts: int) -> None:
    set_all(library, record__filter__now_yaw=yaw)
    assert state_of(library)["yaw"] == counts


@pytest.mark.parametrize(
    ("change", "mode"),
    [
        ({}, 3),
        ({"record__mount__aligning": 1}, 2),
        ({"record__guard__gyro__fault": 1, "record__mount__aligning": 1}, 7),
        ({"record__guard__force__fault": 1}, 7),
    ],
)
def test_a_fault_goes_before_an_alignment_and_this_before_what_the_filter_does(
    library: ctypes.CDLL, change: dict[str, int], mode: int
) -> None:
    set_all(library, record__filter__mode=3, **change)
    assert state_of(library)["mode"] == mode


def test_what_is_not_known_is_said_so_and_what_is_too_large_is_held(library: ctypes.CDLL) -> None:
    set_all(
        library, kept__hops=5, record__filter__last_aided=NEVER, record__overruns=255, record__mount__axis___0___0=9
    )
    state = state_of(library)
    assert (state["hops"], state["overruns"], state["alignment_x"]) == (-1, 255, 0)
    assert state["aiding_age"] == 16776215
    assert state["flags"] & NodeFlag.CLOCK_UNSYNCHRONISED
    set_all(
        library,
        record__overruns=256,
        record__filter__last_aided=0,
        record__filter__bias___0=3 << 46,
        record__filter__bias___1=-(3 << 46),
        record__filter__scale=3 << 46,
    )
    state = state_of(library, 167_762_145_000)
    assert (state["overruns"], state["aiding_age"]) == (255, 16776214)
    assert state_of(library, 167_762_155_000)["aiding_age"] == 16776215
    assert (state["gyro_bias_x"], state["gyro_bias_y"]) == (5_000_000, -5_000_000)  # of half a radian a second
    assert state["scale_factor"] == 1_000_000


@pytest.mark.parametrize(("us2", "is_dated"), [(2_499_999_000, True), (2_500_000_000, False)])
def test_a_node_is_dated_where_its_clock_is_known_to_a_twentieth_of_a_second(
    library: ctypes.CDLL, us2: int, is_dated: bool
) -> None:
    set_all(library, clock__exchanges=1, clock__told__rig_var=us2)
    state = state_of(library)
    assert bool(state["flags"] & NodeFlag.CLOCK_UNSYNCHRONISED) != is_dated
    assert level_value(state["clock_var"], TIMES) == pytest.approx(us2 * 1e-12, rel=0.13)
