"""What a node does about a faulty sensor: the safe state, the way back, and the events of both.

While the gyroscope's readings are wrong the encoder's rate stands for them and the yaw's variance is that of an unknown
yaw. A step or a new scale is learnt: the readings go on, the constant bias takes the mismatch, and the
variances of yaw and bias are opened. Either way no cross term is kept. The node trusts itself again when readings are
sane and several aidings in a row agree within a gate that is narrow again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from node.firmware.pending_event import PendingEvent
from node.firmware.saved_state import resume
from node.firmware.sensor_faults import STEADY, AidingWatch, Fault, Mismatch, ReadingWatch, SensorLimits
from node.kernels.angles import from_binary, wrap
from node.kernels.error_model import isolate
from node.kernels.layout import DEG, PERIOD, RING, UNKNOWN_YAW_VAR, Array, Err, Status
from node.kernels.modes import STATIC_BIAS
from telemetry.messages import Aiding, NodeFlag, Scalar, Severity, Vector3

SANE_CYCLES = 3  # in a row, until the readings are used again; more than the filter's lag
AGREEING = 4  # aidings in a row, until the node is trusted again
NARROW_STD = 1.0 * DEG  # of an innovation that can show agreement
LEARNT_STD = 0.05 * DEG  # rad/s, error of a bias that was read from a mismatch
LARGEST_STEP = 10.0 * DEG  # rad/s, that a bias may take; a gyroscope that is farther off is not listened to
CREDIBLE = 0.5 * LARGEST_STEP  # rad/s, from the encoder's rate, of a gyroscope that may be listened to again
LARGEST_SCALE = 0.1  # 1, that is looked for
RATE_AGE = 3.0  # s, of an encoder's rate that may stand for the gyroscope
BACKWARD = PERIOD  # s, that a cycle may begin before the end of the last; beyond it is a jump of the clock
LONGEST_CYCLE = 10.0 * PERIOD  # s
FARTHEST = RING * PERIOD  # s, that a cycle may begin after the end of the last


@dataclass(slots=True)
class Trust:
    """How far one sensor is trusted: no fault; a fault, its readings not yet sane; a fault, proving itself."""

    fault: Fault | None = None
    proving: bool = False
    sane: int = 0
    cycles: int = 0  # since it was flagged

    @property
    def faulty(self) -> bool:
        """Whether its readings are not to be relied on."""
        return self.fault is not None and not self.proving


class SensorGuard:
    """Stands around the compiled cycle of one node.

    Parameters
    ----------
    states, configs : the node's records, one-element arrays
    limits : of its IMU
    """

    def __init__(self, states: Array, configs: Array, limits: SensorLimits) -> None:
        self._states = states
        self._state, self._config = states[0], configs[0]
        self._readings = ReadingWatch(limits)
        self._aidings = AidingWatch()
        self._gyro, self._force = Trust(), Trust()
        self._agreed = 0
        self._rate, self._rate_at, self._aiding_var = 0.0, -math.inf, 0.0
        self._sane_rate = 0.0
        self._step: Mismatch | None = None  # that the constant bias has taken
        self._before_steps: tuple[float, float] | None = None  # rad/s, the constant bias then, and size of the first
        self._jumped = self._untimely = False
        self._pending: list[PendingEvent] = []

    @property
    def flags(self) -> NodeFlag:
        """What a reader of the node's yaw must know."""
        flags = NodeFlag.NONE
        if self._gyro.fault is not None:
            flags |= NodeFlag.SENSOR_FAULT | NodeFlag.YAW_UNTRUSTED
        if self._force.fault is not None:
            flags |= NodeFlag.SENSOR_FAULT
        return flags

    @property
    def spin(self) -> float:
        """Rate about the axis that is likely now, rad/s: the encoder's while it is fresh, else the last sane one."""
        return self._rate if self.heard else self._sane_rate

    @property
    def heard(self) -> bool:
        """Whether the encoder reported its rate lately."""
        return abs(float(self._state["now"]) - self._rate_at) <= RATE_AGE

    def drain_events(self) -> list[PendingEvent]:
        """Code, severity and arguments of the events since the last call."""
        said, self._pending = self._pending, []
        return said

    def gate_aiding(self, aiding: Aiding, offset: float, valid_local: float) -> bool:
        """Whether an aiding is for the filter, valid at ``valid_local`` (s, own clock); ``offset`` rad.

        One with an invalid time, or one far ahead, would wait for ever and hold up all others.
        """
        state = self._state
        timely = math.isfinite(valid_local) and not (
            state["cycles"] and valid_local - float(state["now"]) > LONGEST_CYCLE
        )
        if not timely and not self._untimely:
            self._report("aiding_untimely", Severity.ERROR, {})
        self._untimely = not timely
        if not timely:
            return False
        self._rate, self._rate_at, self._aiding_var = aiding.rate, valid_local, aiding.yaw_var
        if self._gyro.fault is not None or self._contradicts(aiding.yaw + offset, valid_local):
            state["last_sequence"] = -1  # a repetition at rest is to be judged again
        return True

    def admits(self, start: float, end: float) -> bool:
        """Whether a cycle of these times (s, own clock) can be run; a clock that jumped begins a new epoch."""
        plain = math.isfinite(start) and math.isfinite(end) and 0.0 < end - start <= LONGEST_CYCLE
        ahead = start - float(self._state["now"]) if self._state["cycles"] else 0.0
        jumped = not plain or not -BACKWARD <= ahead <= FARTHEST
        if jumped and not self._jumped:
            self._report("clock_jumped", Severity.ERROR, {"by_s": ahead} if math.isfinite(ahead) else {})
        if not jumped and ahead < 0.0:  # the increments overlap, and the turn that was counted once is in doubt
            self._state["P"][Err.YAW, Err.YAW] += (float(self._state["now_rate"]) * ahead) ** 2
        self._jumped = jumped
        if jumped and plain:
            begin_epoch(self._states)
            self._aidings.forget()
        return plain

    def before(self, raw: tuple[Vector3, Vector3], rate: Array, force: Array, *, saturated: bool, at: float) -> None:
        """Judge the raw rate and force, and replace in ``rate`` and ``force`` (calibrated) what is not to be used."""
        gyro, accelerometer = self._readings.find_faults(*raw, saturated=saturated)
        state = self._state
        known = abs(at - self._rate_at) <= RATE_AGE
        measured = float(rate[2] - state["static_bias"][2] - state["bias"][2]) / (1.0 + float(state["scale"]))
        if gyro is None and self._gyro.faulty and known and abs(measured - self._rate) > CREDIBLE:
            gyro = self._gyro.fault
        self._follow(self._gyro, gyro)
        self._follow(self._force, accelerometer)
        bias = state["static_bias"] + state["bias"]
        if gyro is not None:
            rate[:] = bias
            rate[2] += (self._rate if known else self._sane_rate) * (1.0 + float(state["scale"]))
        else:
            self._sane_rate = measured
        if accelerometer is not None:
            force[:] = -float(self._config["gravity"]) * state["now_down"]
        self._hold()

    def after(self, status: Status, at: float) -> None:
        """See what the filter made of the cycle that ended at ``at`` (s, own clock)."""
        self._hold()
        state = self._state
        if state["mode"] == STATIC_BIAS:
            self._before_steps = None  # the constant bias is measured again
        if state["mode"] == STATIC_BIAS or Status.REFERENCE_CHANGED in status or self._gyro.faulty:
            self._aidings.forget()
            return
        rejected = Status.REJECTED in status
        if not rejected and (Status.AIDED not in status or Status.YAW_RESET in status):
            return
        sigma = math.sqrt(max(float(state["innovation_var"]), 0.0))
        found = self._aidings.find_mismatch(
            float(state["innovation"]),
            sigma,
            float(state["now_rate"]),
            at,
            rejected=rejected,
            reset=Status.YAW_RESET in status,
        )
        if found is not None:
            self._learn_mismatch(found)
        elif self._gyro.proving:
            self._agreed = 0 if rejected else self._agreed + (sigma < NARROW_STD)
            if self._agreed >= AGREEING:
                self._recover()

    def _contradicts(self, yaw: float, valid_local: float) -> bool:
        """Whether a reference at rest (rad) is beyond the gate while the gyroscope says that the node turns."""
        state = self._state
        if self._rate != 0.0 or state["still_cycles"] or not state["yaw_known"] or state["mode"] == STATIC_BIAS:
            return False
        then = from_binary(state["now_yaw"]) + float(state["now_rate"]) * (valid_local - float(state["now"]))
        var = float(state["now_P"][Err.YAW, Err.YAW]) + self._aiding_var
        return bool(abs(wrap(yaw - then)) > float(self._config["gate"]) * math.sqrt(var))

    def _follow(self, trust: Trust, fault: Fault | None) -> None:
        """Take one cycle's judgement of a sensor."""
        if fault is not None:
            told = Fault.BAD_SAMPLE in (trust.fault, fault) and trust is self._force
            if trust.fault is not fault and not told:
                self._report(fault.value, Severity.ERROR, {})
            trust.cycles = trust.cycles if trust.fault is not None else 0
            if trust is self._gyro and trust.fault is Fault.GYRO_STEP and trust.proving and self._step is not None:
                self._state["static_bias"][2] += self._step.rate  # what looked like a step was this fault's beginning
                self._step = None
            trust.fault, trust.proving, trust.sane = fault, False, 0
        elif trust.faulty:
            trust.sane += 1
            if trust.sane > SANE_CYCLES:
                self._release(trust)
        if trust.fault is not None:
            trust.cycles += 1

    def _hold(self) -> None:
        """Keep the safe state around a cycle: what needs the faulty sensor is unknown, and nothing is learnt."""
        state = self._state
        if self._gyro.faulty:
            for P in (state["P"], state["now_P"]):
                isolate(P, int(Err.YAW), UNKNOWN_YAW_VAR)
            state["bias_count"] = 0
            state["bias_sum"] = 0.0
        if self._force.faulty:
            state["surveyed"] = 1

    def _release(self, trust: Trust) -> None:
        """Use the readings again, with open variances."""
        state, config = self._state, self._config
        if trust is self._force:
            for tilt in (Err.TILT_X, Err.TILT_Y):
                isolate(state["P"], int(tilt), 1.0)
            state["surveyed"] = state["still_cycles"] = 0  # the average of a stop begins again
            self._report_recovered(trust)
            return
        trust.proving = True
        self._agreed = 0
        self._aidings.forget()
        isolate(state["P"], int(Err.YAW), UNKNOWN_YAW_VAR)
        for k in range(3):
            prior = float(config["bias_std"][k]) ** 2 + float(state["static_bias_var"][k])
            isolate(state["P"], int(Err.BIAS_X) + k, max(prior, float(state["P"][Err.BIAS_X + k, Err.BIAS_X + k])))
        isolate(state["P"], int(Err.SCALE), float(state["P"][Err.SCALE, Err.SCALE]))

    def _learn_mismatch(self, found: Mismatch) -> None:
        """A lasting mismatch belongs to the sensor: its bias or its scale takes it, and the yaw starts again."""
        state, config, trust = self._state, self._config, self._gyro
        found = self._reconsider(found)
        fault = found.fault
        prior = max(float(config["bias_std"][2]) ** 2 + float(state["static_bias_var"][2]), LEARNT_STD**2)
        scale_var = float(state["P"][Err.SCALE, Err.SCALE])
        learnable = found.steady and abs(found.rate) <= LARGEST_STEP
        if fault is Fault.GYRO_SCALE and float(config["scale_std"]) > 0.0:
            change = -found.rate / found.spin if abs(found.spin) > DEG else LARGEST_SCALE
            scale_var = max(scale_var, min(abs(change), LARGEST_SCALE) ** 2)
            learnable = True
            self._undo_steps()
        elif learnable:
            self._before_steps = self._before_steps or (float(state["static_bias"][2]), abs(found.rate))
            state["static_bias"][2] -= found.rate
            prior += (0.1 * found.rate) ** 2
        isolate(state["P"], int(Err.YAW), UNKNOWN_YAW_VAR)
        isolate(state["P"], int(Err.BIAS_Z), prior)
        isolate(state["P"], int(Err.SCALE), scale_var)
        isolate(state["now_P"], int(Err.YAW), UNKNOWN_YAW_VAR)
        state["rejected"] = 0
        self._step = found if fault is Fault.GYRO_STEP and learnable else None
        if trust.fault is not fault:
            self._report(fault.value, Severity.ERROR, {"mismatch_dps": found.rate / DEG, "spin_dps": found.spin / DEG})
        trust.cycles = trust.cycles if trust.fault is not None else 0
        trust.fault, trust.proving, trust.sane = fault, learnable, 0
        self._agreed = 0

    def _reconsider(self, found: Mismatch) -> Mismatch:
        """What a change of speed takes back was no step but the scale; the constant bias gets back what it took."""
        before = self._step
        if before is None or abs(found.spin - before.spin) < 0.5 * abs(before.spin):
            return found
        if not found.steady or abs(found.rate + before.rate) > 0.2 * abs(before.rate):
            return found
        self._state["static_bias"][2] += before.rate
        return Mismatch(Fault.GYRO_SCALE, before.rate, before.spin, steady=True)

    def _undo_steps(self) -> None:
        """Steps that cancelled each other were the scale that is learnt now: the constant bias is the earlier one."""
        if self._before_steps is None:
            return
        (constant, size), self._before_steps = self._before_steps, None
        if abs(float(self._state["static_bias"][2]) - constant) < STEADY * size:
            self._state["static_bias"][2] = constant
            self._state["bias"][2] = 0.0

    def _recover(self) -> None:
        state = self._state
        if self._gyro.fault is Fault.GYRO_STEP:  # it lasts, and the Gauss-Markov part would forget it
            state["static_bias"][2] += state["bias"][2]
            state["bias"][2] = 0.0
        # at rest the reference is one measurement, however often it was used
        var = max(float(state["P"][Err.YAW, Err.YAW]), self._aiding_var)
        isolate(state["P"], int(Err.YAW), var)
        state["now_P"][Err.YAW, Err.YAW] = max(float(state["now_P"][Err.YAW, Err.YAW]), var)
        self._report_recovered(self._gyro)

    def _report_recovered(self, trust: Trust) -> None:
        if trust.fault is not None and not (trust is self._force and trust.fault is Fault.BAD_SAMPLE):
            self._report("sensor_recovered", Severity.WARNING, {"after": trust.fault.value, "cycles": trust.cycles})
        trust.fault, trust.proving, trust.sane, trust.cycles = None, False, 0, 0

    def _report(self, code: str, severity: Severity, arguments: dict[str, Scalar]) -> None:
        self._pending.append((code, severity, arguments))


def begin_epoch(states: Array) -> None:
    """After a jump of the clock: earlier times and increments are void, and how far the string turned is unknown."""
    resume(states)
    state = states[0]
    state["yaw_known"] = 0
    state["last_sequence"] = -1
    state["last_aided"] = -math.inf
    state["stopped_at"] = math.nan
    isolate(state["P"], int(Err.YAW), UNKNOWN_YAW_VAR)
    state["now_P"] = state["P"]
