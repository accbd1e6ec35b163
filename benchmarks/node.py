"""The node's cycle against the same algorithm in C, a Kalman filter library and an AHRS, side by side in one run.

Run it as ``borechain bench node``. The inputs are what tube 1 reads and hears while the published bore is drilled
(``World`` at a fixed seed). Ours and C take them inside one compiled loop; the libraries are called step by step from
Python, as they are made to be, and so is our cycle beside them. Every pair is timed in alternating blocks, in the
processor's time of this thread; a figure is the median over the blocks, and so is a ratio. ``ratio`` is how many times
faster ours is, ``ours_to_peer`` its inverse, ``at_most`` what is asked of that.
"""

from __future__ import annotations

import ctypes
import importlib.util
import math
import os
import shlex
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from borechain.cli.faults import EnvironmentFault
from node.firmware.encoder_node import EncoderNode, EncoderSample
from node.kernels.arithmetic.angles import advance_binary, from_binary
from node.kernels.arithmetic.formats import CYCLE_RATE_HZ, DEG, PERIOD
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.filter.float64.fixed_lag import apply_aiding
from node.kernels.filter.float64.propagation import propagate_covariance
from node.kernels.filter.float64.strapdown import rotate_down, yaw_rate
from node.kernels.record.filter_record import CONFIG, STATE, STATES, default_config, new_state
from node.kernels.string.relay import offer_aiding
from sim.world.scenario import load_scenario
from sim.world.world import World

ROOT = Path(__file__).parents[1]
SOURCE = Path(__file__).parent / "c" / "node.c"
LAYOUT = "node/kernels/record/filter_record.py"
FLAGS = ("-std=gnu11", "-O3", "-march=native")
UNFUSED = "-ffp-contract=off"  # every product rounded by itself, as ours does
SEED = 1
TUBE = 1
BLOCKS = 101
PASSES = 1  # of the recording in one block
AT_MOST_C, AT_MOST_FILTERPY, AT_MOST_FIXED = 1.5, 1.0 / 50.0, 3.0  # times the other's time

INPUT = np.dtype(
    [
        ("rate", "f8", (3,)),
        ("force", "f8", (3,)),
        ("start", "f8"),
        ("end", "f8"),
        ("joined", "i8"),
        ("aided", "i8"),
        ("yaw", "f8"),
        ("yaw_var", "f8"),
        ("systematic_var", "f8"),
        ("offset", "f8"),
        ("turn_rate", "f8"),
        ("valid_at", "f8"),
        ("sequence", "i8"),
        ("hops", "i8"),
    ],
    align=True,
)
HEARD = ("yaw", "yaw_var", "systematic_var", "offset", "valid_at", "sequence", "hops")
OUTPUT = np.dtype([("status", "i8"), ("yaw", "u4"), ("var", "f8", (STATES,))], align=True)
FIXED_INPUT, FIXED_OUTPUT = (
    np.dtype(
        [(name, "u4" if name == "yaw" and d is OUTPUT else "i8", d[name].shape) for name in d.names or ()], align=True
    )
    for d in (INPUT, OUTPUT)
)
Runner = Callable[[Any, Any, Any, Any, Any, int], None]
LAYOUTS = (STATE, CONFIG, INPUT, OUTPUT)


