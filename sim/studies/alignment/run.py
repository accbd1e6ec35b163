"""Alignment: a circle fitted over slow turns beside (max + min) / 2, and what it does to a survey.

The firmware of one node rests, turns slowly and rests again under continuous aiding, its sensors on a mount that leans
against the tube's axis. The published figures, 0.0014 and 0.0086 deg over two turns at 7 deg/s, go with the noise of
0.02 deg a sample and the inclination of 2 deg that thesis 4.2 has: 0.02 / sqrt(195 samples) is 0.0014. The circle does
not depend on the inclination, the extremes do. Ours frees the drift of the turned angle too, which costs 4 % over two
turns. The accelerometer has no bias here: at one inclination its part across the axis looks like a lean of the mount.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import direction_angles, resolve_direction
from node.firmware.alignment_orders import METHODS, angles_of
from node.firmware.tube_settings import Kernel
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import default_config
from sim.string.direct_string import DirectString
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import Tables, complete_string
from sim.studies.trials import bootstrap_interval, interval_row
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
REST, STOP = 60.0, 32.0  # s, before and after the turn
ASKED = 5.0  # s before the turn, when the node is asked to align
SPARE = 0.25  # turns, before the first that counts and after the last
USUAL_NOISE_DEG = 0.02
PUBLISHED_DEG = {"circle": 0.0014, "extremes": 0.0086}
NAMES = {"circle": "circle", "extremes": "(max + min) / 2"}


@dataclass(frozen=True, slots=True)
class Setup:
    """One slow turn of one node."""

    inclination_deg: float = 2.0
    noise_deg: float = 0.02
    turns: float = 2.0
    rate_dps: float = 7.0
    mount_tilt_std_deg: float = 0.5
    bias_std_deg: float = 0.0  # of the accelerometer, each axis
    kernel: Kernel = "float64"

    def tables(self) -> Tables:
        """Tables of the scenario."""
        usual = float(default_config()[0]["force_std"])
        return {
            "rig": complete_string(1),
            "path": {"straight": {"inclination_deg": self.inclination_deg}},
            "schedule": {"add_s": REST, "stop_s": STOP, "finish_s": 5.0, "blocks": 1},
            "rotation": {"turns": self.turns + 2.0 * SPARE, "rate_dps": self.rate_dps, "advance_m": 0.0},
            "joints": {"reading_std_deg": 0.0, "mount_std_deg": 0.0, "mount_tilt_std_deg": self.mount_tilt_std_deg},
            "accelerometer": {
                "noise_deg": self.noise_deg,
                "bias_std_deg": self.bias_std_deg,
                "vibration_mps2": 0.0,  # it turns and does not drill
            },
            "clocks": {"joint_std_ms": 0.0, "wander_std_ms": 0.0, "stated_std_ms": 0.1},
            "medium": {"link": "off", "loss": 0.0},
            "node": {"kernel": self.kernel, "tuning": {"force_std": usual * self.noise_deg / USUAL_NOISE_DEG}},
        }


@dataclass(frozen=True, slots=True)
class AlignmentOutcome:
    """Result of one method on one seed; rad."""

    error: tuple[float, float]  # of pitch and roll
    std: tuple[float, float]  # as the node says
    inclination_error: float  # of the survey after the turn
    events: tuple[str, ...]


class Turn:
    """World of one seed, and as many nodes as are asked to listen to its sensors."""

    def __init__(self, setup: Setup, seed: int) -> None:
        self._setup = setup
        self.world = World(scenario_of(dict(setup.tables())), seed)
        self.tilts = np.array(self.world.sensors.tilt(1))

    def run(self, method: str) -> AlignmentOutcome:
        """Let one node rest, turn and rest; ``method`` aligns it, ``none`` leaves the mount as it is."""
        string, asked_at = DirectString(self.world), self.world.begin + REST - ASKED
        for cycle in string.steps():
            end = self.world.cycle_end(cycle)
            if method != "none" and end <= asked_at < end + PERIOD:
                string.tubes[1].align(method, self._setup.turns)
        mount = string.nodes[0]["mount"]
        pitch, roll = angles_of(mount["axis"][0])
        survey = string.run.surveys[-1].measurement.imus[0]
        direction = resolve_direction(np.array(survey.force), np.array(survey.force_cov), 0.0, 1e-12).direction
        inclination = direction_angles(direction.lean, direction.down)[0]
        return AlignmentOutcome(
            (pitch - float(self.tilts[0]), roll - float(self.tilts[1])),
            (float(mount["std"][0, 0]), float(mount["std"][0, 1])),
            inclination - math.radians(self._setup.inclination_deg),
            tuple(event.code for _, event in string.run.events),
        )


BASE = Setup()
SWEEPS: dict[str, tuple[str, tuple[Setup, ...]]] = {
    "inclination_deg": (
        "Inclination (deg)",
        tuple(replace(BASE, inclination_deg=x) for x in (0.3, 1.0, 2.0, 5.0, 10.0)),
    ),
    "noise_deg": ("Noise of a sample (deg)", tuple(replace(BASE, noise_deg=x) for x in (0.005, 0.01, 0.02, 0.05))),
    "turns": ("Turns", tuple(replace(BASE, turns=x) for x in (1.0, 2.0, 4.0))),
}


def all_setups() -> list[Setup]:
    """Every setup once, that of the published figures first."""
    return list(dict.fromkeys([BASE, *(s for _, sweep in SWEEPS.values() for s in sweep)]))


def count_steps(seeds: int) -> int:
    """Runs of one seed."""
    return seeds * len(all_setups())


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """Rows of the published setup, then of the sweeps; ``sweeps`` holds what the figure shows."""
    with over_cores(seeds, step) as run_all:
        found = {setup: run_all(run_seed, seed_jobs(setup, seeds)) for setup in all_setups()}
    cases = list(base_rows(found[BASE]))
    for name, (_, sweep) in SWEEPS.items():
        for setup in sweep:
            if setup != BASE:
                label = f"{name.removesuffix('_deg').replace('_', ' ')} {getattr(setup, name):g}"
                cases += [offset_row(f"{NAMES[m]}, {label}", found[setup], m) for m in METHODS]
    sweeps = {name: [sweep_point(name, s, found[s]) for s in sweep] for name, (_, sweep) in SWEEPS.items()}
    return {"experiment": "alignment", "seeds": seeds, "cases": cases, "sweeps": sweeps}


def run_seed(job: tuple[Setup, int]) -> dict[str, AlignmentOutcome]:
    """All methods on the sensors of one seed, for a pool of processes."""
    setup, seed = job
    turn = Turn(setup, seed)
    return {method: turn.run(method) for method in (*METHODS, "none")}


def base_rows(found: list[dict[str, AlignmentOutcome]]) -> Iterator[dict[str, Any]]:
    """Offsets beside the published ones, their ratio and consistency, and the survey before and after."""
    for method in METHODS:
        yield offset_row(NAMES[method], found, method, published=PUBLISHED_DEG[method])
    published = PUBLISHED_DEG["extremes"] / PUBLISHED_DEG["circle"]
    yield interval_row("(max + min) / 2 over circle", "offset", error_ratio(found), unit="1", published=published)
    for method in METHODS:
        squares = np.array([float(np.mean(np.square(o.error) / np.square(o.std))) for o in outcomes_of(found, method)])
        yield interval_row(
            NAMES[method], "NEES of the offset", (float(squares.mean()), *bootstrap_interval(squares)), unit="1"
        )
    for method, name in {"none": "not aligned", **NAMES}.items():
        yield interval_row(
            name,
            "inclination of the survey after",
            rms_interval_deg([np.array([o.inclination_error]) for o in outcomes_of(found, method)]),
        )


def offset_row(
    case: str, found: list[dict[str, AlignmentOutcome]], method: str, published: float | None = None
) -> dict[str, Any]:
    """Error of pitch and roll together."""
    return interval_row(
        case, "offset", rms_interval_deg([np.array(o.error) for o in outcomes_of(found, method)]), published=published
    )


def sweep_point(name: str, setup: Setup, found: list[dict[str, AlignmentOutcome]]) -> dict[str, Any]:
    """One point of a figure: for each method the error with its interval, and what the node says of it; deg."""
    point: dict[str, Any] = {"x": getattr(setup, name)}
    for method in METHODS:
        said = math.degrees(math.sqrt(float(np.mean([np.square(o.std) for o in outcomes_of(found, method)]))))
        point[method] = [*rms_interval_deg([np.array(o.error) for o in outcomes_of(found, method)]), said]
    return point


def error_ratio(found: list[dict[str, AlignmentOutcome]]) -> tuple[float, float, float]:
    """Error of the extremes over that of the circle, with the ends of its interval (bootstrap over seeds)."""
    squares = np.array([[float(np.mean(np.square(o[m].error))) for m in ("circle", "extremes")] for o in found])
    random = np.random.Generator(np.random.Philox(len(found)))
    means = squares[random.integers(0, len(squares), (2000, len(squares)))].mean(axis=1)
    low, high = np.quantile(np.sqrt(means[:, 1] / means[:, 0]), (0.025, 0.975))
    both = squares.mean(axis=0)
    return math.sqrt(float(both[1] / both[0])), float(low), float(high)


def outcomes_of(found: list[dict[str, AlignmentOutcome]], method: str) -> list[AlignmentOutcome]:
    """Outcomes of one method."""
    return [outcomes[method] for outcomes in found]


def rms_interval_deg(errors: list[Array]) -> tuple[float, float, float]:
    """Root mean square in degrees of one array (rad) a seed, with the ends of its interval."""
    squares = np.array([float(np.mean(np.square(e))) for e in errors])
    low, high = np.degrees(np.sqrt(bootstrap_interval(squares)))
    return math.degrees(math.sqrt(float(squares.mean()))), float(low), float(high)
