"""Recordings played by the clock: the integral is kept whatever the cycles, and what is no recording is refused."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from node.errors import NodeConfigurationError, SensorError
from node.process.drivers.choice import encoder_source, imu_source
from node.process.drivers.timed import TimedEncoder, TimedImu

TIMES = 100.0 + 0.25 * np.arange(41)


def imu_of(path: Path, rows: np.ndarray) -> TimedImu:
    np.save(path / "imu.npy", rows)
    source = TimedImu(path / "imu.npy")
    source.start()
    return source


def test_any_cycles_add_up_to_what_was_recorded(tmp_path: Path) -> None:
    random = np.random.default_rng(2)
    readings = random.standard_normal((41, 6))
    source = imu_of(tmp_path, np.column_stack([TIMES, readings]))
    cuts = np.sort(random.uniform(TIMES[0], TIMES[-1], 30))
    edges = [TIMES[4], *cuts[(cuts > TIMES[4]) & (cuts < TIMES[31])], TIMES[31]]
    total = sum((b - a) * np.array([*source.read(a, b).rate, *source.read(a, b).force]) for a, b in pairwise(edges))
    np.testing.assert_allclose(total, 0.25 * readings[5:32].sum(axis=0), rtol=1e-12, atol=1e-12)


def test_a_row_is_the_mean_since_the_row_before(tmp_path: Path) -> None:
    rows = np.column_stack([TIMES, np.arange(41.0)[:, None] * np.ones(7)])
    source = imu_of(tmp_path, rows)
    assert source.read(100.25, 100.5).rate == (2.0, 2.0, 2.0)
    assert source.read(100.125, 100.375).force == pytest.approx((1.5, 1.5, 1.5))
    assert source.read(100.25, 100.5).temperature == 2.0


def test_the_counter_tells_the_newest_row_that_has_been(tmp_path: Path) -> None:
    np.save(tmp_path / "counter.npy", np.column_stack([TIMES, np.arange(41.0), TIMES - 0.1, np.ones(41), TIMES - 0.2]))
    source = TimedEncoder(tmp_path / "counter.npy")
    source.start()
    assert source.read(100.49).count == 1
    assert source.read(100.5).edge_at == pytest.approx(100.4)
    assert source.read(100.5).earlier == pytest.approx((100.3,))
    for t in (99.0, 120.0):
        with pytest.raises(SensorError, match=r"recorded from 100\.0 s to 110\.0 s, asked for"):
            source.read(t)


@pytest.mark.parametrize("t", [99.9, 110.5])
def test_a_moment_outside_is_a_fault_of_the_sensor(tmp_path: Path, t: float) -> None:
    source = imu_of(tmp_path, np.column_stack([TIMES, np.ones((41, 6))]))
    with pytest.raises(SensorError, match="asked for"):
        source.read(t - 0.1, t)


@pytest.mark.parametrize(
    ("row", "column", "value", "says"),
    [(7, 0, 100.0, "row 8: expected a time after"), (3, 2, np.nan, "row 4: expected finite numbers")],
)
def test_rows_that_cannot_be_are_named(tmp_path: Path, row: int, column: int, value: float, says: str) -> None:
    rows = np.column_stack([TIMES, np.ones((41, 6))])
    rows[row, column] = value
    with pytest.raises(SensorError, match=says):
        imu_of(tmp_path, rows)
    with pytest.raises(SensorError, match="row 2: expected a time after"):
        imu_of(tmp_path, np.ones((1, 7)))


@pytest.mark.parametrize("kind", ["replay", "timed"])
def test_a_recording_that_is_not_there_is_refused_before_anything_starts(tmp_path: Path, kind: str) -> None:
    for source in (imu_source, encoder_source):
        with pytest.raises(NodeConfigurationError, match=r"expected a recording, got .*none\.npy, which is not a file"):
            source(f"{kind}:{tmp_path / 'none.npy'}")
