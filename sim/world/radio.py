"""Margins of the joints of a string that speaks by radio: at any rig time, in any order."""

from __future__ import annotations

import math
import warnings
from bisect import bisect_right
from collections.abc import Callable, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from sim.world.radio_section import LayerSection, PipeSection, RadioSection
from sim.world.random_streams import RandomStream, random_stream
from telemetry.errors import RadioError
from telemetry.radio.path_loss import link_margin, packet_error_rate, path_loss, propagation_constants, received_power
from telemetry.radio.soil_dielectric import PorosityWarning, Soil, soil_permittivity
from telemetry.radio.steel import steel_resistivity
from telemetry.radio.waveguide import TE11, nepers_to_decibels, wall_attenuation

Array = npt.NDArray[np.float64]
LOOK_EVERY = 1.0  # s, between two looks at how deep the string stands


class RadioLinks:
    """What the ends of the tubes hear of each other.

    A joint is named by the tube below it; above that hangs the next tube or the drive head.

    Parameters
    ----------
    section : of the scenario
    seed : of the draws: the constant fade of each joint and its bursts
    tubes, tube_length : of the string, m
    begin, end : rig times (s) between which bursts are drawn
    bit_depth : measured depth (m) of the bit at a rig time
    true_depth : true vertical depth (m) of a measured one in the hole
    """

    def __init__(
        self,
        section: RadioSection,
        seed: int,
        tubes: int,
        tube_length: float,
        begin: float,
        end: float,
        bit_depth: Callable[[float], float],
        true_depth: Callable[[float], float],
    ) -> None:
        self.section = section
        self._tube_length = tube_length
        joints = range(1, tubes + 1)
        self._fades = [
            section.fade_std_db * random_stream(seed, RandomStream.RADIO_FADE, k).standard_normal() for k in joints
        ]
        self._bursts = [Bursts(section, random_stream(seed, RandomStream.RADIO_BURSTS, k), begin, end) for k in joints]
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PorosityWarning)  # the user was warned when the scenario was loaded
            self._of_layers = layer_margins(section)
        self._bounds = [layer.to_m or math.inf for layer in section.soil]
        self._of_hops = hop_margins(section, tube_length)
        self._bit_depth = lru_cache(maxsize=64)(bit_depth)
        self._true_depth = lru_cache(maxsize=1024)(true_depth)

    @property
    def reach(self) -> int:
        """Tubes away that a node hears."""
        return reach_of(self.section)

    def margin(self, joints: Sequence[int], t: float) -> float:
        """Margin (dB) over the ``joints`` passed, neighbours in the string, at rig time ``t`` (s)."""
        if self.section.mode == "soil":
            (joint,) = joints
            clear = self._of_layers[self._layer(joint, t)]
        else:
            clear = self._of_hops[len(joints)]
        return clear - sum(self._fades[k - 1] + self._bursts[k - 1].loss(t) for k in joints)

    def error_rate(self, margin_db: float) -> float:
        """Probability that one attempt at a packet fails."""
        return float(packet_error_rate(margin_db, self.section.width_db))

    def states(self, joint: int, t: float) -> tuple[float, float]:
        """Margins (dB) of a joint outside bursts and inside, about rig time ``t`` (s)."""
        clear = self.margin((joint,), t) + self._bursts[joint - 1].loss(t)
        return clear, clear - self.section.burst_db

    def _layer(self, joint: int, t: float) -> int:
        """0 is the air above the ground, 1 the first layer."""
        md = self._bit_depth(t - t % LOOK_EVERY) - joint * self._tube_length
        return 0 if md < 0.0 else 1 + bisect_right(self._bounds, self._true_depth(md))


