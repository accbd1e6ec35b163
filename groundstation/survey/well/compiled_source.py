"""The compiled loop of an instrument, as text: a function that walks down a well once, and one that does so for many.

Position, weights of all sources, their running sums and the covariance are locals each; the equations are those of
``error_model``. ``compiled_model`` says what the function takes and gives.
"""

from __future__ import annotations

import re

from groundstation.survey.tools.formulas import VARIABLES, is_zero, translate_formulas
from groundstation.survey.tools.instruments import SurveyTool
from groundstation.survey.well.error_sources import (
    EARTH_RATE,
    NO_WEIGHT,
    RECORD,
    TINY,
    VERTICAL,
    ErrorSource,
    Leg,
    merged_sources,
    sources_of,
)
from groundstation.survey.well.gyro_modes import TURNS

STATION = {
    "MD": "md1", "MDPrev": "md0", "TVD": "down", "Inc": "inc1", "IncPrev": "inc0", "Az": "azi1", "AzPrev": "azi0",
    "AzT": "azi1", "AzTPrev": "azi0", "AzM": "(azi1 - declination)", "AzMPrev": "(azi0 - declination)",
    "GField": "gravity", "BField": "b_field", "Dip": "dip", "Latitude": "latitude", "EarthRate": repr(EARTH_RATE),
    "Time": "record[0, k]", "TimePrev": "record[0, k - 1]", "Previous": "0.0",
    **{name: f"record[{row}, k]" for row, name in enumerate(RECORD, 1)},
}  # fmt: skip
PLACE = ("GField", "BField", "Dip", "Latitude", "EarthRate")  # the same at every station
LOCAL = re.compile(r"\b[vt]\d+\b")
HEAD = """
import math

from node.kernels.arithmetic.jit import kernel

_sin, _cos, _tan, _sqrt, _abs, _max, _min = math.sin, math.cos, math.tan, math.sqrt, abs, max, min


@kernel
def _step(x):
    return 1.0 if x > 0.0 else 0.0


@kernel
def well(
    md, inc, azi, path, slot, gravity, b_field, dip, declination, latitude, parameters, record, modes, positions, cov,
    parts,
):
    north = east = down = 0.0
    md1, inc1, bearing1 = md[0], max(inc[0], TINY), azi[0]
    si1, ci1, ca1, sa1 = math.sin(inc1), math.cos(inc1), math.cos(bearing1), math.sin(bearing1)
    azi1 = 0.0 if inc1 < VERTICAL or inc1 > math.pi - VERTICAL else bearing1
    tx1, ty1, tz1 = si1 * ca1, si1 * sa1, ci1
    mx = my = mz = 0.0
    r0 = r1 = r2 = r3 = r4 = r5 = 0.0
""".replace("TINY", repr(TINY)).replace("VERTICAL", repr(VERTICAL))
STRAIGHT, CURVED, GIVEN = 0, 1, 2  # balanced tangential, minimum curvature, positions that were found before
STEP = (
    """
    for k in range(1, len(md)):
        md0, inc0, azi0, bearing0 = md1, inc1, azi1, bearing1
        md1, inc1, bearing1 = md[k], max(inc[k], TINY), azi[k]
        half = 0.5 * (md1 - md0)
        tx0, ty0, tz0 = tx1, ty1, tz1
        si1, ci1, ca1, sa1 = math.sin(inc1), math.cos(inc1), math.cos(bearing1), math.sin(bearing1)
        tx1, ty1, tz1 = si1 * ca1, si1 * sa1, ci1
        factor = half
        if path == CURVED:
            sin_i, sin_a = math.sin(0.5 * (inc1 - inc0)), math.sin(0.5 * (bearing1 - bearing0))
            square = sin_i * sin_i + math.sqrt(tx0 * tx0 + ty0 * ty0) * si1 * sin_a * sin_a
            if square > OPPOSITE:
                return k
            # (2/b) tan(b/2) with sin(b/2) the root of square
            if square > 1e-8:
                root = math.sqrt(square)
                factor = half * root / (math.sqrt(1.0 - square) * math.asin(root))
            else:
                factor = half * (1.0 + square / 3.0)
        if path == GIVEN:
            north, east, down = positions[k, 0], positions[k, 1], positions[k, 2]
        else:
            north += factor * (tx0 + tx1)
            east += factor * (ty0 + ty1)
            down += factor * (tz0 + tz1)
            positions[k, 0], positions[k, 1], positions[k, 2] = north, east, down
        px, py, pz = mx, my, mz
        mx, my, mz = 0.5 * (tx0 + tx1), 0.5 * (ty0 + ty1), 0.5 * (tz0 + tz1)
        own = 2.0 * half if slot and k == 1 else half
        both = own + (0.5 * (md[k + 1] - md1) if k + 1 < len(md) else 0.0)
        vertical = inc1 < VERTICAL or inc1 > math.pi - VERTICAL
        azi1 = bearing1
        if vertical:  # as ``leaning_azimuth``
            azi1, ca1, sa1 = 0.0, 1.0, 0.0
        ix, iy, iz = ci1 * ca1, ci1 * sa1, -si1
        ax, ay = -si1 * sa1, si1 * ca1
        c0 = c1 = c2 = c3 = c4 = c5 = 0.0
""".replace("TINY", repr(TINY))
    .replace("VERTICAL", repr(VERTICAL))
    .replace("OPPOSITE", repr(1.0 - 1e-12))
    .replace("CURVED", repr(CURVED))
    .replace("GIVEN", repr(GIVEN))
)
TAIL = """
        c0, c1, c2, c3, c4, c5 = c0 + r0, c1 + r1, c2 + r2, c3 + r3, c4 + r4, c5 + r5
        cov[k, 0, 0], cov[k, 0, 1], cov[k, 0, 2] = c0, c1, c3
        cov[k, 1, 0], cov[k, 1, 1], cov[k, 1, 2] = c1, c2, c4
        cov[k, 2, 0], cov[k, 2, 1], cov[k, 2, 2] = c3, c4, c5
"""
END = """
        if not abs(c0 + c2 + c5) < 1e24:
            return -k
    return 0


@kernel
def wells(
    md, inc, azi, path, slot, gravity, b_field, dip, declination, latitude, parameters, record, modes, positions, cov,
    parts,
):
    for w in range(len(md)):
        status = well(
            md[w], inc[w], azi[w], path, slot, gravity, b_field, dip, declination, latitude, parameters, record[w],
            modes, positions[w], cov[w], parts,
        )
        if status != 0:
            return w, status
    return 0, 0
"""
AXES = ("x", "y", "z")
PAIRS = (("x", "x"), ("x", "y"), ("y", "y"), ("x", "z"), ("y", "z"), ("z", "z"))  # the covariance's entries, in order


