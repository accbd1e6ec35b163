"""Sensor and encoder of a board, looked at for some cycles at rest: what they are, and whether readings are sane."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from node.errors import SensorError
from node.firmware.inputs import ImuReading
from node.kernels.arithmetic.formats import PERIOD, Array
from node.process.board_findings import BoardFinding, bad_finding, good_finding
from node.process.drivers.gravity_witness import FARTHEST, G
from node.process.drivers.source import EncoderSource, ImuSample, ImuSource
from node.process.temperature_watch import COLDEST, HOTTEST
from telemetry.records.noise_file import GyroNoise

CYCLES: Final = 8
RATE_OFF: Final = 0.05  # of the rate of the frames that the driver has set
USUAL_NOISE: Final = math.radians(0.015)  # rad/s, of a cycle's mean: the default noise over a cycle and a half
NOISIEST: Final = 10.0  # times that
BESIDE: Final = 3.0  # times the noise of a sensor's own record; of seven cycles and three axes chance makes less than 2
LARGEST_BIAS: Final = math.radians(20.0)  # rad/s, of any part that is sold
TURN_OFF: Final = 0.1  # of the turn that is told
COUNTS: Final = 4096  # of a turn
REPEATS: Final = 1e-9  # rad/s and m/s^2: means of equal counts differ by their rounding, of noise by a bit's share
Clock = Callable[[], float]
Sleep = Callable[[float], None]


def check_imu(
    source: ImuSource, known: GyroNoise | None = None, clock: Clock = time.monotonic, sleep: Sleep = time.sleep
) -> list[BoardFinding]:
    """Findings of an IMU at rest; ``known`` is the noise of its record, where there is one."""
    try:
        source.start()
    except SensorError as error:
        return [bad_finding("sensor", str(error))]
    samples: list[ImuSample] = []
    begin, lost = clock(), ""
    for _ in range(CYCLES):
        sleep(PERIOD)
        end = clock()
        try:
            samples.append(source.read(begin, end))
        except SensorError as error:
            lost = lost or str(error)
        begin = end
    found = [good_finding("sensor", describe_source(source))]
    found.append(
        bad_finding("readings", f"{CYCLES - len(samples)} of {CYCLES} cycles lost: {lost}")
        if lost
        else good_finding("readings", f"{CYCLES} cycles of {PERIOD:.3f} s, none lost")
    )
    found += judge_rate(source)
    return found + (judge_readings(samples[1:], expected_noise(1.0, known)) if len(samples) > 2 else [])


def describe_source(source: ImuSource | EncoderSource) -> str:
    """What a source says of itself."""
    return str(getattr(source, "description", type(source).__name__))


def judge_rate(source: ImuSource) -> list[BoardFinding]:
    """Rate of the frames as counted, beside the one that was set."""
    told, counted = getattr(source, "sample_rate", None), getattr(source, "counted_rate", math.nan)
    if told is None or not math.isfinite(counted):
        return []
    text = f"{counted:.1f} Hz, set to {told:.1f}"
    if math.isfinite(jitter := getattr(source, "jitter", math.nan)):
        text = f"{text}, jitter {1e3 * jitter:.2f} ms"
    return [good_finding("rate", text) if abs(counted / told - 1.0) < RATE_OFF else bad_finding("rate", text)]


@dataclass(frozen=True, slots=True)
class ExpectedNoise:
    """Largest scatter (rad/s) of the mean rates of cycles at rest, and that of its own record where there is one."""

    most: float
    own: float = math.nan


def expected_noise(factor: float, known: GyroNoise | None) -> ExpectedNoise:
    """Of a sensor with so many times the noise of the node's configuration, or with that of its own record."""
    if known is None:
        return ExpectedNoise(NOISIEST * factor * USUAL_NOISE)
    own = factor * max(known.white) / math.sqrt(PERIOD)
    return ExpectedNoise(BESIDE * own, own)


