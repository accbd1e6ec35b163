"""Trajectory and region of uncertainty in one compiled loop.

From an instrument's formulas a function is written that walks down a well once: position, weights of all sources,
their running sums and the covariance, each in a local, and where asked the covariance of every source. The compiler
sees no arrays but the stations, what the record holds beside them, the weights of a gyro's modes and the result. The
written file lies in the cache of the kernels, so a tool is compiled once a machine. The equations are those of
``error_model``, which tests hold it against; this module alone needs the compiler, and loads it when a model is built.
"""

from __future__ import annotations

import hashlib
import importlib.util
import math
import sys
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError, ToolError
from groundstation.survey.tools.instruments import SurveyTool, load_tool
from groundstation.survey.well.compiled_source import CURVED, GIVEN, STRAIGHT, loop_sources, write_model
from groundstation.survey.well.error_propagation import (
    Uncertainty,
    check_legs,
    depth_variance,
    propagate_errors,
    surface_covariance,
)
from groundstation.survey.well.error_sources import RECORD, SECONDS_A_METRE, Leg, Site, WellSurvey
from groundstation.survey.well.gyro_modes import TURNS, mode_weights, sections_of
from groundstation.survey.well.methods import Method, check_stations, station_positions

Array = npt.NDArray[np.float64]
COMPILED_FROM = 100  # stations
COMPILED_BEFORE = ("relay", "mwd-rev5.1")  # by ``make kernels``
HELD = 32  # models of a process
PATHS = {Method.BALANCED_TANGENTIAL: STRAIGHT, Method.MINIMUM_CURVATURE: CURVED}  # the others are found before
DEFAULTS = np.array(list(RECORD.values()))[:, None]  # of what a record may leave out