def loop_sources(tool: SurveyTool, *, by_source: bool) -> list[ErrorSource]:
    """Error sources of a loop: all of them, or those with one formula merged."""
    legs = (Leg(tool),)
    return sources_of(legs) if by_source else merged_sources(legs)


def write_model(tool: SurveyTool, *, by_source: bool = False) -> str:
    """Source of the compiled loop of a tool."""
    sources = loop_sources(tool, by_source=by_source)
    terms = [source.rows[0][2] for source in sources]
    formulas = [text for term in terms for text in (["0"] * 9 if term.by_mode else term.formulas)]
    program = translate_formulas(formulas, tuple(tool.parameters))
    states, body, after = [], [], []
    modes = 0
    for n, source in enumerate(sources):
        tokens = program.results[9 * n : 9 * n + 9]
        if terms[n].by_mode:
            tokens = [f"modes[{modes}, k - 1, {place}]" for place in range(TURNS + 1)]
            modes += 1
        state, lines, later = _source_code(n, source, tokens, by_source=by_source)
        states += state
        body += lines
        after += later
    inputs, fixed = [], set()
    for k in program.inputs:
        known = k < len(VARIABLES)
        inputs.append(f"v{k} = " + (STATION[VARIABLES[k]] if known else f"parameters[{k - len(VARIABLES)}]"))
        if not known or VARIABLES[k] in PLACE:
            fixed.add(f"v{k}")
    once, each = _parted([*inputs, *program.lines], fixed)
    parts = [HEAD, _indented(1, [*once, *states]), STEP, _indented(2, [*each, *body]), TAIL]
    return "\n".join([*parts, _indented(2, after), END])


def _parted(lines: list[str], fixed: set[str]) -> tuple[list[str], list[str]]:
    """Assignments that every station would repeat, and the others; ``fixed`` are the inputs that do not change.

    The compiler moves sums out of the loop by itself, but no call of a tangent.
    """
    fixed, once, each = set(fixed), [], []
    for line in lines:
        name, _, text = line.partition(" = ")
        if name in fixed or (name.startswith("t") and set(LOCAL.findall(text)) <= fixed):
            fixed.add(name)
            once.append(line)
        else:
            each.append(line)
    return once, each


