"""The table of commands by hand: who obeys, what each asks for, in which range and unit, and what it is by default."""

from __future__ import annotations

import math
from typing import Any

from telemetry.application.commands import COMMANDS, CommandSpec, ObeyedBy

PI, TURN, FINEST, MOST = math.pi, math.tau, math.radians(1e-4), 2**53
NUMBER = ("integer", "1", 1, MOST, True, None)
RECORD = ("number", "s", 5.0, 3600.0, True, None)
SIGMA = ("number", "rad", FINEST, PI, True, None)
METRES = ("number", "m", 1e-4, 10.0, True, None)
ANGLE = ("number", "rad", -TURN, TURN, True, None)
HEIGHT = ("number", "m", -20.0, 20.0, True, None)
WORD = ("text", "", -math.inf, math.inf, True, None)
TUBE: dict[str, dict[str, Any]] = {
    "take_survey": {}, "parameters": {}, "alignment": {}, "timing": {}, "check_board": {},
    "static_record": {"seconds": RECORD}, "resend": {"first": NUMBER, "last": NUMBER},
    "align": {
        "method": ("text", "", -math.inf, math.inf, False, "circle"), "turns": ("number", "1", 1.0, 20.0, False, 2.0)
    },
}  # fmt: skip
GROUND: dict[tuple[str, str], dict[str, Any]] = {
    ("upload_parameters", ""): {
        "gyroscope": WORD, "accelerometer": WORD, "version": ("integer", "1", 1, 2**32 - 1, False, None)
    },
    ("accept_depth", "confirm"): {}, ("accept_joints", "confirm"): {},
    ("alarm", "acknowledge"): {"number": NUMBER}, ("alarm", "unshelve"): {"number": NUMBER},
    ("alarm", "shelve"): {"number": NUMBER, "minutes": ("number", "min", 1.0, 720.0, False, 30.0)},
    ("recalibrate", "begin"): {"tubes": ("list of integers", "", 1, 250, False, None)},
    ("recalibrate", "attitude"): {
        "pitch": ("number", "rad", -PI, PI, True, None), "roll": ("number", "rad", -PI, PI, True, None),
        "seconds": RECORD,
    },
    ("recalibrate", "solve"): {}, ("recalibrate", "surveys"): {}, ("recalibrate", "cancel"): {},
    ("recalibrate", "confirm"): {"proposal": WORD},
    ("north", "tell"): {"angle": ANGLE, "sigma": SIGMA}, ("north", "check"): {"angle": ANGLE, "sigma": SIGMA},
    ("collar", "tell"): {"inclination": ("number", "rad", 0.0, PI, True, None), "azimuth": ANGLE, "sigma": SIGMA},
    ("joint", ""): {
        "angle": ANGLE, "sigma": SIGMA, "used": ("number", "rad", -TURN, TURN, False, None),
        "upper": ("integer", "1", 0, 250, False, None),
    },
    ("length", ""): {"length": ("number", "m", 0.1, 20.0, True, None), "sigma": METRES},
    ("stick_up", "tell"): {"height": HEIGHT, "sigma": METRES},
    ("stick_up", "check"): {"height": HEIGHT, "sigma": METRES},
    ("same_number", ""): {"which": WORD}, ("setup", "undo"): {},
}  # fmt: skip
CHOICES = {"method": ("circle", "extremes", "none"), "which": ("upper", "lower")}


def asked(spec: CommandSpec) -> dict[str, Any]:
    found = {}
    for one in spec.arguments:
        q = one.quantity
        found[q.name] = (q.kind.value, q.unit, q.low, q.high, one.needed, one.default)
        assert q.choices == CHOICES.get(q.name, ())
    return found


def test_every_command_asks_for_what_it_says_in_its_range() -> None:
    tube = {spec.name: asked(spec) for spec in COMMANDS if spec.by is ObeyedBy.TUBE}
    ground = {(spec.name, spec.action): asked(spec) for spec in COMMANDS if spec.by is ObeyedBy.GROUND}
    assert tube == TUBE
    assert ground == GROUND
    assert {spec.name for spec in COMMANDS if spec.goes_on} == {"static_record"}
    assert len(COMMANDS) == len(TUBE) + len(GROUND)