class CompiledModel:
    """One instrument, compiled.

    Parameters
    ----------
    tool : any instrument
    by_source : whether it gives the covariance of every source too
    """

    def __init__(self, tool: SurveyTool, *, by_source: bool = False) -> None:
        self.tool = tool
        self._sources = loop_sources(tool, by_source=by_source)
        self._in_modes = [source.rows[0] for source in self._sources if source.rows[0][2].by_mode]
        self._by_source = by_source
        self._parameters = np.array([*tool.parameters.values(), 0.0])
        self._depth_variance = depth_variance(tool)
        self._function, self._of_many = _load(write_model(tool, by_source=by_source))

    def run(self, method: Method, md: Array, inclination: Array, azimuth: Array, site: Site) -> tuple[Array, Array]:
        """Positions (n, 3) and their covariances (n, 3, 3) of one well (n,).

        Raises
        ------
        SurveyError, ToolError
            When the arrays are not a survey, or a weight has no value at a station.
        """
        found = self.locate(
            method, WellSurvey(md, inclination, azimuth, md), site, slot_allowance=self.tool.slot_allowance
        )
        return found[0], found[1]

    def locate(
        self, method: Method, survey: WellSurvey, site: Site, *, slot_allowance: bool
    ) -> tuple[Array, Array, dict[str, Array]]:
        """Positions (n, 3) of a well that begins at zero, their covariances, and those of the sources by name.

        The latter of a model made ``by_source``; the survey's own TVD is not looked at. Errors as ``run``.
        """
        check_stations(survey.md, survey.inclination, survey.azimuth)
        path = PATHS.get(method, GIVEN)
        if path == GIVEN or self._in_modes:
            places = station_positions(method, survey.md, survey.inclination, survey.azimuth)
            survey = replace(survey, tvd=places[:, 2])
            return places, *self.covariance(survey, site, slot_allowance=slot_allowance)
        places = np.zeros((len(survey.md), 3))
        return places, *self._run(path, places, survey, site, slot_allowance=slot_allowance)

    def covariance(self, survey: WellSurvey, site: Site, *, slot_allowance: bool) -> tuple[Array, dict[str, Array]]:
        """Covariances (n, 3, 3) of the positions of one well whose TVD is known, and those of its sources.

        The latter by name, of a model made ``by_source``. Errors as ``run``.
        """
        places = np.zeros((len(survey.md), 3))
        places[:, 2] = survey.tvd
        return self._run(GIVEN, places, survey, site, slot_allowance=slot_allowance)

    def locate_many(
        self, method: Method, survey: WellSurvey, site: Site, *, slot_allowance: bool
    ) -> tuple[Array, Array]:
        """Positions (w, n, 3) of wells (w, n) that begin at zero, and their covariances (w, n, 3, 3).

        The survey's own TVD is not looked at. Errors as ``run``; they name the well, from 0.
        """
        md, inclination, azimuth = (np.ascontiguousarray(x) for x in (survey.md, survey.inclination, survey.azimuth))
        check_stations(md, inclination, azimuth)
        if self._in_modes:
            places = station_positions(method, md, inclination, azimuth)
            survey = replace(survey, tvd=places[..., 2])
            return places, propagate_errors(survey, [Leg(self.tool)], site, slot_allowance=slot_allowance).cov
        path = PATHS.get(method, GIVEN)
        places = station_positions(method, md, inclination, azimuth) if path == GIVEN else np.zeros((*md.shape, 3))
        cov = np.zeros((*md.shape, 3, 3))
        well, status = self._of_many(
            md, inclination, azimuth, path, slot_allowance, site.gravity, site.b_field, site.dip, site.declination,
            site.latitude, self._parameters, _record(survey), np.zeros((0, 0, 0)), places, cov, np.zeros((0, 0, 0, 0)),
        )  # fmt: skip
        if status != 0:
            self._refuse(status, replace(survey, tvd=places[..., 2]), site, f"well {well}, ")
        cov[:, 0] = surface_covariance(md, inclination, azimuth, self.tool)
        return places, cov

    def _refuse(self, status: int, survey: WellSurvey, site: Site, where: str = "") -> NoReturn:
        """Raise the error of the station at which the loop ended."""
        if status > 0:
            raise SurveyError(f"survey: {where}station {status}: the hole turns straight back on itself")
        propagate_errors(survey, [Leg(self.tool)], site)  # names the term
        raise ToolError(f"{self.tool.name}: {where}a weight has no value at station {-status}; give singular weights")

    def _run(
        self, path: int, places: Array, survey: WellSurvey, site: Site, *, slot_allowance: bool
    ) -> tuple[Array, dict[str, Array]]:
        count = len(survey.md)
        cov = np.zeros((count, 3, 3))
        parts = np.zeros((len(self._sources) if self._by_source else 0, count, 3, 3))
        status = self._function(
            survey.md, survey.inclination, survey.azimuth, path, slot_allowance, site.gravity, site.b_field, site.dip,
            site.declination, site.latitude, self._parameters, _record(survey), self._modes(survey, site), places, cov,
            parts,
        )  # fmt: skip
        if status != 0:
            self._refuse(status, survey, site)
        if survey.md[0] == 0.0:  # as ``surface_covariance``
            sine, azimuth = math.sin(survey.inclination[0]), survey.azimuth[0]
            along = np.array([sine * math.cos(azimuth), sine * math.sin(azimuth), math.cos(survey.inclination[0])])
            cov[0] = self._depth_variance * along[:, None] * along
        return cov, {source.name: part for source, part in zip(self._sources, parts, strict=False)}

    def _modes(self, survey: WellSurvey, site: Site) -> Array:
        """Weights (m, n - 1, 7) of the sources of a gyro's modes, and the section of every station."""
        out = np.zeros((len(self._in_modes), len(survey.md) - 1, TURNS + 1))
        if self._in_modes:
            weights = mode_weights(Leg(self.tool), survey, site)
            for m, (_, t, term) in enumerate(self._in_modes):
                out[m, :, :TURNS] = np.transpose(weights[t])
                out[m, :, TURNS] = sections_of(term, survey.inclination)
        return out


_held: dict[tuple[SurveyTool, bool], CompiledModel] = {}


def _model(tool: SurveyTool, *, by_source: bool) -> CompiledModel:
    """Model of a tool, held from its first use on."""
    key = tool, by_source
    model = _held.get(key)  # once: to compare two tools goes through all their terms
    if model is None:
        if len(_held) == HELD:
            del _held[next(iter(_held))]
        model = _held[key] = CompiledModel(tool, by_source=by_source)
    return model


