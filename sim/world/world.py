"""The world of one scenario and seed: what every sensor reads and what the truth is, at any rig time, in any order."""

from __future__ import annotations

import math
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from node.firmware.imu_settings import ImuSettings
from node.firmware.settings import Joint, PassedTube, TubeSettings
from node.firmware.torque import TorqueSettings
from node.kernels.calibration import USUAL
from node.kernels.layout import PERIOD, Scheme
from sim.errors import ScenarioError
from sim.faults import KillNode
from sim.world.disc import Disc
from sim.world.imu_errors import Drift, ImuErrors, single_samples
from sim.world.increments import borders_of, eighths
from sim.world.motion import Motion, Phase, Trapezoid
from sim.world.rack import Rack
from sim.world.radio import RadioLinks
from sim.world.rough_imu import Cycles
from sim.world.rough_run import RoughRun
from sim.world.rough_section import RoughSection
from sim.world.rough_truth import RoughTruth
from sim.world.scenario import Scenario
from sim.world.streams import Stream, stream
from sim.world.torsion import StringTorsion, stiffness
from sim.world.truth import TubeTruth, imu_frame
from telemetry.messages import BASE, ENCODER

Array = npt.NDArray[np.float64]
FREE_BEFORE = 1.0  # s before a joint is closed, at which a free head turns


