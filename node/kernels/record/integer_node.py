"""All memory of a node in integers: the record of the floats, field by field, with a Q format for every float.

Filter and configuration have records of their own (``integer_filter``). Of the others the words lie as those of the
floats do, so that showing and learning them is one loop over words with a table of scales; the quantities and their
ranges are those of ``node.kernels.arithmetic.operations``. A word that holds a whole number is copied.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import (
    ANGLE_Q,
    FORCE_PART,
    FORCE_Q,
    MEAN_Q,
    PRODUCT_Q,
    RATE_PART,
    RATE_Q,
    SQUARE_Q,
    STIFFNESS_Q,
    TIME_Q,
    TORQUE_Q,
    TURNS_Q,
    VAR_Q,
    VECTOR_Q,
    WEIGHT_Q,
    Array,
)
from node.kernels.arithmetic.quantity import RATE_VAR_Q, WARMTH_Q
from node.kernels.record.events import TOLD_Q
from node.kernels.record.filter_record import CONFIG, STATE
from node.kernels.record.integer_filter import FIXED_CONFIG, FIXED_STATE
from node.kernels.record.node_record import AIDING, BEHIND, MOMENT, NODE, READING, SETTINGS
from node.kernels.record.sensor_record import MAX_IMUS, PARAMETERS

G: Final = 1000  # of a format: a power of gravity, since forces are counted in g
FORCE: Final = FORCE_Q + G
TERM: Final = np.array([0, 7, 14, 21])  # of polynomials in the temperature, which is counted in 128 C
SIX: Final = np.array([RATE_Q] * 3 + [FORCE] * 3)
MEANS: Final = np.array([MEAN_Q] * 3 + [MEAN_Q + G] * 3)
PARTS: Final = np.array([RATE_PART] * 3 + [FORCE_PART + G] * 3)
OWN_FORMATS: Final[dict[str, Any]] = {
    "mount.axis": VECTOR_Q,
    "mount.std": ANGLE_Q,
    "mount.rate_offset": RATE_Q,
    "rates.last": RATE_Q,
    "forces.last": FORCE,
    "aidings.left": ANGLE_Q,
    "aidings.at": TIME_Q,
    "mismatch": RATE_Q,
    "spin": RATE_Q,
    "rate": RATE_Q,
    "rate_at": TIME_Q,
    "aiding_var": VAR_Q,
    "agreed_rate": RATE_Q,
    "sane_rate": RATE_Q,
    "before_steps": RATE_Q,
    "unproven": RATE_Q,
    "disputed": ANGLE_Q,
    "first_step": RATE_Q,
    "misfit": VECTOR_Q,
    "excess": VAR_Q,
    "before": ANGLE_Q,
    "likeness": VECTOR_Q,
    "shared": VAR_Q,
    "ramp.largest": VAR_Q,
    "doubt": VAR_Q,
    "ramp.scale": RATE_Q,
    "scale_std": RATE_Q,
    "back": ANGLE_Q,
    "mirror.down": VECTOR_Q,
    "creep.bias": RATE_Q,
    "creep.bias_var": RATE_VAR_Q,
    "constant_var": RATE_VAR_Q,
    "wander": RATE_Q,
    "decay": VECTOR_Q,
    "decays": VECTOR_Q,
    "first": ANGLE_Q,
    "standing": VAR_Q,
    "ratio.usual": VECTOR_Q,
    "rubbing.var": VAR_Q,
    "felt": VECTOR_Q,
    "turned": VECTOR_Q,
    "jump": ANGLE_Q,
    "last_jump": ANGLE_Q,
    "twist.std": ANGLE_Q,
    "torque": TORQUE_Q,
    "heard_at": TIME_Q,
    "marks": ANGLE_Q,
    "joints.offset": ANGLE_Q,
    "joints.var": VAR_Q,
    "said_var": VAR_Q,
    "revision.systematic": VAR_Q,
    "temperature": WARMTH_Q,
    "raw_rate": RATE_Q,
    "raw_force": FORCE,
    "force": FORCE,
    "unaligned": FORCE,
    "down_offset": ANGLE_Q,
    "down_systematic": VAR_Q,
    "down_torsion": VAR_Q,
    "numbers": TOLD_Q,
    "late": TIME_Q,
    "delayed.std": TIME_Q,
    "delayed.lasting": TIME_Q,
    "change": RATE_Q,
    "missing": ANGLE_Q,
    "behind": RATE_Q,
    "ahead": RATE_Q,
    "shown": ANGLE_Q,
    "expected": RATE_Q,
    "ring_force": FORCE,
    "parts": RATE_Q,
    "cluster.rates": RATE_Q,
    "cluster.readings": SIX,
    "weights": WEIGHT_Q,
    "survey_force": FORCE,
    "survey_force_cov": 2 * FORCE,
    "ordered": RATE_Q,
    "expects": SIX,
    "middle": SIX,
    "limits": SIX,
    "fused": SIX,
    "drive_angle": ANGLE_Q,
    "drive_var": VAR_Q,
    "lower_angle": ANGLE_Q,
    "lower_var": VAR_Q,
    "unseen_var": VAR_Q,
    "stiffness": STIFFNESS_Q,
    "aiding_old_after": TIME_Q,
    "stamp_walk": RATE_Q,
    "rate_range": RATE_Q,
    "force_range": FORCE,
    "place": VECTOR_Q + G,  # s^2/rad^2: of a square of a rate it makes a force
    "noise": WEIGHT_Q,
    "weight": WEIGHT_Q,
    "plain_gyro_noise": RATE_Q,
    "plain_bias_std": RATE_Q,
    "plain_force_std": RATE_Q + G,
    "tilt_noise": ANGLE_Q,
    "matrix": (VECTOR_Q + TERM)[:, None, None],
    "gyroscope.bias": (RATE_Q + TERM)[:, None],
    "accelerometer.bias": (FORCE + TERM)[:, None],
    "reference": WARMTH_Q,
    "m": VECTOR_Q,
    "seconds": TIME_Q,
    "begun": TIME_Q,
    "sums.mean": MEANS,
    "sums.last": MEANS,
    "sums.delta": MEANS,
    "sums.scatter": PARTS[:, None] + PARTS,
    "sums.steps": 2 * PARTS,
    "wanted": TURNS_Q,
    "angle": ANGLE_Q,
    "yaw": ANGLE_Q,
    "sense": 0,
    "ordered_at": TIME_Q,
    "last_end": TIME_Q,
    "sum": VECTOR_Q,
    "sum_products": PRODUCT_Q,
    "sum_angle": ANGLE_Q,
    "sum_angle_squares": SQUARE_Q,
    "sum_spin": VECTOR_Q,
    "sum_angle_spin": ANGLE_Q,
    "sum_back": PRODUCT_Q,
    "sum_angle_back": ANGLE_Q,
    "least": VECTOR_Q,
    "largest": VECTOR_Q,
    "u": VECTOR_Q,
    "across": VECTOR_Q,
    "offsets.axis": VECTOR_Q,
    "pitch": ANGLE_Q,
    "roll": ANGLE_Q,
    "pitch_std": ANGLE_Q,
    "roll_std": ANGLE_Q,
    "lean": ANGLE_Q,
    "lean_std": ANGLE_Q,
    "offsets.noise": ANGLE_Q,
    "aligner.sums": VECTOR_Q,
    "rotations": VECTOR_Q,
    "turn": VECTOR_Q,
}
READING_FORMATS: Final = np.array(
    [RATE_Q] * 3 + [FORCE] * 3 + [WARMTH_Q, 0, TIME_Q, TIME_Q, 0] + [RATE_Q] * (READING - BEHIND)
)
MOMENT_FORMATS: Final = np.array([TIME_Q, TIME_Q, 0, 0, VAR_Q, 0, TIME_Q, RATE_Q])
AIDING_FORMATS: Final = np.array(
    [ANGLE_Q, VAR_Q, VAR_Q, ANGLE_Q, RATE_Q, TIME_Q, 0, 0, TORQUE_Q, VAR_Q, 0, VAR_Q],
)
COPIED: Final = -1  # format of a word that is a whole number


def in_integers(kind: np.dtype[Any]) -> np.dtype[Any]:
    """The dtype with a 64-bit integer for every float."""
    if kind.subdtype is not None:
        return np.dtype((in_integers(kind.subdtype[0]), kind.subdtype[1]))
    if kind.fields is not None:
        return np.dtype([(name, in_integers(kind.fields[name][0])) for name in kind.names or ()], align=True)
    return np.dtype("i8") if kind.kind == "f" else kind


def formats_of(kind: np.dtype[Any], path: str = "") -> Array:
    """Format of every word of a dtype, (n,): its Q and ``G`` for every power of gravity, or ``COPIED``."""
    if kind.fields is not None:
        parts = [formats_of(kind.fields[name][0], f"{path}.{name}") for name in kind.names or ()]
        return np.concatenate(parts)
    base, shape = kind.subdtype or (kind, ())
    if base.fields is not None:
        return np.tile(formats_of(base, path), int(np.prod(shape)))
    if base.kind != "f":
        return np.full(kind.itemsize // 8, COPIED)
    *_, group, name = ("", *path.split("."))
    found = OWN_FORMATS.get(f"{group}.{name}", OWN_FORMATS.get(name))
    if found is None:
        raise KeyError(path)
    return np.broadcast_to(found, shape).ravel()


def scales_of(formats: Array) -> tuple[Array, Array]:
    """Integer of 1 and power of gravity in it, for each of ``formats`` (n,); a scale of 0 is that of a copied word."""
    powers = np.where(formats == COPIED, 0, formats // G)
    return np.where(formats == COPIED, 0.0, np.exp2(formats - powers * G)), powers.astype(np.int64)


AROUND: Final = [name for name in NODE.names or () if name not in ("filter", "config")]
FIXED_NODE: Final = np.dtype(
    [
        ("filter", FIXED_STATE),
        ("config", FIXED_CONFIG),
        *((name, in_integers(NODE.fields[name][0])) for name in AROUND if NODE.fields),
    ],
    align=True,
)
FIXED_SETTINGS: Final = in_integers(SETTINGS)
FIXED_PARAMETERS: Final = in_integers(PARAMETERS)


def word_offset(kind: np.dtype[Any], name: str) -> int:
    """Where a field lies, in words of 64 bits."""
    assert kind.fields is not None
    return kind.fields[name][1] // 8


FILTER_AT, CONFIG_AT = word_offset(NODE, "filter"), word_offset(NODE, "config")
AROUND_AT, RING_AT, CLUSTER_AT = (
    word_offset(NODE, "mount"),
    word_offset(NODE, "events") + 2,
    word_offset(NODE, "cluster"),
)
ALIGNER_AT, RECORDING_AT, END_AT = (
    word_offset(NODE, "aligner"),
    word_offset(NODE, "recording"),
    word_offset(NODE, "config"),
)
STATE_WORDS, CONFIG_WORDS = STATE.itemsize // 8, CONFIG.itemsize // 8
SETTINGS_WORDS, PARAMETER_WORDS = SETTINGS.itemsize // 8, PARAMETERS.itemsize // 8
AROUND_SCALES, AROUND_POWERS = scales_of(
    np.concatenate([formats_of(NODE.fields[name][0], f".{name}") for name in AROUND if NODE.fields])
)
AROUND_COUNTS = np.where(AROUND_SCALES == 0.0, 0.0, 1.0 / np.maximum(AROUND_SCALES, 1e-300))
SETTINGS_SCALES, SETTINGS_POWERS = scales_of(formats_of(SETTINGS))
PARAMETER_SCALES, PARAMETER_POWERS = scales_of(np.tile(formats_of(PARAMETERS), 1 + MAX_IMUS))
READING_SCALES, READING_POWERS = scales_of(READING_FORMATS)
MOMENT_SCALES, MOMENT_POWERS = scales_of(MOMENT_FORMATS)
AIDING_SCALES, AIDING_POWERS = scales_of(AIDING_FORMATS)

INTEGERS: Final = np.dtype(
    [
        ("node", FIXED_NODE),
        ("settings", FIXED_SETTINGS),
        ("parameters", FIXED_PARAMETERS, (1 + MAX_IMUS,)),
        ("readings", "i8", (MAX_IMUS, READING)),
        ("moment", "i8", (MOMENT,)),
        ("aiding", "i8", (AIDING,)),
        ("gravity", "f8"),  # m/s^2, of the configuration read last
        ("met", "i8"),  # 1: a record has been read
        ("shown_changes", "i8"),  # changes of the configuration that were shown
        ("shown", "i8", (STATE_WORDS,)),  # bytes of the filter's float64 record as it was left
        ("shown_around", "i8", (END_AT - AROUND_AT,)),  # likewise of what stands around it
        ("last", "i8", (END_AT - AROUND_AT,)),  # integers of it, as they were shown
        ("read", "i8", (CONFIG_WORDS,)),  # bytes of the configuration as it was read
        ("read_settings", "i8", (SETTINGS_WORDS,)),
        ("read_parameters", "i8", ((1 + MAX_IMUS) * PARAMETER_WORDS,)),
        ("rate", "i8", (3,)),  # rad/s, Q46, work space
        ("force", "i8", (3,)),  # g, Q26, work space
    ],
    align=True,
)
INSIDE: Final = word_offset(INTEGERS, "node") + word_offset(
    FIXED_NODE, "mount"
)  # where the words around the filter lie
SETTINGS_INSIDE, PARAMETERS_INSIDE = word_offset(INTEGERS, "settings"), word_offset(INTEGERS, "parameters")


def new_integers() -> Array:
    """Integers of a node whose record was not read yet, one record of dtype ``INTEGERS``."""
    return np.zeros(1, INTEGERS)
