"""A parameter block in C beside Python's node: what is refused, what fits a rest, and what a block changes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from chip_tools import needs_gcc
from hypothesis import example, given, settings
from hypothesis import strategies as st
from orders_in_c import FIXED, WORDS, WORK_SPACE, OrdersInC, aligned, differing, memory_of, record_of
from test_every_event import FAST, SLOW, Bench, known

from node.firmware.block_trial import Trial, refusal_reason
from node.firmware.block_trial import record_of as parameters_of
from node.kernels.arithmetic.formats import DEG, FORCE_Q, RATE_Q
from node.kernels.record.integer_node import FIXED_PARAMETERS, PARAMETER_POWERS, PARAMETER_SCALES
from telemetry.messages import Matrix3, Vector3
from telemetry.parameters import UNIT, ParameterBlock, SensorParameters

GRAVITY = 9.80665
CORRECTIONS = FIXED_PARAMETERS.itemsize // 8
REASONS = ("", "reference", "right-handed", "drifts", "a bias", "within 0.2")
pytestmark = [needs_gcc, pytest.mark.slow]


@pytest.fixture(scope="module")
def orders(tmp_path_factory: pytest.TempPathFactory) -> OrdersInC:
    return OrdersInC(tmp_path_factory.mktemp("blocks"))


def in_integers(block: ParameterBlock, gravity: float = GRAVITY) -> np.ndarray:
    """Corrections as the step has them at a place of such a gravity (m/s^2), each number to the nearest."""
    record = parameters_of(block)
    floats, whole = record.view(np.float64), record.view(np.int64)
    scales = PARAMETER_SCALES[:CORRECTIONS] / gravity ** PARAMETER_POWERS[:CORRECTIONS]
    words = np.where(scales == 0.0, whole, np.floor(floats * scales + 0.5).astype(np.int64))
    return words.astype(np.int64).view(FIXED_PARAMETERS)


def matrix_of(numbers: list[float]) -> Matrix3:
    rows = [(numbers[k], numbers[k + 1], numbers[k + 2]) for k in (0, 3, 6)]
    return rows[0], rows[1], rows[2]


def near(value: Matrix3, numbers: list[float]) -> Matrix3:
    return matrix_of([a + b for a, b in zip(np.ravel(value).tolist(), numbers, strict=True)])


def several(size: float, count: int) -> st.SearchStrategy[list[float]]:
    """Numbers of any size up to one."""
    return st.floats(0.0, 1.0).flatmap(
        lambda part: st.lists(st.floats(-size * part, size * part), min_size=count, max_size=count)
    )


@st.composite
def sensors(draw: st.DrawFn, most_bias: float) -> SensorParameters:
    base = draw(st.sampled_from((UNIT, matrix_of([0.7, 0.5, 0.0, -0.4, 0.8, 0.1, 0.0, 0.0, 0.9]))))
    slopes = tuple(matrix_of(draw(several(size, 9))) for size in (2e-3, 2e-5, 2e-7))
    biases = [draw(several(most_bias * size, 3)) for size in (1.1, 1e-2, 1e-4, 1e-6)]
    vectors: list[Vector3] = [(a, b, c) for a, b, c in biases]
    return SensorParameters(
        near(base, draw(several(0.25, 9))),
        vectors[0],
        (slopes[0], slopes[1], slopes[2]),
        (vectors[1], vectors[2], vectors[3]),
        draw(st.floats(-40.0, 100.0)),
    )


BLOCKS = st.builds(ParameterBlock, st.just(1), st.just(2), sensors(20.0 * DEG), sensors(2.0))
STRETCHED = SensorParameters(matrix_of([1.2, 0.2, 0.2, 0.2, 1.2, 0.2, 0.2, 0.2, 1.2]))
SHEARED = SensorParameters(matrix_of([0.82, 0.18, 0.18, 0.18, 0.82, 0.18, 0.18, 0.18, 0.82]))


@settings(deadline=None)
@given(
    BLOCKS,
    st.sampled_from(
        (SensorParameters(), STRETCHED, SensorParameters(matrix_of([0.7, 0.5, 0.0, -0.4, 0.8, 0.1, 0.0, 0.0, 0.9])))
    ),
)
@example(ParameterBlock(1, 2, SensorParameters((UNIT[1], UNIT[0], UNIT[2]))), SensorParameters())
@example(ParameterBlock(1, 2, SensorParameters((UNIT[0], UNIT[0], UNIT[2]))), SensorParameters())
@example(ParameterBlock(1, 2, accelerometer=SensorParameters(bias=(2.1, 0.0, 0.0))), SensorParameters())
@example(ParameterBlock(1, 2, SHEARED, STRETCHED), SensorParameters())
def test_a_block_is_refused_as_by_python(orders: OrdersInC, block: ParameterBlock, before: SensorParameters) -> None:
    in_use = ParameterBlock(1, 1, before, before)
    found = orders.call("judge_block", in_integers(in_use), in_integers(block))
    reason = refusal_reason(block, 1, in_use)
    said = ("", "accelerometer: ")[found >= 8] if found else ""
    kind = REASONS[found & 7]
    assert bool(found) == bool(reason), (found, reason)
    assert kind in reason
    assert reason.startswith(said)


def test_a_block_is_tried_as_by_python(orders: OrdersInC) -> None:
    """At rest and turning, before and after the bias is known: the counts of a trial."""
    fits = ParameterBlock(1, 1, SensorParameters(bias=(1e-3, 0.0, 0.0)))
    blocks = (
        fits,
        ParameterBlock(1, 1, SensorParameters(bias=(0.0, 0.0, 0.3))),
        replace(fits, accelerometer=SensorParameters(bias=(0.0, 0.0, 1.2))),
        ParameterBlock(1, 1, accelerometer=SensorParameters(bias=(0.0, 0.0, -0.4))),
    )
    answers, gravity = set(), float(Bench(FIXED).tube.config["gravity"])
    for bench in (Bench(FIXED), known(FIXED), known(FIXED).cycles(5, FAST), known(FIXED).cycles(5, SLOW)):
        trials = [Trial(block, float(bench.tube.config["gravity"])) for block in blocks]
        counts = [[0, 0] for _ in blocks]
        for k in range(12):
            bench.cycles(1, FAST if k == 5 else 0.0)
            tube, raw = bench.tube, bench.tube.raw
            for trial, block, count in zip(trials, blocks, counts, strict=True):
                trial.judge_reading(raw.rate, raw.force, raw.temperature, standing=tube.standing, quiet=tube.quiet)
                rate = np.floor(np.array(raw.rate) * 2.0**RATE_Q + 0.5).astype(np.int64)
                force = np.floor(np.array(raw.force) / gravity * 2.0**FORCE_Q + 0.5).astype(np.int64)
                found = orders.call("try_block", record_of(bench), in_integers(block, gravity), rate, force)
                answers.add(found)
                count[:] = {0: [0, 0], 1: [count[0] + 1, 0], 2: [0, count[1] + 1], 3: [0, count[1]]}[found]
                assert count == [trial._agreed, trial._differed], (k, found)
    assert {0, 1, 2} <= answers


TURNED = (".ring_rate", ".ring_force", ".down", ".now_down", ".static_bias", ".bias")
ROUNDED = 128  # 2e-12 rad/s, 2e-6 g: floats and integers round in other places
OF_FACTORS = 2.0**-29  # of a reading: a row of three factors, each to the nearest of 2^-30, and their inverse
EARLIER = ParameterBlock(
    1, 1,
    SensorParameters(matrix_of([0.98, 0.0, 0.01, 0.02, 1.0, 0.0, 0.0, 0.01, 1.02]), (0.0, 2e-3, -1e-3)),
    SensorParameters(matrix_of([1.0, 0.02, 0.0, 0.0, 1.01, 0.0, 0.0, 0.01, 0.99]), (-0.01, 0.02, 0.01)),
)  # fmt: skip


@pytest.mark.parametrize("of", ["gyroscope", "accelerometer", "both"])
@pytest.mark.parametrize("state", ["new", "at rest", "corrected", "aligned", "aligning"])
def test_a_block_changes_what_it_changes_in_python(of: str, state: str, orders: OrdersInC) -> None:
    bench = {
        "new": lambda: Bench(FIXED).cycles(3),
        "at rest": lambda: known(FIXED),
        "corrected": lambda: known(FIXED),
        "aligned": aligned,
        "aligning": aligned,
    }[state]()
    if state == "corrected":
        bench.tube.use(EARLIER)
        bench.cycles(3)
    if state == "aligning":
        assert bench.tube.align("circle", 1.0) == ""
        bench.cycles(2)
    gyroscope = SensorParameters(
        bias=(1e-3, 0.0, 2e-3), matrix=matrix_of([1.01, 0.02, 0.0, 0.0, 0.99, 0.0, 0.01, 0.0, 1.0])
    )
    accelerometer = SensorParameters(
        bias=(0.02, -0.01, 0.03), matrix=matrix_of([0.99, 0.0, 0.01, 0.0, 1.0, 0.02, 0.0, 0.0, 1.01])
    )
    in_use = bench.tube.parameters
    block = ParameterBlock(
        1, 2,
        in_use.gyroscope if of == "accelerometer" else gyroscope,
        in_use.accelerometer if of == "gyroscope" else accelerometer,
    )  # fmt: skip
    mine = record_of(bench)
    gravity = float(bench.tube.config["gravity"])
    before, after = in_integers(in_use, gravity), in_integers(block, gravity)
    changes = {"gyroscope": 1, "accelerometer": 2, "both": 3}[of]
    assert orders.call("take_block", mine, bench_settings(bench), before, after, changes) == 0
    bench.tube.prepare(block)
    bench.tube.use(block)
    theirs = record_of(bench)
    left = {path for path in differing(mine, theirs) if not is_rounded(path, mine, theirs)}
    assert {path for path in left if ".aligner" not in path} <= WORK_SPACE


def is_rounded(path: str, one: np.ndarray, other: np.ndarray) -> bool:
    """Whether a field is one that a block turns, and every number of it is the other's but for rounding."""
    if not any(path.endswith(name) for name in TURNED):
        return False
    ((at, size),) = [(at, size) for name, at, size in WORDS if name == path]
    a, b = (np.frombuffer(record.tobytes()[at : at + size], np.int64) for record in (one, other))
    return bool(np.all(np.abs(a - b) <= ROUNDED + OF_FACTORS * np.abs(b).max()))


def bench_settings(bench: Bench) -> np.ndarray:
    """Settings in integers."""
    settings_in_use = memory_of(bench)["settings"]
    return np.frombuffer(bytearray(settings_in_use.tobytes()), settings_in_use.dtype)