def record_inputs(seed: int = SEED) -> Any:
    """All that the lowest tube takes in over the whole bore, one record of dtype ``INPUT`` a cycle.

    The encoder's measurement reaches it before its next cycle, through every joint above, or is lost on the way.
    """
    world = World(load_scenario(ROOT / "scenarios" / "wellbore-1.toml"), seed)
    count = math.floor((world.end - world.begin) * CYCLE_RATE_HZ + 1e-9)
    settings = {tube: world.tube_settings(tube) for tube in range(1, world.scenario.tubes + 1)}
    random = np.random.Generator(np.random.Philox(seed))
    kept = 1.0 - world.scenario.file.medium.loss
    inputs, encoder = np.zeros(count, INPUT), EncoderNode()
    open_joints = [(p.start, p.joint_closed, p.tube) for p in world.phases if p.kind == "add"]
    for k in range(count):
        entry, end = inputs[k], world.cycle_end(k)
        sample = world.imu_sample(TUBE, k)
        entry["rate"], entry["force"] = sample[:3], sample[3:]
        entry["start"], entry["end"] = (world.local_clock(TUBE, t) for t in (end - PERIOD, end))
        opened = [tube for start, closed, tube in open_joints if start < end <= closed]
        entry["joined"] = 0 if opened and opened[0] <= TUBE + 1 else 1
        if k + 1 == count:
            break
        edge_count, edge_at, rising, torque, earlier = world.encoder_sample(end)
        aiding = encoder.on_cycle(EncoderSample(edge_count, edge_at, bool(rising), torque, earlier=earlier), end)
        top = world.motion.top(end)
        if opened or random.random() > kept**top:
            continue
        drive, above = settings[top].drive_joint, [settings[t].lower_joint for t in range(TUBE + 1, top + 1)]
        following = inputs[k + 1]
        following["aided"] = 1
        following["yaw"], following["yaw_var"], following["turn_rate"] = aiding.yaw, aiding.yaw_var, aiding.rate
        following["valid_at"] = world.local_clock(TUBE, aiding.valid_at)
        following["offset"] = math.remainder(drive.angle + sum(j.angle for j in above), 2.0 * math.pi)
        following["systematic_var"] = drive.std**2 + sum(j.std**2 for j in above)
        following["sequence"], following["hops"] = aiding.sequence, top - 1
    return inputs


def looped(cycle: Any, offer: Any) -> Runner:
    """Loop over all inputs, to be compiled whole with the kernels ``run_cycle`` and ``offer_aiding`` of one arithmetic.

    Its arguments: ``begin``, ``state`` and ``config``, arrays of one record each; ``inputs`` and ``outputs``, arrays
    of one record a cycle; ``passes``, how often to take all inputs, each time from the state ``begin``.
    """

    def run(begin: Any, state: Any, config: Any, inputs: Any, outputs: Any, passes: int) -> None:
        own, settings = state[0], config[0]
        for _ in range(passes):
            state[0] = begin[0]
            for k in range(inputs.size):
                i, out = inputs[k], outputs[k]
                status = 0
                if i.aided == 1:
                    status = offer(
                        own, settings, i.yaw, i.yaw_var, i.systematic_var, i.offset, i.valid_at, i.sequence, i.hops,
                    )  # fmt: skip
                out.status = status | cycle(own, settings, i.rate, i.force, i.start, i.end, i.joined)
                out.yaw = own.now_yaw
                for j in range(STATES):
                    out.var[j] = own.now_P[j, j]

    return run


run_compiled: Runner = njit(error_model="numpy")(looped(run_cycle, offer_aiding))