def wrap(angle: float) -> float:
    """Angle (rad) in (-pi, pi]."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


class World:
    """Truth and sensors.

    Parameters
    ----------
    scenario : validated
    seed : of every draw; a stream depends on the seed, its purpose and its tube, on nothing else

    Raises
    ------
    ScenarioError
        When a fault falls outside the schedule, or cuts a node's power while the node is down.
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        self.scenario = scenario
        self.seed = seed
        file = scenario.file
        turn = Trapezoid(
            file.rotation.turns * 2.0 * math.pi,
            math.radians(file.rotation.rate_dps),
            math.radians(file.rotation.acceleration_dps2),
        )
        s = file.schedule
        self.first_angle = float(self._random(Stream.DRIVE, 0).uniform(0.0, 2.0 * math.pi))
        self.begin = s.begin_s
        self.rack = None if file.calibration is None else Rack(file.calibration, self.begin)
        drilling = s.begin_s if self.rack is None else self.rack.end
        self.motion = Motion(
            drilling,
            s.add_s,
            s.joint_s,
            s.stop_s,
            s.finish_s,
            turn,
            scenario.tubes,
            scenario.tube_length,
            self.first_angle,
            at_start=file.rig.tubes_at_start,
            blocks=s.blocks,
            advance=file.rotation.advance_m,
            depth_at_start=file.rig.depth_at_start_m,
        )
        self._made_up = self.motion.make_ups if file.rig.tubes_at_start else self.motion.make_ups[1:]
        self.torsion = self._string_torsion()
        self.phases: tuple[Phase, ...] = self.motion.phases
        self.end = self.motion.end
        self.faults: tuple[KillNode, ...] = scenario.faults
        self._noises = file.node.imu_noise or (1.0,) * file.node.imus
        self._samples: dict[tuple[int, int], Array] = {}
        self._parts: dict[tuple[int, int], Array] = {}
        self._rough_cycles: dict[tuple[int, int], Cycles] = {}
        self._rough_truths: dict[int, RoughTruth] = {}
        edge_std = math.radians(file.encoder.edge_std_deg)
        free_at = (self._made_up - FREE_BEFORE).tolist() if file.joints.head_turn_deg else []
        free_by = self._free_turns.tolist() if file.joints.head_turn_deg else []
        disc_random = self._random(Stream.DISC, 0)
        self.disc = Disc(self.motion, file.encoder.counts_per_turn, edge_std, disc_random, free_at, free_by)
        self._check_faults()
        self.radio = self._radio_links()

    @property
    def cycles(self) -> int:
        """Cycles of the whole schedule."""
        return math.floor((self.end - self.begin) / PERIOD + 1e-9)

    @cached_property
    def ends(self) -> Array:
        """Rig times (cycles,) at which the cycles of the encoder end."""
        return np.asarray(self.begin + PERIOD * np.arange(1.0, self.cycles + 1.0))

    def cycle_end(self, cycle: int) -> float:
        """Rig time at which the cycle ``cycle`` (from 0) of the encoder ends."""
        return self.begin + (cycle + 1) * PERIOD

    def phase(self, tube: int) -> float:
        """Time (s) by which a tube's cycles end after those of the encoder, less than a cycle."""
        return self._phases[tube]

    def imu_sample(self, tube: int, cycle: int) -> list[Any]:
        """Three mean rates (rad/s) and three mean specific forces (m/s^2) of one cycle, errors and all.

        In a rough world temperature (C), bits of what was clipped, the lateness of the window and its standard
        deviation (s) follow, and of a sensor that tells increments nine rates about z (rad/s) of its inside. Of several
        IMUs a list of such lists.
        """
        one, *others = [self._imu_sample(tube, cycle, imu) for imu in range(len(self._noises))]
        return [one, *others] if others else one

    def _imu_sample(self, tube: int, cycle: int, imu: int) -> list[Any]:
        sample: list[Any] = self.imu_samples(tube, imu)[cycle].tolist()
        parts = self.imu_parts(tube, imu)
        known = parts is not None and bool(np.isfinite(parts[cycle]).all())
        if self.scenario.file.rough is not None:
            found = self.rough_cycles(tube, imu)
            sample += [float(found.temperature[cycle]), int(found.clipped[cycle])]
            sample += [float(found.late[cycle]), float(found.late_std[cycle])]
        elif known:
            sample += [USUAL, 0, 0.0, 0.0]
        return sample + parts[cycle].tolist() if parts is not None and known else sample

    def encoder_sample(self, t: float) -> tuple[int, float, int, float | None, tuple[float, ...]]:
        """Count, rig time of its last edge, 1 (the string turns one way, so every edge rises), torque, earlier edges.

        A rig of a rigid string, or one that is to ignore its torsion, has no torque (N m): None. In a rough world an
        edge may fall.
        """
        rising = 1
        if self.scenario.file.rough is not None:
            count, edge_at, rising, earlier = self.rough_run.disc.sample(t)
        else:
            count, edge_at, earlier = self.disc.sample(t, self._head_angles.get(t))
        if t <= self.motion.begin:
            edge_at = self.begin
        if self.torsion is None or self.scenario.file.node.torsion == "ignore":
            return count, edge_at, rising, None, earlier
        torque = self._torques.get(t)
        if torque is None:
            torque = float(self.torsion.torque(np.array([t]))[0])
        return count, edge_at, rising, torque, earlier

    def bit_depth(self, t: float) -> float:
        """Measured depth of the bit, m."""
        return float(self.motion.depth(np.array([t]))[0][0])

    def local_clock(self, address: int, t: float) -> float:
        """What the clock of a process shows at rig time ``t`` (s)."""
        offset, drift = self._clocks[address]
        return t + offset + drift * (t - self.begin)

    def true_time(self, address: int, local: float) -> float:
        """Rig time at which the clock of a process shows ``local`` (s)."""
        offset, drift = self._clocks[address]
        return self.begin + (local - offset - self.begin) / (1.0 + drift)

    def tube_settings(self, tube: int) -> TubeSettings:
        """What the crew enters for a tube: the readings of its scribe marks and their stated errors."""
        joints = self._read_joints(tube)
        passed = range(tube + 1, min(tube + self.reach - 1, self.scenario.tubes) + 1)
        return TubeSettings(
            tube=tube,
            drive_joint=joints.drive_joint,
            lower_joint=joints.lower_joint,
            mount_std=math.radians(self.scenario.file.joints.mount_std_deg),
            scheme=Scheme[self.scenario.file.node.scheme.upper()],
            kernel=self.scenario.file.node.kernel,
            stiffness=self._stiffness,
            torsion="variance" if self.scenario.file.node.torsion == "variance" else "gate",
            joints=self.scenario.file.node.joints,
            imus=tuple(ImuSettings((self.scenario.file.accelerometer.radius_m, 0.0), noise) for noise in self._noises),
            reach=self.reach,
            above=tuple(self._read_joints(other) for other in passed),
        )

    @property
    def reach(self) -> int:
        """Tubes away that a node hears."""
        return 1 if self.radio is None else self.radio.reach

    def _read_joints(self, tube: int) -> PassedTube:
        """What the crew reads from the scribe marks of a tube."""
        std = math.radians(self.scenario.file.joints.reading_std_deg)
        drive, lower = self._joint_angles
        drive_error, lower_error = self._joint_errors
        misread = self._misread(tube)
        return PassedTube(
            Joint(wrap(drive[tube] - self._turned_before(tube) + drive_error[tube] + misread), std),
            Joint(wrap(lower[tube] + lower_error[tube]), std),
        )

    def _misread(self, tube: int) -> float:
        """Blunder (rad) in the mark between the head and a tube: of the first that is added, or that is there."""
        rough, rig = self.scenario.file.rough, self.scenario.file.rig
        first = min(max(rig.tubes_at_start, 1) + 1, rig.tubes)
        return math.radians(rough.string.wrong_mark_deg) if rough is not None and tube == first else 0.0

    def _radio_links(self) -> RadioLinks | None:
        section = self.scenario.file.radio
        if section is None:
            return None
        hole = self.scenario.hole
        return RadioLinks(
            section,
            self.seed,
            self.scenario.tubes,
            self.scenario.tube_length,
            self.begin,
            self.end,
            self.bit_depth,
            lambda md: float(hole.position(md)[2]),
        )

    def torque_settings(self) -> TorqueSettings:
        """What the crew enters at the encoder node; the drilling torque is what an encoder node starts from."""
        section = self.scenario.file.torsion
        if section is None or self.scenario.file.node.torsion == "ignore":
            return TorqueSettings()
        return TorqueSettings(section.bit_torque_nm, section.trapped_fraction)

    def yaw_truth(self, tube: int, t: float) -> float:
        """True yaw (rad, unwrapped) of the IMU's frame of a tube that is part of the string."""
        return float(self.truth(tube).yaw(np.array([t]))[0])

    def systematic_error(self, tube: int, t: float) -> float:
        """Constant part of a yaw's error at one rig time, rad; see ``systematic_errors``."""
        return float(self.systematic_errors(tube, np.array([t]))[0])

    def systematic_errors(self, tube: int, t: Array) -> Array:
        """Errors (n,) of a yaw known only through the marks: estimate - truth = random error + this (rad).

        Where joints are solved it is the mark of the time when the tube was on top, and what each solution left.
        """
        if self.scenario.file.node.joints == "marks":
            errors = np.array([self.marks_error(tube, top) for top in range(tube, self.scenario.tubes + 1)])
            rigid = errors[np.maximum(self.motion.tops(t), tube) - tube]
        else:
            made_up = max(self.scenario.file.rig.tubes_at_start, tube)
            rigid = self.marks_error(tube, made_up) - self.unseen(tube, t)
        return np.asarray(rigid if self.torsion is None else rigid + self.torsion.twist(tube, t)[0])

    def marks_error(self, tube: int, top: int) -> float:
        """What the marks from the head to a tube are wrong by while ``top`` is the top tube, rad."""
        drive_error, lower_error = self._joint_errors
        above = sum(lower_error[k] for k in range(tube + 1, top + 1))
        return drive_error[top] + above - self._mounts[tube]

    def truth_station(self, md: float) -> dict[str, float]:
        """Direction and position of the hole at one depth, degrees and metres."""
        inclination, azimuth = self.scenario.hole.direction(md)
        north, east, tvd = self.scenario.hole.position(md)
        return {
            "md_m": md,
            "inclination_deg": math.degrees(inclination),
            "azimuth_deg": math.degrees(azimuth),
            "north_m": float(north),
            "east_m": float(east),
            "tvd_m": float(tvd),
        }

    def truth(self, tube: int) -> TubeTruth:
        """Perfect sensor of a tube."""
        a = self.scenario.file.accelerometer
        below = (tube - 1) * self.scenario.tube_length
        joint = self.frame_angle(tube)
        twist = None if self.torsion is None else partial(self.torsion.twist, tube)
        slips = partial(self.unseen, tube) if self.scenario.file.joints.unseen_std_deg else None
        hole, motion = self.scenario.hole, self.motion
        if self.scenario.file.rough is None:
            return TubeTruth(hole, motion, below, joint, a.radius_m, a.gravity_mps2, twist, slips)
        return self._rough_truth(tube, joint, a.radius_m, a.gravity_mps2, slips)

    def rough_cycles(self, tube: int, imu: int = 0) -> Cycles:
        """Readings of a tube in a rough world, cycle by cycle, with temperature and what was clipped."""
        rough = self.rough_run
        if (tube, imu) not in self._rough_cycles:
            file, ends = self.scenario.file, self.ends + self.phase(tube)
            rate, force = rough.perfect(self.truth(tube), self.imu_frame(tube, imu))
            bias = np.zeros((len(ends), 3))
            bias[:, 2] = self._bias_step(ends)
            if (drift := self.drift(tube, imu)) is not None:
                bias, force = bias + drift.rate, force @ drift.matrix.T + drift.bias
            errors = ImuErrors(file.gyroscope, file.accelerometer).times(self._noises[imu])
            self._rough_cycles[tube, imu] = rough.imu(errors, tube, imu).cycles(rate, force, ends, bias)
        return self._rough_cycles[tube, imu]

    @cached_property
    def rough_run(self) -> RoughRun:
        """What the table ``rough`` makes of this run."""
        section = self.scenario.file.rough or RoughSection()
        return RoughRun(section, self.motion, self.begin, self.seed, self.disc.errors)

    def _rough_truth(self, tube: int, *given: Any) -> RoughTruth:
        if tube not in self._rough_truths:
            twist = None if self.torsion is None else partial(self.torsion.twist, tube)
            below = (tube - 1) * self.scenario.tube_length
            self._rough_truths[tube] = self.rough_run.truth(tube, self.scenario.hole, below, twist, *given)
        return self._rough_truths[tube]

    def frame_angle(self, tube: int) -> float:
        """Angle (rad) from the head to the IMU's frame of a tube.

        Joints below the head are rigid: a tube keeps for ever the angle it had while it was the top one.
        """
        return self._joint_angles[0][tube] + self._mounts[tube]

    def unseen(self, tube: int, t: Array) -> Array:
        """What a tube has slipped (rad) by rig times (n,) since its own make-up, at the make-ups of those above."""
        first = max(tube - max(self.scenario.file.rig.tubes_at_start, 1), 0)
        sums = np.concatenate([np.zeros(first + 1), np.cumsum(self._slips[first:])])
        return np.asarray(sums[np.searchsorted(self._made_up, t, side="right")])

    def drift(self, tube: int, imu: int = 0) -> Drift | None:
        """What became of a tube's sensors since their calibration."""
        section = self.scenario.file.drift
        return None if section is None else Drift.draw(section, self._random(Stream.DRIFT, tube, imu))

    def imu_frame(self, tube: int, imu: int = 0) -> Array:
        """R_imu_from_tube (3, 3): how an IMU (from 0) of a tube leans against the tube's axis."""
        return imu_frame(*self.imu_tilt(tube, imu))

    def imu_tilt(self, tube: int, imu: int = 0) -> tuple[float, float]:
        """Pitch and roll (rad) of that lean."""
        std = math.radians(self.scenario.file.joints.mount_tilt_std_deg)
        pitch, roll = (std * self._random(Stream.MOUNTS, tube, imu).standard_normal(2)).tolist()
        return pitch, roll

    @property
    def _stiffness(self) -> float:
        """Of a tube as the crew knows it, N m/rad."""
        section = self.scenario.file.torsion
        return math.inf if section is None else stiffness(section, self.scenario.tube_length)

    def _string_torsion(self) -> StringTorsion | None:
        section = self.scenario.file.torsion
        if section is None:
            return None
        lengths = self.motion.lengths.astype(float)
        trapped = section.trapped_fraction * np.abs(self._random(Stream.TORSION, 0).standard_normal(len(lengths)))
        return StringTorsion(section, self.motion, self.scenario.tube_length, lengths, trapped)

    def imu_samples(self, tube: int, imu: int = 0) -> Array:
        """Samples (cycles, 6) of the whole schedule, see ``imu_sample``."""
        if self.scenario.file.rough is not None:
            return self.rough_cycles(tube, imu).readings
        if (tube, imu) not in self._samples:
            self._samples[tube, imu] = self.readings(tube, self.ends + self.phase(tube), PERIOD, imu)
        return self._samples[tube, imu]

    def imu_parts(self, tube: int, imu: int = 0) -> Array | None:
        """What is told of the inside of the cycles (cycles, 9) rad/s; NaN where, and None if, nothing is."""
        file = self.scenario.file
        if file.rough is not None:
            return self.rough_cycles(tube, imu).parts
        if not file.gyroscope.increments or file.gyroscope.instantaneous:
            return None
        if (tube, imu) not in self._parts:
            self._parts[tube, imu] = self._eighths(tube, imu)
        return self._parts[tube, imu]

    def _eighths(self, tube: int, imu: int) -> Array:
        ends, random = self.ends + self.phase(tube), self._random(Stream.GYRO, tube, imu)
        errors = ImuErrors(self.scenario.file.gyroscope, self.scenario.file.accelerometer).times(self._noises[imu])
        shown = float((errors.constants(random)[1] @ self.imu_frame(tube, imu)[:, 2])[2])  # of a turn about the axis
        borders = borders_of(ends)
        turned = self.truth(tube).turned(borders.ravel())[0].reshape(borders.shape)
        noise = self._random(Stream.INCREMENTS, tube, imu)
        found = eighths(self.imu_samples(tube, imu)[:, 2], shown * np.diff(turned, axis=1), errors.gyroscope, noise)
        if self.rack is not None:
            found[ends <= self.rack.end] = np.nan
        return found

    def readings(self, tube: int, ends: Array, period: float, imu: int = 0) -> Array:
        """Readings (n, 6) of the means over ``period`` (s) that end at the rig times ``ends`` (n,), one after another.

        The noise of the accelerometer is stated for one cycle, and so is larger over less.
        """
        truth, file = self.truth(tube), self.scenario.file
        rate, force = truth.cycle_means(ends, period)
        gyroscope, accelerometer = file.gyroscope, file.accelerometer
        if gyroscope.instantaneous:
            rate, gyroscope = truth.rate(ends), single_samples(gyroscope, period)
        if period != PERIOD:
            noise_deg = accelerometer.noise_deg * math.sqrt(PERIOD / period)
            accelerometer = accelerometer.model_copy(update={"noise_deg": noise_deg})
        if self.rack is not None:
            racked = ends <= self.rack.end
            held = self.rack.truth(self._random(Stream.RACK, tube), self._mounts[tube], file.accelerometer.gravity_mps2)
            rate[racked], force[racked] = held.cycle_means(ends[racked], period)
        frame = self.imu_frame(tube, imu)
        rate, force = rate @ frame.T, force @ frame.T
        turning = (self.motion.drive(ends)[1] > 0.0) | (self.motion.drive(ends - period)[1] > 0.0)
        rate[:, 2] += self._bias_step(ends)
        felt = force
        if (drift := self.drift(tube, imu)) is not None:
            rate, felt = rate + drift.rate, force @ drift.matrix.T + drift.bias
        errors = ImuErrors(gyroscope, accelerometer).times(self._noises[imu])
        measured_rate = errors.gyro(self._random(Stream.GYRO, tube, imu), rate, force, period)
        measured_force = errors.accelerations(
            self._random(Stream.ACCELEROMETER, tube, imu), felt, turning.astype(float)
        )
        return np.concatenate([measured_rate, measured_force], axis=1)

    def gyro_bias(self, tube: int) -> Array:
        """True bias (cycles,) of a tube's z gyroscope, rad/s: the draws of its readings without noise and scale."""
        clean = {"noise_dps_rthz": (0.0, 0.0, 0.0), "scale_factor_std": 0.0, "resolution_dps": 0.0}
        section = self.scenario.file.gyroscope.model_copy(update=clean)
        still = np.zeros((self.cycles, 3))
        errors = ImuErrors(section, self.scenario.file.accelerometer)
        drawn = errors.gyro(self._random(Stream.GYRO, tube), still, still, PERIOD)[:, 2]
        return np.asarray(drawn + self._bias_step(self.ends + self.phase(tube)))

    def _bias_step(self, ends: Array) -> Array:
        turns_from = next(phase.start for phase in self.phases if phase.kind == "drill")
        return np.asarray(math.radians(self.scenario.file.gyroscope.bias_step_dps) * (ends > turns_from))

    @cached_property
    def _torques(self) -> dict[float, float]:
        """Torque of the drive (N m) at the end of every cycle of the encoder, all worked out at once."""
        if self.torsion is None:
            return {}
        return dict(zip(self.ends.tolist(), self.torsion.torque(self.ends).tolist(), strict=True))

    @cached_property
    def _head_angles(self) -> dict[float, float]:
        """Angle of the head (rad) at the end of every cycle, by its rig time."""
        return dict(zip(self.ends.tolist(), self.disc.angles(self.ends).tolist(), strict=True))

    @cached_property
    def _phases(self) -> list[float]:
        draws = PERIOD * self._random(Stream.PHASES, 0).random(self.scenario.tubes + 1)
        locked = self.scenario.file.encoder.phase == "locked"
        return [0.0] * len(draws) if locked else draws.tolist()

    @cached_property
    def _slips(self) -> Array:
        """What the string below turns unseen at each make-up, rad."""
        std = math.radians(self.scenario.file.joints.unseen_std_deg)
        return np.asarray(std * self._random(Stream.SLIPS, 0).standard_normal(len(self._made_up)))

    @cached_property
    def _free_turns(self) -> Array:
        """What the head turns, free of the string, before each make-up, rad."""
        size = math.radians(self.scenario.file.joints.head_turn_deg)
        return np.asarray(size * self._random(Stream.SLIPS, 1).uniform(0.5, 1.5, len(self._made_up)))

    def _turned_before(self, tube: int) -> float:
        """What the head has turned free of the string when a tube is made up to it, rad."""
        made_up = tube - max(self.scenario.file.rig.tubes_at_start, 1)
        return float(np.sum(self._free_turns[: max(made_up, 0)]))

    @cached_property
    def _joint_angles(self) -> tuple[list[float], list[float]]:
        """True angles by tube (index 0 unused): drive head to tube while it is on top, tube to the one below.

        The string stands while a tube is added, so the new pair of joints adds up to the old one.
        """
        random = self._random(Stream.JOINTS, 0)
        drive, lower = [0.0], [0.0]
        for tube in range(1, self.scenario.tubes + 1):
            angle = float(random.uniform(-math.pi, math.pi))
            made_up = tube - max(self.scenario.file.rig.tubes_at_start, 1)
            slip = float(self._slips[made_up - 1]) if made_up > 0 else 0.0
            lower.append(angle if tube > 1 else 0.0)
            drive.append(drive[tube - 1] - angle + slip if tube > 1 else angle)
        return drive, lower

    @cached_property
    def _joint_errors(self) -> tuple[list[float], list[float]]:
        random = self._random(Stream.JOINTS, 1)
        std = math.radians(self.scenario.file.joints.reading_std_deg)
        draws = std * random.standard_normal((self.scenario.tubes + 1, 2))
        draws[:2, 1] = 0.0  # the lowest tube has no joint below
        return draws[:, 0].tolist(), draws[:, 1].tolist()

    @cached_property
    def _mounts(self) -> list[float]:
        std = math.radians(self.scenario.file.joints.mount_std_deg)
        errors: list[float] = (std * self._random(Stream.MOUNTS, 0).standard_normal(self.scenario.tubes + 1)).tolist()
        return errors

    @cached_property
    def _clocks(self) -> dict[int, tuple[float, float]]:
        """Offset (s) and drift of the clock of each process against that of the encoder, by address."""
        clocks = self.scenario.file.clocks
        draws = self._random(Stream.CLOCKS, 0).standard_normal((self.scenario.tubes + 1, 2))
        drawn = [(clocks.offset_std_s * a, clocks.drift_std_ppm * 1e-6 * b) for a, b in draws.tolist()]
        return {ENCODER: (0.0, 0.0), BASE: drawn[0]} | dict(enumerate(drawn[1:], 1))

    def _random(self, purpose: Stream, tube: int, imu: int = 0) -> np.random.Generator:
        further = [imu] if imu else []  # the first IMU of a tube draws what it draws alone
        return stream(self.seed, purpose, tube, *further)

    def _check_faults(self) -> None:
        racked = self.rack.end if self.rack is not None else self.begin
        for fault in self.faults:
            if self.begin + fault.after + fault.down < racked:
                continue
            added = (phase.start for phase in self.phases if phase.kind == "add" and phase.tube == fault.address)
            on = next(added, self.begin)  # a tube in the hole from the start is not added
            if not on < self.begin + fault.after < self.end - fault.down:
                raise ScenarioError(
                    f"fault {fault}: expected a time between {on - self.begin:.0f} s, "
                    f"when the tube is added, and {self.end - fault.down - self.begin:.0f} s"
                )
        in_order = sorted(self.faults, key=lambda fault: (fault.address, fault.after))
        for first, second in pairwise(in_order):
            if first.address == second.address and second.after <= first.after + first.down:
                raise ScenarioError(
                    f"fault {second}: expected a time after {first.after + first.down:g} s, "
                    f"for the node is down until then by {first}"
                )
