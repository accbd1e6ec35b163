"""The canonical bytes of a parameter block."""

import hashlib
import math
import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import DecodeError
from telemetry.parameters import BLOCK_SIZE, HEAD, UNIT, ParameterBlock, SensorParameters, unpack_block

NUMBER = st.floats(allow_nan=False, allow_infinity=False)
VECTOR = st.tuples(NUMBER, NUMBER, NUMBER)
MATRIX = st.tuples(VECTOR, VECTOR, VECTOR)
SENSOR = st.builds(SensorParameters, MATRIX, VECTOR, st.tuples(MATRIX, MATRIX, MATRIX), MATRIX, NUMBER)
BLOCK = st.builds(ParameterBlock, st.integers(1, 250), st.integers(0, 2**32 - 1), SENSOR, SENSOR)


@pytest.mark.slow
@given(BLOCK)
def test_a_block_is_its_bytes(block: ParameterBlock) -> None:
    data = block.canonical()
    assert len(data) == BLOCK_SIZE
    assert unpack_block(data) == block
    assert unpack_block(data).canonical() == data
    assert block.sha256() == hashlib.sha256(data).digest()


def test_every_number_is_in_the_hash() -> None:
    plain = ParameterBlock(1, 1)
    seen = {plain.sha256()}
    count = len(list(plain.gyroscope.numbers()))
    assert count == 49
    for k in range(2 * count):
        data = bytearray(plain.canonical())
        struct.pack_into("<d", data, HEAD.size + 8 * k, 0.5)
        seen.add(unpack_block(bytes(data)).sha256())
    seen |= {ParameterBlock(2, 1).sha256(), ParameterBlock(1, 2).sha256()}
    assert len(seen) == 2 * count + 3


def test_a_negative_zero_is_a_zero() -> None:
    turned = ParameterBlock(1, 1, SensorParameters(bias=(-0.0, 0.0, -0.0)))
    assert turned.sha256() == ParameterBlock(1, 1).sha256()


def test_rows_are_sensor_axes() -> None:
    sensor = SensorParameters(matrix=((1.0, 0.1, 0.2), UNIT[1], UNIT[2]))
    assert list(sensor.numbers())[:3] == [1.0, 0.1, 0.2]


def test_numbers_that_all_differ_come_back_each_in_its_place() -> None:
    """One block is enough for that, where all of a hypothesis's examples are at full size alone."""
    numbers = iter(range(1, 200))

    def vector() -> tuple[float, float, float]:
        return float(next(numbers)), float(next(numbers)), float(next(numbers))

    def matrix() -> tuple[tuple[float, float, float], ...]:
        return vector(), vector(), vector()

    sensors = [
        SensorParameters(matrix(), vector(), (matrix(), matrix(), matrix()), matrix(), 21.0 + k)  # type: ignore[arg-type]
        for k in range(2)
    ]
    block = ParameterBlock(7, 9, *sensors)
    assert unpack_block(block.canonical()) == block
    in_order = struct.unpack_from("<49d", block.canonical(), HEAD.size)
    # M and its three slopes, then b and its three: as the numbers were given out, b after M
    assert in_order[:9] == tuple(range(1, 10))
    assert in_order[9:36] == tuple(range(13, 40))
    assert in_order[36:39] == (10, 11, 12)
    assert in_order[39:48] == tuple(range(40, 49))


@given(st.binary(max_size=2 * BLOCK_SIZE))
def test_random_bytes_are_no_block(data: bytes) -> None:
    with pytest.raises(DecodeError):
        unpack_block(data)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_none_is_refused(wrong: float) -> None:
    block = replace(ParameterBlock(1, 1), accelerometer=SensorParameters(reference=wrong))
    with pytest.raises(DecodeError, match="finite"):
        unpack_block(block.canonical())