def build_c(folder: Path, *extra: str) -> Runner:
    """Compile the C form of the cycle in ``folder``; returns it with the arguments of ``run_compiled``.

    Raises
    ------
    EnvironmentFault
        When there is no C compiler (``$CC``, else ``cc``) or it refuses.
    """
    library = folder / "node.so"
    compiler = shlex.split(os.environ.get("CC") or "cc")
    command = [*compiler, *FLAGS, *extra, "-shared", "-fPIC", "-o", str(library), str(SOURCE), "-lm"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise EnvironmentFault(f"bench node needs a C compiler; no {compiler[0]!r} (CC may name another)") from error
    if done.returncode:
        said = (done.stderr.strip() or "nothing said").splitlines()[0]
        raise EnvironmentFault(f"{shlex.join(compiler)} cannot compile {SOURCE}: {said}")
    loaded = ctypes.CDLL(str(library))
    for name in ("node_size", "node_end"):
        getattr(loaded, name).restype = ctypes.c_size_t
    for which, dtype in enumerate(LAYOUTS):
        last = (dtype.names or ())[-1]
        offset = int(dtype.fields[last][1]) if dtype.fields else 0
        ours = dtype.itemsize, offset
        if ours != (loaded.node_size(which), loaded.node_end(which)):
            raise EnvironmentFault(
                f"{SOURCE}: its record {which} is laid out differently from node/kernels/record/filter_record.py"
            )
    pointer = ctypes.c_void_p
    loaded.node_run.argtypes = [pointer] * 4 + [ctypes.c_int64, pointer, ctypes.c_int64]
    loaded.node_run.restype = None

    def run_c(begin: Any, state: Any, config: Any, inputs: Any, outputs: Any, passes: int) -> None:
        first = (array.ctypes.data for array in (begin, state, config, inputs))
        loaded.node_run(*first, len(inputs), outputs.ctypes.data, passes)

    return run_c


class Stretch:
    """A part of the recording and the state that the node has at its begin."""

    def __init__(self, inputs: Any, begin: int, end: int) -> None:
        self.config = default_config()
        self.begin = new_state(self.config)
        run_compiled(self.begin.copy(), self.begin, self.config, inputs[:begin], np.zeros(begin, OUTPUT), 1)
        self.inputs = inputs[begin:end].copy()
        self.state, self.outputs = self.begin.copy(), np.zeros(end - begin, OUTPUT)
        self.passes = max(PASSES * len(inputs) // (end - begin), 1)

    def seconds(self, run: Runner) -> float:
        """Seconds of one cycle of ``run``, over all passes of a block."""
        begin = time.thread_time()
        run(self.begin, self.state, self.config, self.inputs, self.outputs, self.passes)
        return (time.thread_time() - begin) / (self.passes * len(self.inputs))


class FixedStretch(Stretch):
    """The same part of the recording in integers, as the fixed-point loop takes it in."""

    def __init__(self, like: Stretch) -> None:
        from node.kernels.arithmetic import formats as q
        from node.kernels.record import filter_conversion

        gravity = float(like.config[0]["gravity"])
        self.config, _ = filter_conversion.config_in_integers(like.config[0])
        self.begin = filter_conversion.state_in_integers(like.begin[0], gravity)
        self.state, self.passes = self.begin.copy(), like.passes
        self.outputs = np.zeros(len(like.inputs), FIXED_OUTPUT)
        self.inputs = np.zeros(len(like.inputs), FIXED_INPUT)
        formats = dict.fromkeys(("rate", "turn_rate"), q.RATE_Q)
        formats |= dict.fromkeys(("yaw", "offset"), q.ANGLE_Q)
        formats |= dict.fromkeys(("start", "end", "valid_at"), q.TIME_Q)
        formats |= dict.fromkeys(("yaw_var", "systematic_var"), q.VAR_Q)
        for name in FIXED_INPUT.names or ():
            value = like.inputs[name]
            if name == "force":
                value = np.rint(value / gravity * 2.0**q.FORCE_Q)
            elif name in formats:
                value = np.rint(value * 2.0 ** formats[name])
            self.inputs[name] = value


def fixed_runner() -> Runner | None:
    """The fixed-point loop with the arguments of ``run_compiled``; None where there is none."""
    if importlib.util.find_spec("node.kernels.filter.fixed") is None:
        return None
    from node.kernels.filter.fixed.cycle import run_cycle
    from node.kernels.string.relay import offer_aiding

    runner: Runner = njit(error_model="numpy")(looped(run_cycle, offer_aiding))
    return runner


def timed(stretch: Stretch, run: Runner) -> Callable[[], float]:
    """Measurement of ``run`` over a stretch."""
    return lambda: stretch.seconds(run)


def alternating(ours: Callable[[], float], peer: Callable[[], float], at_most: float | None = None) -> dict[str, Any]:
    """Seconds of both, measured in turn after one that warms up, and their ratio with its quartiles."""
    ours(), peer()
    pairs = np.array([(ours(), peer()) for _ in range(BLOCKS)])
    ratios = pairs[:, 1] / pairs[:, 0]
    low, middle, high = (float(x) for x in np.quantile(ratios, (0.25, 0.5, 0.75)))
    row = {
        "ours": statistics.median(pairs[:, 0].tolist()),
        "peer": statistics.median(pairs[:, 1].tolist()),
        "ratio": middle,
        "ratio_quartiles": [low, high],
        "ours_to_peer": 1.0 / middle,
        "ours_to_peer_quartiles": [1.0 / high, 1.0 / low],
    }
    return row if at_most is None else row | {"at_most": at_most}


def call_time(step: Callable[..., Any], arguments: list[Any]) -> float:
    """Seconds of one call of ``step`` from Python, over all ``arguments``."""
    begin = time.thread_time()
    for entry in arguments:
        step(*entry)
    return (time.thread_time() - begin) / len(arguments)


@njit(error_model="numpy")
def run_steps(begin: Any, state: Any, config: Any, inputs: Any, outputs: Any, passes: int) -> None:
    """One prediction over a cycle and one update with a yaw for each input, by our kernels; see ``run_compiled``."""
    own, settings = state[0], config[0]
    for _ in range(passes):
        state[0] = begin[0]
        for k in range(inputs.size):
            i, out = inputs[k], outputs[k]
            wx, wy, wz = i.rate[0], i.rate[1], i.rate[2]
            rotate_down(own.down, wx, wy, wz, PERIOD)
            own.yaw = advance_binary(own.yaw, yaw_rate(own.down, wx, wy, wz) * PERIOD)
            propagate_covariance(own.P, wz, PERIOD, 1.0, settings)
            var = i.yaw_var + settings.aiding_floor_var
            out.status = apply_aiding(own, settings, from_binary(own.yaw), var, i.turn_rate, i.end)
            out.yaw = own.yaw


class OurCalls:
    """Our cycle with its aiding, called from Python once for each input of a stretch."""

    def __init__(self, stretch: Stretch) -> None:
        self.stretch = stretch
        self.arguments = [
            (
                tuple(i[name].item() for name in HEARD) if i["aided"] else None,
                (i["rate"].copy(), i["force"].copy(), *(i[name].item() for name in ("start", "end", "joined"))),
            )
            for i in stretch.inputs
        ]

    def seconds(self) -> float:
        """Seconds of one cycle."""
        stretch = self.stretch
        stretch.state[:] = stretch.begin
        own, settings = stretch.state[0], stretch.config[0]

        def step(heard: Any, read: Any) -> None:
            if heard is not None:
                offer_aiding(own, settings, *heard)
            run_cycle(own, settings, *read)

        return call_time(step, self.arguments)


class FilterpyCalls:
    """Predictions and updates of filterpy's extended Kalman filter with our eight error states.

    Parameters
    ----------
    stretch : the inputs
    ekf : filter of eight states and one measurement
    predictions : to one update; ours makes three while turning: to the time of validity, to the cycle's end, to now
    """

    def __init__(self, stretch: Stretch, ekf: Any, predictions: int) -> None:
        config = stretch.config[0]
        self.dt, self.predictions = PERIOD / predictions, predictions
        ekf.P = stretch.begin[0]["P"].copy()
        fade = np.exp(-self.dt / config["bias_tau"])
        ekf.F[3:6, 3:6] = np.diag(fade)
        ekf.F[[0, 1, 2], [3, 4, 5]] = -self.dt
        wander = (1.0 - fade**2) * config["bias_std"] ** 2
        ekf.Q = np.diag([*(config["gyro_noise"] ** 2 * self.dt), *wander, 0.0, config["stamp_walk"] ** 2 * self.dt])
        self.ekf = ekf
        self.row = np.zeros((1, STATES))
        self.row[0, 2] = 1.0
        floor = float(config["aiding_floor_var"])
        self.arguments = [
            (float(i["rate"][2]), float(i["turn_rate"]), float(i["yaw_var"]) + floor) for i in stretch.inputs
        ]
        self.residual = np.zeros((1, 1))

    def seconds(self) -> float:
        """Seconds of one step."""
        return call_time(self.step, self.arguments)

    def step(self, wz: float, rate: float, var: float) -> None:
        """Let the string turn at ``wz`` (rad/s) for one cycle and take one yaw."""
        angle = wz * self.dt
        c, s, F = math.cos(angle), math.sin(angle), self.ekf.F
        F[0, 0], F[0, 1], F[1, 0], F[1, 1], F[2, 6] = c, s, -s, c, -angle
        for _ in range(self.predictions):
            self.ekf.predict()
        self.row[0, 7] = rate
        self.ekf.update(self.residual, self.jacobian, self.measured, R=var)

    def jacobian(self, x: Any) -> Any:
        """Row of the measurement."""
        return self.row

    def measured(self, x: Any) -> Any:
        """What the state makes one expect."""
        return self.row @ x


class ImufusionCalls:
    """Samples through imufusion's AHRS: an attitude by a complementary filter, with no covariance and no aiding."""

    def __init__(self, stretch: Stretch, ahrs: Any) -> None:
        self.ahrs = ahrs
        ahrs.set_sample_period(PERIOD)
        gravity = float(stretch.config[0]["gravity"])
        self.arguments = [(i["rate"] / DEG, i["force"] / gravity) for i in stretch.inputs]

    def seconds(self) -> float:
        """Seconds of one sample."""
        return call_time(self.ahrs.update_no_magnetometer, self.arguments)


def phase_cycles(seed: int, kind: str, which: int) -> tuple[int, int]:
    """First and last cycle of one phase of the schedule."""
    world = World(load_scenario(ROOT / "scenarios" / "wellbore-1.toml"), seed)
    phase = [p for p in world.phases if p.kind == kind][which]
    first, last = (math.floor((t - world.begin) * CYCLE_RATE_HZ) for t in (phase.start, phase.end))
    return first, last


def run() -> dict[str, Any]:
    """All ratios: seconds a cycle of ours, of the peer, and how many times faster ours is."""
    import filterpy.kalman
    import imufusion

    inputs = record_inputs()
    whole = Stretch(inputs, 0, len(inputs))
    turning = Stretch(inputs, *phase_cycles(SEED, "drill", 4))
    resting = Stretch(inputs, *phase_cycles(SEED, "stop", 4))
    ratios: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, flags in (("C", ()), ("C without fused products", (UNFUSED,))):
            place = Path(folder, name)
            place.mkdir()
            run_c = build_c(place, *flags)
            for what, stretch in (("whole bore", whole), ("turning", turning), ("at rest", resting)):
                ratios[f"cycle, {what}, against {name}"] = alternating(
                    timed(stretch, run_compiled), timed(stretch, run_c), AT_MOST_C
                )
    run_fixed = fixed_runner()
    if run_fixed is not None:
        for what, stretch in (("whole bore", whole), ("turning", turning), ("at rest", resting)):
            ratios[f"cycle in fixed point, {what}, against float64"] = alternating(
                timed(FixedStretch(stretch), run_fixed), timed(stretch, run_compiled), AT_MOST_FIXED
            )
    one, three = (
        FilterpyCalls(turning, filterpy.kalman.ExtendedKalmanFilter(STATES, 1), predictions).seconds
        for predictions in (1, 3)
    )
    ours, steps, cycle = OurCalls(turning).seconds, timed(turning, run_steps), timed(turning, run_compiled)
    ahrs = ImufusionCalls(turning, imufusion.Ahrs()).seconds
    ratios["one prediction, one update, against filterpy"] = alternating(steps, one, AT_MOST_FILTERPY)
    ratios["cycle, turning, against filterpy's three predictions and one update"] = alternating(
        cycle, three, AT_MOST_FILTERPY
    )
    ratios["cycle called from Python, against filterpy's three and one"] = alternating(ours, three)
    ratios["cycle, turning, against imufusion's AHRS, which has no covariance"] = alternating(cycle, ahrs)
    ratios["cycle called from Python, against imufusion's AHRS"] = alternating(ours, ahrs)
    return {"bench": "node", "cycles": len(inputs), "compiler_flags": [*FLAGS], "ratios": ratios}
