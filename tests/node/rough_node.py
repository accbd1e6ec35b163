"""What one node of a rough string reads and hears, for the tests that run it whole in more than one form."""

import math
from dataclasses import dataclass, field

import numpy as np

from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import PARTS

BLOCK, TURNING = 400, 180
SPIN = 71.0 * DEG
FAULTS = ("bias", "stuck", "not a number", "range", "force stuck", "slip", "vibration")


@dataclass
class RoughNode:
    """What one node reads and hears: turns and rests, faults of its sensors, jumps of its clock, other joints."""

    imus: int
    random: np.random.Generator
    lean: float = 0.3
    yaw: float = 0.0
    spin: float = 0.0
    now: float = 1000.0
    offset: float = 0.2
    sequence: int = 0
    hops: int = 1
    faults: dict[tuple[str, int], int] = field(default_factory=dict)

    def step(self, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Readings and moment of cycle ``k``."""
        random = self.random
        wanted = SPIN if k > BLOCK and k % BLOCK < TURNING else 0.0
        self.spin += float(np.clip(wanted - self.spin, -0.2, 0.2))
        self.yaw += self.spin * PERIOD
        if random.random() < 0.003:
            self.now += float(random.choice([PERIOD, 2.0 * PERIOD, -0.3, 40.0, -500.0]))
        self.now += PERIOD
        if random.random() < 0.004:
            self.faults[str(random.choice(FAULTS)), int(random.integers(self.imus))] = k + int(random.integers(3, 150))
        if k % 1000 == 990:
            self.hops, self.offset = self.hops % 3 + 1, float(random.uniform(-3.0, 3.0))
        rows = [self.reading(imu, k) for imu in range(self.imus)]
        joined = 0.0 if k % 1000 > 970 and self.spin == 0.0 else 1.0
        stepped = 0.0 if k % 9 else math.nan if k % 1800 == 900 else float(random.normal(0.0, 1e-4))
        clock = (1e-6 * (1 + k // 1000), 1.0, stepped, 3e-6 / (1.0 + k / 1000))
        return np.array(rows), np.array([self.now - PERIOD, self.now, joined, self.hops, *clock])

    def reading(self, imu: int, k: int) -> list[float]:
        """What one IMU reads."""
        lean, random = self.lean, self.random
        rate = random.normal(0.0, 1.6e-4, 3) + 2e-4 * (imu + 1) + np.array([0.0, 0.0, 1.001 * self.spin])
        down = [-math.sin(lean) * math.cos(self.yaw), math.sin(lean) * math.sin(self.yaw), math.cos(lean)]
        pull = -9.81 * np.array(down) + random.normal(0.0, 3.4e-3, 3)
        present = {fault for (fault, of), until in self.faults.items() if of == imu and until > k}
        if "bias" in present:
            rate[2] += 0.03
        if "vibration" in present:
            pull += random.normal(0.0, 2.0, 3)
        if "stuck" in present:
            rate[:] = 1e-3, 2e-3, 3e-3
        if "force stuck" in present:
            pull[:] = 1.0, 2.0, -9.0
        if "range" in present:
            rate[2] = 8.7
        if "not a number" in present:
            rate[1] = math.nan
        late, split = 0.01 if imu == 0 else 0.0, k % 700 < 500
        parts = rate[2] + random.normal(0.0, 4e-4, 1 + PARTS)
        window = late, 3e-4 * (late > 0.0), float(split), *(parts if split else 0 * parts)
        return [*rate, *pull, 20.0 + 30.0 * math.sin(k / 500.0), 0.0, *window]

    def aiding(self, k: int) -> np.ndarray:
        """The encoder's word after cycle ``k``."""
        rests = self.spin == 0.0
        self.sequence += 0 if rests and k % BLOCK != TURNING + 8 else 1
        slip = 0.02 if any(fault == "slip" and until > k for (fault, _), until in self.faults.items()) else 0.0
        yaw = (self.yaw - self.offset + slip + self.random.normal(0.0, 1e-4)) % math.tau
        held, torque = float(not rests or k % BLOCK < TURNING + 30), 2000.0 if not rests else 20.0
        at = self.now - float(self.random.uniform(0.0, 0.1))
        said = (yaw, 2e-8, 1e-6, self.offset, self.spin, at, self.sequence, self.hops, torque, 1e-6, held, 1e-6)
        return np.array(said)
