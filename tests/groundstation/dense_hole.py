"""The equations of an adjusted hole as one dense matrix: derivatives by differences, the path by quadrature.

It takes from the product where the unknowns stand, and nothing of how the equations are set up or solved.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from drawn_strings import read_force

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.looks import Looks

Array = npt.NDArray[np.float64]
STEP = 1e-6


class DenseHole:
    """Unknowns x: states (4 a station), 6 a tube, gravity, turns of make-ups.

    Attributes
    ----------
    A, C : (3 n, p) and (3 n, 3 n), design and covariance of the looks
    by_source : covariance (3 n, 3 n) of each independent part of it
    prior : information (p, p) on the unknowns
    cov : (p, p) of the unknowns after the looks
    """

    def __init__(self, found: Adjusted, looks: Looks | None = None, md: Array | None = None) -> None:
        self.found, self.md = found, found.path.md if md is None else md
        self.looks = looks or found.looks
        self.states, self.tubes = 4 * len(self.md), found.string.count
        self.width = self.states + 6 * self.tubes + 1 + len(found.now.make_ups)
        self.gravity_at = self.states + 6 * self.tubes
        self.A = np.zeros((3 * len(self.looks), self.width))
        parts = {name: np.zeros((3 * len(self.looks), 3 * len(self.looks))) for name in ("force", "play", "yaw")}
        for k in range(len(self.looks)):
            at = slice(3 * k, 3 * k + 3)
            self.A[at], by_tilt, by_yaw = self._design(k)
            parts["force"][at, at] = self.looks.force_var[k] * np.eye(3)
            parts["play"][at, at] = found.now.play_var * by_tilt @ by_tilt.T
            parts["yaw"][at, at] = self.looks.yaw_var[k] * np.outer(by_yaw, by_yaw)
        self.by_source = parts
        self.C = parts["force"] + parts["play"] + parts["yaw"]
        self.W = np.linalg.inv(self.C)
        self.prior = self._prior()
        self.cov = np.linalg.inv(self.A.T @ self.W @ self.A + self.prior)

    def tangent(self, station: int) -> tuple[Array, Array]:
        """Direction at a station, and two vectors across; beyond the last as the curvature there leads."""
        now, bases = self.found.now, self.found.linear.bases
        if station < len(now.tangents):
            return now.tangents[station], bases[station]
        length, reach = self.md[-1] - self.md[-2], self.found.path.correlation_length
        d = now.tangents[-1] + now.curvatures[-1] @ bases[-1] * reach * (1.0 - np.exp(-length / reach))
        return d / np.linalg.norm(d), bases[-1]

    def _design(self, k: int) -> tuple[Array, Array, Array]:
        """Row block (3, p) of a look, and its change with the tilt (3, 2) and with its own yaw (3,)."""
        looks, now = self.looks, self.found.now
        tube, station, make_up = int(looks.tube[k]), int(looks.station[k]), int(looks.make_up[k])
        d, basis = self.tangent(station)

        def read(across: Array, bias: Array, tilt: Array, turn: float, gravity: float) -> Array:
            own = now.tubes[tube]
            at = d + across @ basis
            psi = looks.yaw[k] - own[5] - now.make_ups[make_up] - turn
            force = read_force(at / np.linalg.norm(at), psi, own[3:5] + tilt, now.gravity + gravity)
            return force + own[:3] + bias

        rows = np.zeros((3, self.width))
        places = [4 * station, 4 * station + 1, *range(self.states + 6 * tube, self.states + 6 * tube + 6)]
        for column, place in enumerate([*places, self.gravity_at]):
            step = np.zeros(9)
            step[column] = STEP
            ahead, behind = (read(s[:2], s[2:5], s[5:7], s[7], s[8]) for s in (step, -step))
            rows[:, place] = (ahead - behind) / (2.0 * STEP)
        by_turn = rows[:, places[7]]
        rows[:, self.gravity_at + 1 + make_up] = by_turn
        return rows, rows[:, places[5:7]], by_turn

    def _prior(self) -> Array:
        string, path = self.found.string, self.found.path
        info = np.zeros((self.width, self.width))
        basis = self.found.linear.bases[0]
        info[:2, :2] = np.linalg.inv(basis @ path.collar_cov @ basis.T + 1e-16 * np.eye(2))
        info[2:4, 2:4] = np.eye(2) / self.found.now.curvature_var
        for k, length in enumerate(np.diff(self.md)):
            std = self.found.now.leg_vars[min(k, len(self.found.now.leg_vars) - 1)] ** 0.5
            go, spread = walk(length, path.correlation_length, std)
            for axis in range(2):
                row = np.zeros((2, self.width))
                after, before = [4 * k + 4 + axis, 4 * k + 6 + axis], [4 * k + axis, 4 * k + 2 + axis]
                row[:, after], row[:, before] = np.eye(2), -go
                info += row.T @ np.linalg.inv(spread) @ row
        turns = [*(self.states + 6 * t + 5 for t in range(self.tubes)), *range(self.gravity_at + 1, self.width)]
        for t in range(self.tubes):
            at = self.states + 6 * t
            info[range(at, at + 3), range(at, at + 3)] = string.bias_std[t] ** -2
            info[range(at + 3, at + 5), range(at + 3, at + 5)] = string.tilt_std[t] ** -2
        info[self.gravity_at, self.gravity_at] = string.gravity_std**-2
        info[np.ix_(turns, turns)] = np.linalg.inv(string.turn_cov)
        self.turns = turns
        return info

    def functional(self, weights: Array) -> Array:
        """Weights (s + 1, 2, r) of directions as (p, r)."""
        out = np.zeros((self.width, weights.shape[2]))
        for station in range(len(weights)):
            out[4 * station : 4 * station + 2] = weights[station]
        return out

    @property
    def free(self) -> Array:
        """W - W A Q A^T W, (3 n, 3 n)."""
        return np.asarray(self.W - self.W @ self.A @ self.cov @ self.A.T @ self.W)


def walk(length: float, reach: float, std: float, steps: int = 4000) -> tuple[Array, Array]:
    """Transition and covariance of direction and curvature over a length, by the midpoint rule."""

    def go(left: Array) -> Array:
        fades = np.exp(-left / reach)
        return np.array([[np.ones_like(left), reach * (1.0 - fades)], [np.zeros_like(left), fades]])

    middles = (np.arange(steps) + 0.5) * length / steps
    kicked = go(middles)[:, 1]
    spread = 2.0 * std**2 / reach * kicked @ kicked.T * length / steps
    return np.asarray(go(np.array(length))), np.asarray(spread)