def _source_code(
    n: int, source: ErrorSource, tokens: list[str], *, by_source: bool
) -> tuple[list[str], list[str], list[str]]:
    """Lines of one source: its state, its work at a station, and what it passes to the next."""
    _, _, term = source.rows[0]
    axes, sigma = AXES[: source.axes], repr(term.sigma)
    pairs = [(k, a, b) for k, (a, b) in enumerate(PAIRS) if a in axes and b in axes]
    gone = f"r{n}_" if by_source else "r"  # products of what is over: random stations, former sections
    keeps = by_source and (source.random or source.renewed)
    state = [f"s{n}{a} = 0.0" for a in axes] if not source.random else []
    state += [f"{gone}{k} = 0.0" for k, _, _ in pairs] if keeps else []
    lines: list[str] = []
    after: list[str] = []
    by_depth = not is_zero(term.weights[0])
    turns = not (is_zero(term.weights[1]) and is_zero(term.weights[2]))
    star = dict.fromkeys(axes, "")
    if source.renewed:
        state.append(f"z{n} = 0.0")
        lines.append(f"if {tokens[TURNS]} != z{n}:")
        lines += [f"    {gone}{k} += s{n}{a} * s{n}{b}" for k, a, b in pairs]
        lines += [f"    s{n}{a} = 0.0" for a in axes] + [f"    z{n} = {tokens[TURNS]}"]
    if by_depth:
        state.append(f"d{n} = 0.0")
        if source.random:
            lines += [f"q{a} = d{n} * (p{a} - m{a})" for a in AXES]
            lines += [f"{gone}{k} += q{a} * q{b}" for k, (a, b) in enumerate(PAIRS)]
        else:
            lines += [f"s{n}{a} += d{n} * (p{a} - m{a})" for a in AXES]
        lines.append(f"d{n} = {tokens[0]} * {sigma}")
        star = {a: f"d{n} * m{a}" for a in axes}
    if turns:
        lines += _turn(n, source, tokens, sigma)
        star = {a: " + ".join(filter(None, (star[a], f"own * w{n}{a}"))) for a in axes}
    if term.position is not None:
        lines += [f"g{n}{a} = {tokens[6 + k]} * {sigma}" for k, a in enumerate(AXES)]
        star = {a: " + ".join(filter(None, (star[a], f"g{n}{a}"))) for a in axes}
    lines += [f"e{a} = {star[a] or '0.0'}" if source.random else f"e{a} = s{n}{a} + {star[a] or '0.0'}" for a in axes]
    if by_source:
        lines += _own_part(n, pairs, gone if keeps else "")
    else:
        lines += [f"c{k} += e{a} * e{b}" for k, a, b in pairs]
    moving = {
        a: [x for x in (f"both * w{n}{a}" if turns else "", f"g{n}{a}" if term.position else "") if x] for a in axes
    }
    if any(moving.values()):
        if source.random:
            after += [f"q{a} = {' + '.join(moving[a])}" for a in axes]
            after += [f"{gone}{k} += q{a} * q{b}" for k, a, b in pairs]
        else:
            after += [f"s{n}{a} += {' + '.join(moving[a])}" for a in axes]
    return state, lines, after


def _own_part(n: int, pairs: list[tuple[int, str, str]], gone: str) -> list[str]:
    """Lines that write the covariance of one source and add it to the whole."""
    lines = []
    for k, a, b in pairs:
        i, j = AXES.index(a), AXES.index(b)
        lines.append(f"part = e{a} * e{b}" + (f" + {gone}{k}" if gone else ""))
        lines.append(
            " = ".join([f"parts[{n}, k, {i}, {j}]", *([f"parts[{n}, k, {j}, {i}]"] if i != j else []), "part"])
        )
        lines.append(f"c{k} += part")
    return lines


def _turn(n: int, source: ErrorSource, tokens: list[str], sigma: str) -> list[str]:
    """Change of the tangent by one standard deviation of a source."""
    _, _, term = source.rows[0]
    axes = AXES[: source.axes]
    lines = [f"wi = {tokens[1]} * {sigma}", f"wa = {tokens[2]} * {sigma}"]
    plain = {"x": "wi * ix + wa * ax", "y": "wi * iy + wa * ay", "z": "wi * iz"}
    if is_zero(term.weights[1]):
        lines, plain = lines[1:], {"x": "wa * ax", "y": "wa * ay", "z": "0.0"}
    elif is_zero(term.weights[2]):
        lines, plain = lines[:1], {"x": "wi * ix", "y": "wi * iy", "z": "wi * iz"}
    lines += [f"w{n}{a} = {plain[a]}" for a in axes]
    if term.singular is None:
        lost = " or ".join(f"not abs({line[:2]}) < {NO_WEIGHT!r}" for line in lines if line.startswith(("wi", "wa")))
        lines.append(f"if vertical and ({lost}):")
        lines.append("    return -k")
    if term.singular is not None:
        lines.append("if vertical:")
        lines += [f"    w{n}{a} = {tokens[3 + k]} * {sigma}" for k, a in enumerate(axes)]
    return lines


def _indented(depth: int, lines: list[str]) -> str:
    return "\n".join("    " * depth + line for line in lines)
