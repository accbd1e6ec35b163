"""Trajectory and region of uncertainty in one compiled loop, for campaigns and long wells.

From an instrument's formulas a function is written that walks down a well once: position, weights of all sources,
their running sums and the covariance, each in a local. The compiler sees no arrays but the stations and the result. The
written file lies in the cache of the kernels, so a tool is compiled once a machine. The equations are those of
``error_model``, which tests hold it against; this module alone needs the compiler, and loads it when a model is built.
"""

from __future__ import annotations

import hashlib
import importlib.util
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError, ToolError
from groundstation.survey.error_model import surface_covariance
from groundstation.survey.error_sources import (
    EARTH_RATE,
    NO_WEIGHT,
    RECORD,
    SECONDS_A_METRE,
    TINY,
    VERTICAL,
    Leg,
    Site,
    Source,
    merged_sources,
)
from groundstation.survey.formulas import VARIABLES, is_zero, translate
from groundstation.survey.instruments import Tool
from groundstation.survey.methods import Method, check_stations

Array = npt.NDArray[np.float64]
STATION = {
    "MD": "md1", "MDPrev": "md0", "TVD": "down", "Inc": "inc1", "IncPrev": "inc0", "Az": "azi1", "AzPrev": "azi0",
    "AzT": "azi1", "AzTPrev": "azi0", "AzM": "(azi1 - declination)", "AzMPrev": "(azi0 - declination)",
    "GField": "gravity", "BField": "b_field", "Dip": "dip", "Latitude": "latitude", "EarthRate": repr(EARTH_RATE),
    "Time": f"({SECONDS_A_METRE!r} * md1)", "TimePrev": f"({SECONDS_A_METRE!r} * md0)",
    **{name: repr(value) for name, value in RECORD.items()},
}  # fmt: skip
HEAD = """
import math

from node.kernels.jit import kernel

_sin, _cos, _tan, _sqrt, _abs, _max, _min = math.sin, math.cos, math.tan, math.sqrt, abs, max, min


@kernel
def _step(x):
    return 1.0 if x > 0.0 else 0.0


@kernel
def well(md, inc, azi, curved, slot, gravity, b_field, dip, declination, latitude, parameters, positions, cov):
    north = east = down = 0.0
    md1, inc1, azi1 = md[0], max(inc[0], TINY), azi[0]
    si1, ci1, ca1, sa1 = math.sin(inc1), math.cos(inc1), math.cos(azi1), math.sin(azi1)
    tx1, ty1, tz1 = si1 * ca1, si1 * sa1, ci1
    mx = my = mz = 0.0
    r0 = r1 = r2 = r3 = r4 = r5 = 0.0
""".replace("TINY", repr(TINY))
STEP = (
    """
    for k in range(1, len(md)):
        md0, inc0, azi0 = md1, inc1, azi1
        md1, inc1, azi1 = md[k], max(inc[k], TINY), azi[k]
        half = 0.5 * (md1 - md0)
        tx0, ty0, tz0 = tx1, ty1, tz1
        si1, ci1, ca1, sa1 = math.sin(inc1), math.cos(inc1), math.cos(azi1), math.sin(azi1)
        tx1, ty1, tz1 = si1 * ca1, si1 * sa1, ci1
        factor = half
        if curved:
            sin_i, sin_a = math.sin(0.5 * (inc1 - inc0)), math.sin(0.5 * (azi1 - azi0))
            square = sin_i * sin_i + math.sqrt(tx0 * tx0 + ty0 * ty0) * si1 * sin_a * sin_a
            if square > OPPOSITE:
                return k
            # (2/b) tan(b/2) with sin(b/2) the root of square
            if square > 1e-8:
                root = math.sqrt(square)
                factor = half * root / (math.sqrt(1.0 - square) * math.asin(root))
            else:
                factor = half * (1.0 + square / 3.0)
        north += factor * (tx0 + tx1)
        east += factor * (ty0 + ty1)
        down += factor * (tz0 + tz1)
        positions[k, 0], positions[k, 1], positions[k, 2] = north, east, down
        px, py, pz = mx, my, mz
        mx, my, mz = 0.5 * (tx0 + tx1), 0.5 * (ty0 + ty1), 0.5 * (tz0 + tz1)
        own = 2.0 * half if slot and k == 1 else half
        both = own + (0.5 * (md[k + 1] - md1) if k + 1 < len(md) else 0.0)
        ix, iy, iz = ci1 * ca1, ci1 * sa1, -si1
        ax, ay = -si1 * sa1, si1 * ca1
        vertical = inc1 < VERTICAL or inc1 > math.pi - VERTICAL
        c0 = c1 = c2 = c3 = c4 = c5 = 0.0
""".replace("TINY", repr(TINY))
    .replace("VERTICAL", repr(VERTICAL))
    .replace("OPPOSITE", repr(1.0 - 1e-12))
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
"""
AXES = ("x", "y", "z")
PAIRS = (("x", "x"), ("x", "y"), ("y", "y"), ("x", "z"), ("y", "z"), ("z", "z"))  # the covariance's entries, in order


class CompiledModel:
    """One instrument, compiled; what a record may hold beyond directions is taken at its default.

    Parameters
    ----------
    tool : any instrument
    """

    def __init__(self, tool: Tool) -> None:
        self.tool = tool
        self._parameters = np.array([*tool.parameters.values(), 0.0])
        self._function = _load(write_model(tool))

    def run(self, method: Method, md: Array, inclination: Array, azimuth: Array, site: Site) -> tuple[Array, Array]:
        """Positions (n, 3) and their covariances (n, 3, 3) of one well (n,).

        Raises
        ------
        SurveyError, ToolError
            When the arrays are not a survey, the method is not one of the two, or a weight has no value at a station.
        """
        check_stations(md, inclination, azimuth)
        if method not in (Method.BALANCED_TANGENTIAL, Method.MINIMUM_CURVATURE):
            raise SurveyError(f"compiled model: expected balanced-tangential or minimum-curvature, got {method.value}")
        positions, cov = np.zeros((len(md), 3)), np.zeros((len(md), 3, 3))
        status = self._function(
            md, inclination, azimuth, method is Method.MINIMUM_CURVATURE, self.tool.slot_allowance, site.gravity,
            site.b_field, site.dip, site.declination, site.latitude, self._parameters, positions, cov,
        )  # fmt: skip
        if status > 0:
            raise SurveyError(f"survey: station {status}: the hole turns straight back on itself")
        if status < 0:
            raise ToolError(f"{self.tool.name}: a weight has no value at station {-status}; give singular weights")
        cov[0] = surface_covariance(md, inclination, azimuth, self.tool)
        return positions, cov


def write_model(tool: Tool) -> str:
    """Source of the compiled loop of a tool."""
    sources = merged_sources((Leg(tool),))
    formulas = [text for source in sources for text in source.rows[0][2].formulas]
    program = translate(formulas, tuple(tool.parameters))
    states, body, after = [], [], []
    for n, source in enumerate(sources):
        state, lines, later = _source_code(n, source, program.results[9 * n : 9 * n + 9])
        states += state
        body += lines
        after += later
    inputs = []
    for k in program.inputs:
        known = k < len(VARIABLES)
        inputs.append(f"v{k} = " + (STATION[VARIABLES[k]] if known else f"parameters[{k - len(VARIABLES)}]"))
    parts = [HEAD, _indented(1, states), STEP, _indented(2, [*inputs, *program.lines, *body]), TAIL]
    return "\n".join([*parts, _indented(2, after), END])


def _source_code(n: int, source: Source, tokens: list[str]) -> tuple[list[str], list[str], list[str]]:
    """Lines of one source: its state, what a station does with it, and what it leaves to the next."""
    _, _, term = source.rows[0]
    axes, sigma = AXES[: source.axes], repr(term.sigma)
    state = [f"s{n}{a} = 0.0" for a in axes] if not source.random else []
    lines: list[str] = []
    after: list[str] = []
    by_depth = not is_zero(term.weights[0])
    turns = not (is_zero(term.weights[1]) and is_zero(term.weights[2]))
    star = dict.fromkeys(axes, "")
    if by_depth:
        state.append(f"d{n} = 0.0")
        if source.random:
            lines += [f"q{a} = d{n} * (p{a} - m{a})" for a in AXES]
            lines += [f"r{k} += q{a} * q{b}" for k, (a, b) in enumerate(PAIRS)]
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
    pairs = [(k, a, b) for k, (a, b) in enumerate(PAIRS) if a in axes and b in axes]
    lines += [f"c{k} += e{a} * e{b}" for k, a, b in pairs]
    moving = {
        a: [x for x in (f"both * w{n}{a}" if turns else "", f"g{n}{a}" if term.position else "") if x] for a in axes
    }
    if any(moving.values()):
        if source.random:
            after += [f"q{a} = {' + '.join(moving[a])}" for a in axes]
            after += [f"r{k} += q{a} * q{b}" for k, a, b in pairs]
        else:
            after += [f"s{n}{a} += {' + '.join(moving[a])}" for a in axes]
    return state, lines, after


def _turn(n: int, source: Source, tokens: list[str], sigma: str) -> list[str]:
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


def _load(source: str) -> Callable[..., Any]:
    """Function of a written model, from the cache folder of the kernels."""
    from node.kernels.jit import cache_folder

    name = f"model_{hashlib.sha256(source.encode()).hexdigest()[:16]}"
    path = cache_folder() / "models" / f"{name}.py"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        fresh = path.with_suffix(f".{id(source)}.new")
        fresh.write_text(source)
        fresh.replace(path)
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ToolError(f"{path}: the compiled model cannot be loaded; remove the file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # the compiler's cache asks for it by its name
    spec.loader.exec_module(module)
    function: Callable[..., Any] = module.well
    return function
