"""A synthetic MWD tool in a jig and an oven: what a calibration laboratory would have recorded, with the truth known.

Figures of the tool: JA-5M36 servo accelerometers; the magnetometers get the same relative ones.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from groundstation.calibration.mwd_files import FULL_HEADER
from groundstation.calibration.mwd_model import (
    ACCELEROMETER_AXES,
    MAGNETOMETER_AXES,
    REFERENCE_TEMPERATURE,
    Triad,
    volts_of,
)
from groundstation.calibration.quality import TOOL_FACES
from sim.instruments.instrument import Records
from sim.world.random_streams import JigStream, random_stream

Array = npt.NDArray[np.float64]
VOLTS_PER_G, VOLTS_PER_MICROTESLA = 3.0, 0.06
SCALE_BOUND = 0.05  # at 25 C
BIAS_BOUND = 0.010  # of g or of the field, at 25 C
ALIGNMENT_BOUND = 2e-3  # rad
SCALE_TEMPCO, BIAS_TEMPCO = 180e-6, 100e-6  # 1/C; g/C or field/C
CURVED = 0.1  # second and third power of temperature, at the end of the range, as a part of the linear change
DRAWN_AT = 25.0  # C
COLDEST, HOTTEST = 25.0, 80.0  # C
NOISE = 1e-4  # of g or of the field, a reading
JIG_STD = math.radians(0.01)  # each axis
FIELD, DIP = 50.0, math.radians(65.0)  # microtesla, of the site
CONTROL = 2 * 10**6  # added to a tool's seed for its quality control
CONTROL_INCLINATION, CONTROL_TEMPERATURE = math.radians(45.0), 25.0
UNITS = "Tilt and tool face in deg, temperature in C, accelerometers A B C and magnetometers X Y Z in volts"


class Heating(Enum):
    """Course of the temperature while the jig goes through tilts (outer) and tool faces (inner)."""

    ROOM = "room"  # one temperature
    SOAK = "soak"  # every attitude at each of five temperatures
    SINGLE_RAMP = "single ramp"  # heated once through the whole sequence
    SAME_RAMPS = "same ramps"  # heated anew at each tilt, the tool faces in the same order
    ALTERNATING = "alternating"  # heated at one tilt, cooled at the next
    SHUFFLED = "shuffled"  # heated anew at each tilt, the tool faces in another order


@dataclass(frozen=True, slots=True)
class JigDesign:
    """Nominal attitudes (rad) and temperatures (C) in the order of the readings, (n,) each."""

    tilt: Array
    tool_face: Array
    azimuth: Array
    temperature: Array


@dataclass(frozen=True, slots=True)
class JigRecord:
    """Voltages (n, 3) and temperatures (n,) of a design; the attitudes of the design are the references."""

    gravity_volts: Array
    field_volts: Array
    temperature: Array
    design: JigDesign


@dataclass(frozen=True, slots=True)
class MwdTool:
    """True coefficients."""

    accelerometers: Triad
    magnetometers: Triad


def draw_tool(seed: int) -> MwdTool:
    """A tool within the figures of its sensors."""
    random = random_stream(seed, JigStream.TOOL)
    return MwdTool(
        _draw_triad(random, ACCELEROMETER_AXES, VOLTS_PER_G, 1.0),
        _draw_triad(random, MAGNETOMETER_AXES, VOLTS_PER_MICROTESLA, FIELD),
    )


def _draw_triad(random: np.random.Generator, axes: str, volts_per_unit: float, unit: float) -> Triad:
    scale = volts_per_unit * (_polynomials(random, SCALE_BOUND, SCALE_TEMPCO) + np.array([1.0, 0.0, 0.0, 0.0]))
    bias = unit * _polynomials(random, BIAS_BOUND, BIAS_TEMPCO)
    return Triad(axes, scale, bias, random.uniform(-ALIGNMENT_BOUND, ALIGNMENT_BOUND, 6))


def _polynomials(random: np.random.Generator, bound: float, tempco: float) -> Array:
    """(3, 4) coefficients in (T - 30 C)^p of three sensors, their value at 25 C within the bound."""
    span = HOTTEST - REFERENCE_TEMPERATURE
    linear = random.uniform(-tempco, tempco, 3)
    curved = CURVED * tempco * random.uniform(-1.0, 1.0, (2, 3)) / span ** np.array([[1.0], [2.0]])
    polynomials = np.column_stack([np.zeros(3), linear, *curved])
    drawn = (DRAWN_AT - REFERENCE_TEMPERATURE) ** np.arange(4.0)
    polynomials[:, 0] = random.uniform(-bound, bound, 3) - polynomials @ drawn
    return polynomials


def make_design(heating: Heating, seed: int = 0, tilts: int = 7) -> JigDesign:
    """Tilts 0..180 deg times tool faces, 12, or 24 while it heats; the jig's azimuth turns from tilt to tilt."""
    random = random_stream(seed, JigStream.DESIGN)
    rounds = 5 if heating is Heating.SOAK else 1
    faces = 12 if heating in (Heating.ROOM, Heating.SOAK) else 24
    n = tilts * faces
    k, j = np.divmod(np.arange(n), faces)
    order = [random.permutation(faces) if heating is Heating.SHUFFLED else np.arange(faces) for _ in range(tilts)]
    rise = j / (faces - 1.0)
    part = {
        Heating.SINGLE_RAMP: np.arange(n) / (n - 1.0),
        Heating.ALTERNATING: np.where(k % 2 == 0, rise, 1.0 - rise),
        Heating.ROOM: np.zeros(n),
    }.get(heating, rise)
    temperature = COLDEST + (HOTTEST - COLDEST) * part
    if heating is Heating.SOAK:
        temperature = np.repeat(np.linspace(COLDEST, HOTTEST, rounds), n)
    face = 2.0 * np.pi * np.concatenate(order) / faces
    columns = np.pi * k / (tilts - 1.0), face, 2.0 * np.pi * k / tilts
    tilt, tool_face, azimuth = (np.tile(c, rounds) for c in columns)
    return JigDesign(tilt, tool_face, azimuth, temperature)


