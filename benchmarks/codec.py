"""The codec, and code that writes code: each beside the plain way in one run, and to be twice as fast at least.

Run it as ``borechain bench codec``; ``python -P benchmarks/codec.py`` ends with 1 and names what is not worth its code.
"""

from __future__ import annotations

import ast
import json
import math
import operator
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import make_dataclass
from typing import Any

import msgpack
import numpy as np

from borechain.load.rounds import compare_rounds
from groundstation.survey.tools.formulas import (
    ARRAY,
    CONSTANTS,
    VARIABLES,
    compile_formulas,
    normalise_name,
    parse_formula,
)
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.well.compiled_model import locate_stations, preload_models
from groundstation.survey.well.error_propagation import propagate_errors
from groundstation.survey.well.error_sources import Leg, Site, WellSurvey
from groundstation.survey.well.methods import Method, station_positions
from telemetry.messages import Aiding, Message, NodeFlag, NodeMode, NodeState
from telemetry.presentation.can_checks import CHECKS
from telemetry.presentation.can_messages import NATIVE
from telemetry.presentation.message_codec import CODECS
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.schema import SPEC_OF, MessageKind

LEAST = 2.0  # times as fast
ROUNDS, SPELL = 15, 0.01  # s of one round
STATE = NodeState(
    7, 123.456, 3, NodeMode.TRACKING, 1.5, 1e-6, 2e-6, (1e-4, 2e-4, 3e-4), 1e-4, 0.01, 1e-7, 0.5, 1e-9,
    NodeFlag.RESTORED,
    12345, 2, 1, b"12345678", (0.01, 0.02, 0.003), 3, 55,
)  # fmt: skip
AIDING = Aiding(1.0, 1e-8, 0.0, 0.0, 0.1, 100.0, 7, 0, epoch=1)
STATIONS, OF_A_FORMULA = 1000, 10
OPERATORS = {ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
             ast.Pow: operator.pow}  # fmt: skip
Pair = tuple[Callable[[], object], Callable[[], object]]  # ours and the plain way


def run() -> dict[str, Any]:
    """Every pair in rounds by turns.

    Returns
    -------
    dict
        ``ratios``: seconds of ours and of the plain way (peer), and how many times as fast ours is.
    """
    pairs = msgpack_pairs() | can_pairs() | {"frozen message made": frozen_pair()} | survey_pairs()
    return {"bench": "codec", "ratios": {name: timed(*pair) for name, pair in pairs.items()}}


def msgpack_pairs() -> dict[str, Pair]:
    """A node's state by msgspec, and by msgpack with the check of each field by hand."""
    payload = encode_message(STATE)
    if decode_by_hand(payload) != STATE or encode_by_hand(STATE) != payload:
        raise RuntimeError("expected both ways to say the same")
    return {
        "msgpack decode": (lambda: decode_message(payload), lambda: decode_by_hand(payload)),
        "msgpack encode": (lambda: encode_message(STATE), lambda: encode_by_hand(STATE)),
    }


def decode_by_hand(payload: bytes) -> Message:
    """Message of a payload, each field checked by its function."""
    rows = msgpack.unpackb(payload)
    spec = SPEC_OF[NodeState]
    if rows["k"] != spec.kind or not all(type(rows[key]) is int for key in "vots"):
        raise ValueError("expected a node state")
    body = rows["b"]
    values = [checked(f, body[f.key]) if f.since <= rows["v"] else f.before for f in spec.fields]
    state: Message = spec.message(*values)
    return state


def encode_by_hand(message: NodeState) -> bytes:
    """Payload of a message, each field checked by its function."""
    spec = SPEC_OF[NodeState]
    values = {f: checked(f, getattr(message, f.name)) for f in spec.fields}
    version = max(f.since for f, value in values.items() if f.since == 1 or value != f.before)
    body = {f.key: value for f, value in values.items() if f.since <= version}
    rows = {"v": version, "k": int(spec.kind), "o": message.tube, "t": 251, "s": 0, "b": body}
    payload: bytes = msgpack.packb(rows)
    return payload


def checked(field: Any, value: Any) -> Any:
    """Value of a field, checked by the function of its kind."""
    value = CHECKS[field.kind](field, value)
    return value if field.enumeration is None else field.enumeration(value)