def preload_models(names: Sequence[str] = COMPILED_BEFORE) -> None:
    """Compile instruments or load them from the cache, totals and sources, and hold them.

    The first survey does not wait for them then, and short surveys by them run compiled too.
    """
    md, zero = np.arange(3.0), np.zeros(3)
    for name in names:
        for by_source in (False, True):
            model = _model(load_tool(name), by_source=by_source)
            model.run(Method.BALANCED_TANGENTIAL, md, zero, zero, Site())


def locate_stations(
    method: Method, survey: WellSurvey, legs: Sequence[Leg], site: Site, start: Array, *, slot_allowance: bool
) -> tuple[Array, Uncertainty]:
    """Positions (n, 3) of one well from ``start`` (3,) on, and their covariances with those of every source.

    Compiled where one tool took it all, and its model is held or there are ``COMPILED_FROM`` stations: to compile takes
    seconds once a tool and machine, and to load the compiler a quarter of one, a hundred short surveys. All others by
    the arrays of ``error_model``. The survey's own TVD is not looked at.

    Raises
    ------
    SurveyError, ToolError
        As ``error_model.propagate``.
    """
    is_long = len(survey.md) >= COMPILED_FROM
    if len(legs) != 1 or not (is_long or (legs[0].tool, False) in _held):
        places = start + station_positions(method, survey.md, survey.inclination, survey.azimuth)
        return places, propagate_errors(replace(survey, tvd=places[:, 2]), legs, site, slot_allowance=slot_allowance)
    check_legs(survey, legs)
    tool = legs[0].tool
    model = _model(tool, by_source=False)
    if start.any():
        places = start + station_positions(method, survey.md, survey.inclination, survey.azimuth)
        survey = replace(survey, tvd=places[:, 2])
        cov, _ = model.covariance(survey, site, slot_allowance=slot_allowance)
    else:
        places, cov, _ = model.locate(method, survey, site, slot_allowance=slot_allowance)
        survey = replace(survey, tvd=places[:, 2])
    parts = compiled_parts if is_long or (tool, True) in _held else None
    return places, Uncertainty(survey, tuple(legs), site, slot_allowance, cov, parts)


def locate_many(
    method: Method, survey: WellSurvey, tool: SurveyTool, site: Site, *, slot_allowance: bool = False
) -> tuple[Array, Array]:
    """Positions (w, n, 3) of many wells (w, n) that begin at zero, and their covariances (w, n, 3, 3), at one go.

    A call a well costs more than a short well. The survey's own TVD is not looked at.

    Raises
    ------
    SurveyError, ToolError
        As ``error_model.propagate``; where the loop finds it, with the number of the well, from 0.
    """
    check_legs(survey, [Leg(tool)])
    return _model(tool, by_source=False).locate_many(method, survey, site, slot_allowance=slot_allowance)


def compiled_parts(found: Uncertainty) -> dict[str, Array]:
    """Covariances (n, 3, 3) of one well by source, compiled."""
    model = _model(found.legs[0].tool, by_source=True)
    return model.covariance(found.survey, found.site, slot_allowance=found.slot_allowance)[1]


def _record(survey: WellSurvey) -> Array:
    """Time and further columns (..., r, n) of a record, their defaults where it has none."""
    out = np.empty((*survey.md.shape[:-1], 1 + len(RECORD), survey.md.shape[-1]))
    out[..., 0, :] = survey.record.get("Time", SECONDS_A_METRE * survey.md)
    out[..., 1:, :] = DEFAULTS
    for row, name in enumerate(RECORD, 1):
        if name in survey.record:
            out[..., row, :] = survey.record[name]
    return out


def _load(source: str) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Functions of a written model for one well and for many, from the cache folder of the kernels.

    Each lies in a folder of its own: a compiled function is kept as long as the sources beside it stay what they were.
    """
    from node.kernels.arithmetic.jit import folder_in_use

    name = f"model_{hashlib.sha256(source.encode()).hexdigest()[:16]}"
    path = folder_in_use() / "models" / name / f"{name}.py"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".new", delete=False) as fresh:
            fresh.write(source)
        Path(fresh.name).replace(path)  # another process that writes it meanwhile writes the same
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ToolError(f"{path}: the compiled model cannot be loaded; remove the file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # the compiler's cache asks for it by its name
    spec.loader.exec_module(module)
    return module.well, module.wells