def fresh_design(seed: int, hot: bool, count: int = 400) -> JigDesign:
    """Attitudes uniform over the sphere, for a check of a calibration that has not seen them."""
    random = random_stream(seed, JigStream.FRESH)
    tilt = np.arccos(random.uniform(-1.0, 1.0, count))
    face, azimuth = random.uniform(0.0, 2.0 * np.pi, (2, count))
    temperature = random.uniform(COLDEST, HOTTEST, count) if hot else np.full(count, COLDEST)
    return JigDesign(tilt, face, azimuth, temperature)


def control_design() -> JigDesign:
    """Twelve tool faces at the attitude of the quality control."""
    face = 2.0 * np.pi * np.arange(TOOL_FACES) / TOOL_FACES
    same = np.ones(TOOL_FACES)
    return JigDesign(CONTROL_INCLINATION * same, face, 0.5 * same, CONTROL_TEMPERATURE * same)


def true_vectors(tilt: Array, tool_face: Array, azimuth: Array) -> tuple[Array, Array]:
    """Gravity (n, 3) g with C flipped and field (n, 3) microtesla that an ideal tool shows at the attitudes."""
    ned_from_body = attitude_matrices(tilt, tool_face, azimuth)
    return _seen(ned_from_body)


def attitude_matrices(tilt: Array, tool_face: Array, azimuth: Array) -> Array:
    """(n, 3, 3) ned_from_body = Rz(azimuth) Ry(tilt) Rz(tool face)."""
    return np.asarray(_rotation(2, azimuth) @ _rotation(1, tilt) @ _rotation(2, tool_face))


def measure_tool(
    tool: MwdTool, design: JigDesign, seed: int, *, noise: float = NOISE, jig_std: float = JIG_STD
) -> JigRecord:
    """Readings of a tool; the jig stands a little beside its nominal attitudes."""
    random = random_stream(seed, JigStream.READINGS)
    n = len(design.tilt)
    wobble = jig_std * random.standard_normal((n, 3))
    turn = _rotation(0, wobble[:, 0]) @ _rotation(1, wobble[:, 1]) @ _rotation(2, wobble[:, 2])
    gravity, field = _seen(turn @ attitude_matrices(design.tilt, design.tool_face, design.azimuth))
    gravity = gravity + noise * random.standard_normal((n, 3))
    field = field + noise * FIELD * random.standard_normal((n, 3))
    return JigRecord(
        volts_of(tool.accelerometers, gravity, design.temperature),
        volts_of(tool.magnetometers, field, design.temperature),
        design.temperature,
        design,
    )


def _seen(ned_from_body: Array) -> tuple[Array, Array]:
    """Both vectors in the body: the specific force is up, so A and B take -down and the flipped C takes +down."""
    vertical = ned_from_body[:, 2, :]
    north = np.array([math.cos(DIP), 0.0, math.sin(DIP)]) * FIELD
    return vertical * np.array([-1.0, -1.0, 1.0]), np.einsum("k,nkb->nb", north, ned_from_body)


def _rotation(axis: int, angle: Array) -> Array:
    """(n, 3, 3) right-handed rotations about one axis."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.tile(np.eye(3), (len(angle), 1, 1))
    rotation[:, i, i] = rotation[:, j, j] = np.cos(angle)
    rotation[:, i, j], rotation[:, j, i] = -np.sin(angle), np.sin(angle)
    return rotation


def simulate_records(seed: int) -> Records:
    """A tool in its jig, in the oven and at its quality control."""
    tool = draw_tool(seed)
    designs = {
        "mwd-room": (
            make_design(Heating.ROOM, seed),
            seed,
            "one temperature, 7 tilts, 12 tool faces each: 12 parameters",
        ),
        "mwd-oven": (make_design(Heating.SHUFFLED, seed), seed, "heated anew at each of 7 tilts, 24 tool faces each"),
        "mwd-control": (control_design(), seed + CONTROL, "12 tool faces at one attitude: quality control"),
    }
    files = {}
    for name, (design, draw, words) in designs.items():
        lines = [f"# Synthetic MWD tool {seed}, {words}. {UNITS}.", *record_lines(measure_tool(tool, design, draw))]
        files[f"{name}.csv"] = ("\n".join(lines) + "\n").encode()
    truth = {
        "accelerometers": tool.accelerometers.coefficients(),
        "magnetometers": tool.magnetometers.coefficients(),
        "field_ut": FIELD,
        "dip_deg": float(np.degrees(DIP)),
    }
    return Records(files, truth)


def record_lines(record: JigRecord) -> list[str]:
    """Header and rows of a record, volts to the microvolt."""
    angles = np.degrees(record.design.tilt), np.degrees(record.design.tool_face) % 360.0
    columns = np.column_stack([*angles, record.temperature, record.gravity_volts, record.field_volts])
    return [FULL_HEADER, *(",".join([*_cells(row[:3], 3), *_cells(row[3:], 6)]) for row in columns)]


def _cells(values: Array, digits: int) -> list[str]:
    return [f"{value:.{digits}f}" for value in values]