def can_pairs() -> dict[str, Pair]:
    """An aiding and a node's state, each on classic CAN and on CAN FD, compiled and signal by signal."""
    cases = [
        (NATIVE[kind], CODECS[type(message)].values_of(message), fd)
        for kind, message in ((MessageKind.AIDING, AIDING), (MessageKind.NODE_STATE, STATE))
        for fd in (False, True)
    ]
    frames = [native.pack(values, 5, fd=fd) for native, values, fd in cases]

    def pack() -> list[Any]:
        return [native.pack(values, 5, fd=fd) for native, values, fd in cases]

    def pack_by_signal() -> list[Any]:
        return [native.form(fd=fd).pack(native.raws_of_values(values), 5) for native, values, fd in cases]

    def unpack() -> list[Any]:
        return [native.unpack(data, fd=fd) for (native, _, fd), data in zip(cases, frames, strict=True)]

    def unpack_by_signal() -> list[Any]:
        return [
            native.values_of(native.form(fd=fd).unpack(data))
            for (native, _, fd), data in zip(cases, frames, strict=True)
        ]

    if pack() != pack_by_signal() or unpack() != unpack_by_signal():
        raise RuntimeError("expected both ways to say the same")
    return {"CAN signals packed": (pack, pack_by_signal), "CAN signals unpacked": (unpack, unpack_by_signal)}


def frozen_pair() -> Pair:
    """A node's state made, and a frozen dataclass of the same fields."""
    names = NodeState.__struct_fields__
    values = [getattr(STATE, name) for name in names]
    usual = make_dataclass("Usual", names, frozen=True, slots=True)
    return lambda: NodeState(*values), lambda: usual(*values)


def survey_pairs() -> dict[str, Pair]:
    """The error model of a long survey, compiled and by arrays; a tool's formulas as a function, and walked."""
    tool, site, method = load_tool("mwd-rev5.1"), Site(9.80665, 50_000.0, np.radians(72.0)), Method.MINIMUM_CURVATURE
    preload_models(["mwd-rev5.1"])
    md, inclination, azimuth = (np.linspace(*ends, STATIONS) for ends in ((0.0, 5000.0), (0.01, 1.5), (0.2, 2.0)))
    survey, legs, start = WellSurvey(md, inclination, azimuth, md), [Leg(tool)], np.zeros(3)

    def located() -> Any:
        return locate_stations(method, survey, legs, site, start, slot_allowance=True)[1].cov

    def by_arrays() -> Any:
        tvd = station_positions(method, md, inclination, azimuth)[:, 2]
        return propagate_errors(WellSurvey(md, inclination, azimuth, tvd), legs, site, slot_allowance=True).cov

    np.testing.assert_allclose(located(), by_arrays(), rtol=1e-6, atol=1e-9)
    formulas = [text for term in tool.terms for text in term.formulas]
    values = [np.linspace(0.1, 1.0, OF_A_FORMULA) + k for k in range(len(VARIABLES))]
    inputs = [*values, *tool.parameters.values()]
    np.seterr(invalid="ignore")  # a root of less than nothing costs both the same
    function = compile_formulas(formulas, tuple(tool.parameters))
    known = {normalise_name(name): value for name, value in zip([*VARIABLES, *tool.parameters], inputs, strict=True)}
    trees = [parse_formula(text) for text in formulas]

    def walked_all() -> list[Any]:
        return [walked(tree, known) for tree in trees]

    for one, other in zip(function(ARRAY, inputs), walked_all(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)
    return {
        "error model of a survey": (located, by_arrays),
        "formulas of a tool": (lambda: function(ARRAY, inputs), walked_all),
    }


def walked(node: ast.expr, known: dict[str, Any]) -> Any:
    """Value of a formula, its tree walked."""
    match node:
        case ast.Constant():
            return node.value
        case ast.Name():
            name = normalise_name(node.id)
            return known[name] if name in known else CONSTANTS[name]
        case ast.UnaryOp():
            return -walked(node.operand, known)
        case ast.BinOp():
            return OPERATORS[type(node.op)](walked(node.left, known), walked(node.right, known))
        case ast.Call(func=ast.Name() as func):
            given = [walked(one, known) for one in node.args]
            return (
                given[0] * given[0]
                if normalise_name(func.id) == "sqr"
                else getattr(ARRAY, normalise_name(func.id))(*given)
            )
    raise RuntimeError(f"expected a formula, got {ast.dump(node)}")


def timed(ours: Callable[[], object], theirs: Callable[[], object]) -> dict[str, Any]:
    """Row of one pair."""
    times: list[Sequence[float]] = []
    counts = [max(1, math.ceil(SPELL / seconds(act, 1))) for act in (ours, theirs)]
    for _ in range(ROUNDS):
        times.append([seconds(act, count) for act, count in zip((ours, theirs), counts, strict=True)])
    return compare_rounds([one for one, _ in times], [other for _, other in times])


def seconds(act: Callable[[], object], count: int) -> float:
    """Time of a call in a round of so many, of this thread alone: what others do on the machine is not its own."""
    begun = time.thread_time()
    for _ in range(count):
        act()
    return (time.thread_time() - begun) / count


def main() -> int:
    """Print the rows; 1 where one is below ``LEAST``."""
    result = run()
    print(json.dumps(result, indent=1))
    below = [name for name, row in result["ratios"].items() if row["ratio"] < LEAST]
    for name in below:
        print(f"{name}: expected to be {LEAST:g} times as fast as the plain way", file=sys.stderr)
    return 1 if below else 0


if __name__ == "__main__":
    sys.exit(main())
