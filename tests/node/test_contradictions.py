"""Sensors that contradict each other for good: told by name, and the node goes on."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from emulated_mpu import EmulatedMpu
from string_of_one import StringOfOne

from node.firmware.imu_settings import ImuSettings
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.process.drivers.mpu_imu import MpuImu
from node.process.tube_process import TubeProcess
from sim.string import head_measurements
from telemetry.messages import Event, NodeFlag, Severity


class Told(TubeProcess):
    """Keeps the codes of all events."""

    def _send(self, said, now: float) -> bool:
        if isinstance(said, Event):
            self.codes = [*getattr(self, "codes", []), said.code]
        return super()._send(said, now)

    def _send_event(self, severity: Severity, code: str, arguments: dict) -> None:
        self.codes = [*getattr(self, "codes", []), code]
        super()._send_event(severity, code, arguments)


@pytest.mark.slow
@pytest.mark.parametrize("apart_dps", [2.0, 20.0])
def test_two_imus_that_disagree_for_ever_are_told_once_and_neither_is_trusted(tmp_path: Path, apart_dps: float) -> None:
    """Nothing says which of two is right: from some cycles on their disagreement is an event, and it stays one."""
    chips = [EmulatedMpu(address) for address in (0x68, 0x69)]
    imus = [MpuImu(chip.connect, chip.address, sleep=lambda _: None) for chip in chips]
    process = Told(TubeSettings(3, imus=(ImuSettings(), ImuSettings())), tmp_path, imus=imus)
    random, now = np.random.default_rng(5), 1000.0
    for k in range(400):
        now += PERIOD
        for chip, apart in zip(chips, (0.0, apart_dps if k >= 150 else 0.0), strict=True):
            for _ in range(26):
                noise = random.normal(0.0, 0.05 * DEG, 3)
                rate = noise + np.array([0.0, 0.0, apart * DEG])
                chip.live(PERIOD / 26.0, tuple(rate), tuple(np.array([0.2, -0.3, -9.79]) + 5.0 * noise))
        process.on_cycle([now - PERIOD], now)
        process.take_frames(now)
        assert np.all(np.isfinite(process.state[0]["P"]))
        if k == 149:
            assert not [code for code in process.codes if code.startswith("imu")]
    assert 1 <= len([code for code in process.codes if code.startswith("imu")]) <= 2
    assert process.nodes[0]["cluster"]["used"][:2].sum() < 2 or "imus_disagree" in process.codes


@pytest.mark.slow
@pytest.mark.parametrize("counts", [2048, 4000, 5000, 10000])
def test_an_encoder_of_another_resolution_is_named_while_the_head_first_turns(
    counts: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A node alone cannot know whether encoder or gyroscope has another scale; the ground station compares several."""
    usual = head_measurements.turning_samples

    def scaled(world):
        samples, edges = usual(world)
        samples[:, head_measurements.COUNT] = np.floor(samples[:, head_measurements.COUNT] * (counts / 4096.0))
        return samples, edges

    monkeypatch.setattr(head_measurements, "turning_samples", scaled)
    one = StringOfOne(3, blocks=1).run()
    begun = one.first("started")
    named = min(one.first(code, begun) for code in ("gyro_scale", "gyro_step") if code in one.codes(begun))
    assert named - begun <= 12
    assert "aiding_rejected" in one.codes(begun)
    assert np.all(np.isfinite(one.std))
    assert math.isfinite(one.states[-1].yaw)
    ratios = [event.arguments["ratio"] for _, event in one.events if event.code == "encoder_ratio"]
    assert ratios == pytest.approx([counts / 4096.0], rel=0.01)
    flags = NodeFlag.YAW_UNTRUSTED | NodeFlag.INNOVATION_REJECTED
    told = np.array([bool(state.flags & flags) for state in one.states])
    var = one.std**2 + one.string.run.systematic_var[:, 0]
    lies = [k for k in range(begun, one.cycles) if one.error[k] ** 2 > 9.0 * var[k] and not told[k : k + 11].any()]
    assert not lies, "no yaw is wrong without a flag or a sigma"
    assert one.states[-1].systematic_var > 3.0, "a rest does not tell how far the head turned"