def judge_readings(
    samples: Sequence[ImuSample | ImuReading], noise: ExpectedNoise, *, still: bool = True
) -> list[BoardFinding]:
    """Findings of three readings or more of a sensor.

    Noise, bias and gravity are judged at rest (``still``) alone; a sensor that repeats itself is found always.
    """
    rates, forces = np.array([s.rate for s in samples]), np.array([s.force for s in samples])
    spread = rates.std(axis=0, ddof=1)
    warmth = float(np.mean([s.temperature for s in samples]))
    saturated = 0
    for sample in samples:
        saturated |= sample.saturated
    which = {0: "", 1: "the gyroscope", 2: "the accelerometer", 3: "both"}[saturated & 3]
    stuck = bool(np.any(spread < REPEATS) or np.any(forces.std(axis=0) < REPEATS))
    found = [bad_finding("noise", "an axis repeats itself bit for bit")] if stuck else []
    at_rest = _rest_findings(spread, rates.mean(axis=0), float(np.linalg.norm(forces.mean(axis=0))), noise)
    for line in at_rest[1:] if stuck else at_rest:
        found.append(line if still else good_finding(line.part, "not judged: the string turned meanwhile"))
    return [
        *found,
        judge_bound(
            "ranges", not saturated, "no reading at its range" if not saturated else f"{which} at its range", "none"
        ),
        judge_bound("temperature", COLDEST < warmth < HOTTEST, f"{warmth:.1f} C", f"{COLDEST:g}..{HOTTEST:g}"),
    ]


def _rest_findings(spread: Array, bias: Array, force: float, noise: ExpectedNoise) -> list[BoardFinding]:
    """What only a rest shows, noise first: scatter (3,) and mean (3,) of the rates, and the size of the mean force."""
    largest = float(spread.max())
    text = f"{math.degrees(largest):.4f} deg/s of a cycle at rest"
    if math.isfinite(noise.own):
        text = f"{text}, {math.degrees(noise.own):.4f} by its record"
    return [
        judge_bound("noise", largest <= noise.most, text, f"at most {math.degrees(noise.most):.3f}"),
        judge_bound(
            "bias",
            float(np.abs(bias).max()) <= LARGEST_BIAS,
            f"{', '.join(f'{math.degrees(b):.3f}' for b in bias)} deg/s",
            f"at most {math.degrees(LARGEST_BIAS):.0f}",
        ),
        judge_bound(
            "gravity", abs(force - G) <= FARTHEST * G, f"{force:.3f} m/s^2", f"{G:.2f} within {100 * FARTHEST:.0f} %"
        ),
    ]


def judge_bound(part: str, good: bool, text: str, expected: str) -> BoardFinding:
    """Finding of a quantity: what was found, and what was expected where it is not that."""
    return good_finding(part, text) if good else bad_finding(part, f"expected {expected}, got {text}")


def check_encoder(
    source: EncoderSource,
    turn_deg: float | None = None,
    clock: Clock = time.monotonic,
    is_turning: Callable[[], bool] = lambda: False,
) -> list[BoardFinding]:
    """Findings of an encoder; where the head is turned forward by ``turn_deg`` while ``is_turning``, its count too.

    It is read meanwhile, or edges of its lines would be lost: the kernel keeps those of a turn, and not of more.
    """
    try:
        source.start()
        before = source.read(clock()).count
        while is_turning():
            source.read(clock())
        after = source.read(clock()).count
    except SensorError as error:
        return [bad_finding("encoder", str(error))]
    found = [good_finding("encoder", describe_source(source))]
    moved = (after - before) * 360.0 / COUNTS
    if turn_deg is None:
        return [*found, judge_bound("count", abs(moved) < 1.0, f"{moved:.2f} deg at rest", "none")]
    text = f"{moved:.2f} deg for a turn of {turn_deg:g}"
    if moved * turn_deg < 0.0:
        return [*found, bad_finding("direction", f"{text}: it counts backwards, exchange its lines A and B")]
    right = abs(moved - turn_deg) <= TURN_OFF * abs(turn_deg)
    return [*found, good_finding("direction", "as told"), judge_bound("count", right, text, f"{turn_deg:g} deg")]
