"""The parameter block of a node: what its readings are corrected by, as numbers and as the bytes that are hashed.

A sensor reads G = M(T) w + b(T) and the node applies w = M(T)^-1 (G - b(T)). M and b are polynomials in T - T_ref,
each entry with its own coefficients. Two blocks are the same exactly when their canonical bytes are.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass

from telemetry.errors import DecodeError
from telemetry.messages import Matrix3, Vector3

FORMAT = 1
POWERS = 3  # of T - T_ref beyond the constant
SHORT_HASH = 8  # bytes of it in a node's state
HEAD = struct.Struct("<4sHHI")  # magic, format, tube, version
SENSOR = struct.Struct(f"<{(POWERS + 1) * 12 + 1}d")
MAGIC = b"BCPB"
BLOCK_SIZE = HEAD.size + 2 * SENSOR.size
MAX_VERSION = 2**32 - 1
# what a node holds a block to
MAX_CONDITION = 4.0
MAX_DISTANCE = 0.2  # of any entry of M from that of the identity or of the block before
MAX_DRIFT = 0.1  # of any entry of M from its value at the reference, over the range of temperature
MAX_BIAS = {"gyroscope": math.radians(20.0), "accelerometer": 2.0}  # rad/s, m/s^2
MAX_FORCE_ERROR = 0.05  # of gravity, at rest

ZERO: Vector3 = (0.0, 0.0, 0.0)
NO_MATRIX: Matrix3 = (ZERO, ZERO, ZERO)
UNIT: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class SensorParameters:
    """Model of one sensor in SI: rad/s of a gyroscope, m/s^2 of an accelerometer, K from ``reference`` (C)."""

    matrix: Matrix3 = UNIT  # 1, row = sensor axis, column = true axis
    bias: Vector3 = ZERO
    matrix_slopes: tuple[Matrix3, Matrix3, Matrix3] = (NO_MATRIX, NO_MATRIX, NO_MATRIX)  # 1/K, 1/K^2, 1/K^3
    bias_slopes: Matrix3 = NO_MATRIX  # row p is the coefficient of (T - T_ref)^(p + 1)
    reference: float = 25.0

    def numbers(self) -> Iterator[float]:
        """Every number in canonical order: M and its slopes row by row, b and its slopes, the reference."""
        for matrix in (self.matrix, *self.matrix_slopes):
            for row in matrix:
                yield from row
        for vector in (self.bias, *self.bias_slopes):
            yield from vector
        yield self.reference


@dataclass(frozen=True, slots=True)
class ParameterBlock:
    """Parameters of one node. Version 0 is the identity that a node has before any upload."""

    tube: int
    version: int
    gyroscope: SensorParameters = SensorParameters()
    accelerometer: SensorParameters = SensorParameters()

    def canonical(self) -> bytes:
        """``BLOCK_SIZE`` bytes, little-endian: head, gyroscope, accelerometer; a negative zero is written as zero."""
        head = HEAD.pack(MAGIC, FORMAT, self.tube, self.version)
        sensors = (self.gyroscope, self.accelerometer)
        return head + b"".join(SENSOR.pack(*(number + 0.0 for number in sensor.numbers())) for sensor in sensors)

    def sha256(self) -> bytes:
        """Hash of the canonical bytes, 32 bytes."""
        return hashlib.sha256(self.canonical()).digest()


def unpack_block(data: bytes) -> ParameterBlock:
    """Block of its canonical bytes.

    Raises
    ------
    DecodeError
        When the bytes are not a block of this format, or hold a number that is not finite.
    """
    if len(data) != BLOCK_SIZE:
        raise DecodeError(f"parameter block: expected {BLOCK_SIZE} bytes, got {len(data)}")
    magic, layout, tube, version = HEAD.unpack_from(data)
    if magic != MAGIC or layout != FORMAT:
        raise DecodeError(f"parameter block: expected format {FORMAT}, got {layout} of {magic!r}")
    gyroscope = _sensor(SENSOR.unpack_from(data, HEAD.size))
    return ParameterBlock(tube, version, gyroscope, _sensor(SENSOR.unpack_from(data, HEAD.size + SENSOR.size)))


def _sensor(numbers: tuple[float, ...]) -> SensorParameters:
    if not all(math.isfinite(number) for number in numbers):
        raise DecodeError("parameter block: expected finite numbers, got some that are not")
    rows = [(numbers[k], numbers[k + 1], numbers[k + 2]) for k in range(0, len(numbers) - 1, 3)]
    first, *slopes = [(rows[k], rows[k + 1], rows[k + 2]) for k in range(0, 3 * (POWERS + 1), 3)]
    bias, *bias_slopes = rows[3 * (POWERS + 1) :]
    return SensorParameters(
        first,
        bias,
        (slopes[0], slopes[1], slopes[2]),
        (bias_slopes[0], bias_slopes[1], bias_slopes[2]),
        numbers[-1],
    )