class Bursts:
    """Times in which a joint loses more than usual: both the gaps between them and they are exponential.

    Parameters
    ----------
    section : how often, how long, how much
    random : of the joint
    begin, end : s, rig time
    """

    def __init__(self, section: RadioSection, random: np.random.Generator, begin: float, end: float) -> None:
        self._starts: list[float] = []
        self._ends: list[float] = []
        self._loss = section.burst_db
        t = begin
        while section.burst_every_s is not None:
            t += section.burst_every_s * float(random.standard_exponential())
            if t >= end:
                break
            self._starts.append(t)
            t += section.burst_s * float(random.standard_exponential())
            self._ends.append(t)

    def loss(self, t: float) -> float:
        """What the joint loses beside the usual at rig time ``t`` (s), dB."""
        k = bisect_right(self._starts, t) - 1
        return self._loss if k >= 0 and t < self._ends[k] else 0.0


def reach_of(section: RadioSection) -> int:
    """Tubes away that a node hears: through soil its neighbour alone."""
    return 1 if section.mode == "soil" else pipe_of(section).reach


def pipe_of(section: RadioSection) -> PipeSection:
    """The pipe, that of a scenario which says nothing of it included."""
    return section.pipe or PipeSection()


def layer_margins(section: RadioSection) -> list[float]:
    """Margins (dB) of a joint in the air above the ground, then in each layer from the top down.

    Raises
    ------
    RadioError
        With the valid range, for what lies outside the models.
    """
    if section.mode == "pipe":
        return []
    f = section.frequency_mhz * 1e6
    air = 1.0, 0.0
    losses = [
        path_loss(*propagation_constants(*eps, f), section.gap_m)
        for eps in (air, *(of_layer(s, f) for s in section.soil))
    ]
    return [float(link_margin(power_of(section, loss), section.threshold_dbm)) for loss in losses]


def of_layer(layer: LayerSection, frequency: float) -> tuple[float, float]:
    """Relative permittivity of a layer, real part and loss (Hz)."""
    soil = Soil(layer.sand, layer.clay, layer.bulk_density_g_cm3, layer.water, layer.temperature_c)
    real, loss = soil_permittivity(soil, frequency)
    return float(real), float(loss)


def hop_margins(section: RadioSection, tube_length: float) -> list[float]:
    """Margins (dB) inside the pipe by the number of tubes away, from 0 on.

    Raises
    ------
    RadioError
        With the valid range; below the cut-off of the pipe nothing propagates.
    """
    if section.mode == "soil":
        return []
    pipe = pipe_of(section)
    rho = steel_resistivity(pipe.carbon_percent, pipe.temperature_c)
    wall = nepers_to_decibels(wall_attenuation(TE11, pipe.radius_cm * 1e-2, section.frequency_mhz * 1e6, rho))
    losses = (float(wall) * tube_length + pipe.joint_db) * np.arange(pipe.reach + 1.0)
    margins: list[float] = link_margin(power_of(section, losses), section.threshold_dbm).tolist()
    return margins


def power_of(section: RadioSection, loss: npt.ArrayLike) -> Array:
    """Power (dBm) received over a loss (dB)."""
    return received_power(loss, section.transmit_dbm, 2.0 * section.gain_dbi)


def check_radio(section: RadioSection, tube_length: float) -> None:
    """Refuse a radio outside the models, or with tables of the other mode.

    Raises
    ------
    RadioError
        Naming the key or the quantity, with the valid range.
    """
    if section.mode == "soil":
        bounds = [layer.to_m for layer in section.soil]
        if not bounds or section.pipe is not None:
            raise RadioError("soil: expected at least one [[radio.soil]] and no [radio.pipe] with the mode soil")
        above = [bound for bound in bounds[:-1] if bound is not None]
        if bounds[-1] is not None or sorted(set(above)) != bounds[:-1]:
            raise RadioError("soil.to_m: expected growing depths, and none in the last layer")
        layer_margins(section)
    else:
        if section.soil:
            raise RadioError("soil: expected no [[radio.soil]] with the mode pipe")
        hop_margins(section, tube_length)
