"""One hole solved densely: every unknown by itself, yaw errors and play of every look among them.

It shares with the product nothing but what a look and a prior are. Directions are turned by scipy's rotations, the
process of the path is integrated by the exponential of a matrix, and the optimum is that of scipy's least squares.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from hole_world import DOWN, frames_along, small_rotation
from scipy.linalg import block_diag, cho_factor, cho_solve, expm
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from groundstation.survey.adjustment.looks import Looks, PathPrior, StartingPoint, StringPrior

Array = npt.NDArray[np.float64]
STEP = 1e-6  # of a derivative; of every unknown in rad, m/s^2 or rad/m


def process_noise(length: float, forgotten_over: float) -> tuple[Array, Array]:
    """Transition and noise (2, 2) of direction and curvature of one axis over a leg, of a curvature of variance 1.

    Source: Van Loan, IEEE Trans. Autom. Control 23 (1978).
    """
    drift = np.array([[0.0, 1.0], [0.0, -1.0 / forgotten_over]])
    spread = np.array([[0.0, 0.0], [0.0, 2.0 / forgotten_over]])
    both = expm(length * np.block([[-drift, spread], [np.zeros((2, 2)), drift.T]]))
    transition = both[2:, 2:].T
    return transition, transition @ both[:2, 2:]


@dataclass(frozen=True)
class DenseHole:
    """The problem.

    Parameters
    ----------
    looks, string, path : as the product takes them
    play_var : rad^2
    curvature_var, leg_vars : rad^2/m^2, of the curvature at the collar, and (s,) by which each leg is driven
    about : (s + 1, 3), directions that unknown directions are counted from
    """

    looks: Looks
    string: StringPrior
    path: PathPrior
    play_var: float
    curvature_var: float
    leg_vars: Array
    about: Array

    @cached_property
    def places(self) -> dict[str, slice]:
        """Where unknowns stand."""
        count, tubes, stations = len(self.looks), self.string.count, len(self.about)
        widths = {"direction": 2 * stations, "curvature": 2 * stations, "tube": 6 * tubes, "gravity": 1}
        widths |= {"make_up": len(self.string.turn) - tubes, "yaw": count, "play": 2 * count}
        ends = np.cumsum(list(widths.values()))
        return {
            name: slice(int(end) - width, int(end)) for (name, width), end in zip(widths.items(), ends, strict=True)
        }

    @cached_property
    def frames(self) -> Array:
        """North and east (s + 1, 2, 3), turned into the planes across ``about``."""
        frame = frames_along(self.about)
        return np.stack([frame.apply([1.0, 0.0, 0.0]), frame.apply([0.0, 1.0, 0.0])], axis=1)

    @property
    def size(self) -> int:
        return self.places["play"].stop

    def directions(self, x: Array) -> Array:
        """Directions (b, s + 1, 3) of unknowns (b, u)."""
        v = x[:, self.places["direction"]].reshape(len(x), -1, 2)
        angle = np.linalg.norm(v, axis=2)[:, :, None]
        across = np.einsum("bja,jai->bji", v, self.frames)
        return np.cos(angle) * self.about + np.sinc(angle / np.pi) * across

    def of_looks(self, x: Array) -> Array:
        """Residuals (b, n, 3) of the looks in their standard deviations."""
        looks, batch, count = self.looks, len(x), len(self.looks)
        d = self.directions(x)[:, looks.station].reshape(-1, 3)
        tubes = x[:, self.places["tube"]].reshape(batch, -1, 6)[:, looks.tube].reshape(-1, 6)
        gravity = np.repeat(x[:, self.places["gravity"]], count, axis=0)
        made = x[:, self.places["make_up"]][:, looks.make_up].reshape(-1, 1)
        error = x[:, self.places["yaw"]].reshape(-1, 1) + made
        play = x[:, self.places["play"]].reshape(-1, 2)
        yaw = np.tile(looks.yaw, batch)[:, None] - tubes[:, 5:] - error
        upright = (frames_along(d) * Rotation.from_rotvec(yaw * DOWN)).inv().apply(-DOWN) * gravity
        force = small_rotation(tubes[:, 3:5]).apply(small_rotation(play).apply(upright)) + tubes[:, :3]
        read = np.tile(looks.force, (batch, 1))
        noise = np.tile(looks.force_var, batch)
        residuals = (read - force) / np.sqrt(noise)[:, None]
        return residuals.reshape(batch, count, 3)

    def of_path(self, x: Array) -> Array:
        """Residuals (b, 4 s + 4) of collar and legs in their standard deviations."""
        batch, d = len(x), self.directions(x)
        curved = x[:, self.places["curvature"]].reshape(batch, -1, 2)
        frame = rotation_between(np.broadcast_to(self.about[0], d[:, 0].shape), d[:, 0]) * frames_along(self.about[:1])
        rows = [self._of_collar(d[:, 0], frame), curved[:, 0] / np.sqrt(self.curvature_var)]
        for k, (transition, root) in enumerate(self._legs):
            bend = rotation_between(d[:, k], d[:, k + 1])
            vector = frame.inv().apply(bend.as_rotvec())
            toward = np.stack([vector[:, 1], -vector[:, 0]], axis=1)  # a turn about y bends towards x
            off = np.stack(
                [toward - transition[0, 1] * curved[:, k], curved[:, k + 1] - transition[1, 1] * curved[:, k]], axis=1
            )
            rows.append(np.einsum("ij,bja->bia", root, off).reshape(batch, 4))
            frame = bend * frame
        return np.concatenate(rows, axis=1)

    @cached_property
    def _legs(self) -> list[tuple[Array, Array]]:
        found = []
        for leg, var in zip(np.diff(self.path.md).tolist(), self.leg_vars.tolist(), strict=True):
            transition, noise = process_noise(leg, self.path.correlation_length)
            root = np.linalg.inv(np.linalg.cholesky(var * noise))
            found.append((transition, root))
        return found

    def _of_collar(self, d: Array, frame: Rotation) -> Array:
        across = np.stack([frame.apply([1.0, 0.0, 0.0]), frame.apply([0.0, 1.0, 0.0])], axis=1)
        turn = rotation_between(d, np.broadcast_to(self.path.collar, d.shape)).as_rotvec()
        off = np.einsum("bai,bi->ba", across, np.cross(turn, d))
        cov = np.einsum("bai,ij,bcj->bac", across, self.path.collar_cov, across)
        return np.einsum("bij,bj->bi", np.linalg.inv(np.linalg.cholesky(cov)), off)

    @cached_property
    def _known(self) -> tuple[Array, Array]:
        """Matrix and right side of what is linear: priors of tubes, gravity, yaw errors and play."""
        string, looks = self.string, self.looks
        stds = np.concatenate(
            [np.repeat(string.bias_std[:, None], 3, axis=1), np.repeat(string.tilt_std[:, None], 2, axis=1)], axis=1
        )
        count = string.count
        spread = np.linalg.inv(np.linalg.cholesky(string.turn_cov))
        size = 6 * count + 1 + len(string.turn) - count
        known, told = np.zeros((size, size)), np.zeros(size)
        steady = np.arange(6 * count).reshape(-1, 6)[:, :5].ravel()
        known[steady, steady] = 1.0 / stds.ravel()
        known[6 * count, 6 * count], told[6 * count] = 1.0 / string.gravity_std, string.gravity
        turns = np.concatenate([np.arange(count) * 6 + 5, np.arange(6 * count + 1, size)])
        known[np.ix_(turns, turns)], told[turns] = spread, string.turn
        yaw = np.diag(1.0 / np.sqrt(looks.yaw_var))
        play = np.eye(2 * len(looks)) / np.sqrt(self.play_var)
        matrix = block_diag(known, yaw, play)
        right = np.concatenate([known @ told, np.zeros(3 * len(looks))])
        whole = np.zeros((len(matrix), self.size))
        whole[:, self.places["tube"].start :] = matrix
        return whole, right

    def residuals(self, x: Array) -> Array:
        """All residuals."""
        matrix, right = self._known
        batch = x[None]
        return np.concatenate([self.of_looks(batch).ravel(), self.of_path(batch).ravel(), matrix @ x - right])

    def jacobian(self, x: Array) -> Array:
        """Derivative of the residuals by differences; an error of one look, or of one tube, changes no other."""
        groups = self._groups
        moved = np.stack([x, *(x + STEP * group for group in groups)])
        of_looks, of_path = self.of_looks(moved), self.of_path(moved)
        slopes = [(part[1:] - part[0]) / STEP for part in (of_looks, of_path)]
        count = len(self.looks)
        out = np.zeros((3 * count + of_path.shape[1], self.size))
        for group, look, path in zip(groups, *slopes, strict=True):
            columns = np.flatnonzero(group)
            if len(columns) == 1:
                out[:, columns[0]] = np.concatenate([look.ravel(), path])
                continue
            own = columns[self.looks.tube] if columns[0] < self.places["gravity"].start else columns
            for k in range(count):
                out[3 * k : 3 * k + 3, own[k]] = look[k]
        return np.concatenate([out, self._known[0]])

    @cached_property
    def _groups(self) -> list[Array]:
        """Unknowns that change together: none of them changes a residual that another one changes."""
        single = [*range(self.places["curvature"].stop), *range(self.places["gravity"].start, self.places["yaw"].start)]
        groups = [np.eye(self.size)[place] for place in single]
        for name, width in (("tube", 6), ("yaw", 1), ("play", 2)):
            for first in range(width):
                group = np.zeros(self.size)
                group[self.places[name]][first::width] = 1.0
                groups.append(group)
        return groups

    def solve(self, start: StartingPoint) -> DenseSolution:
        """Solve, from the directions that unknown ones are counted from and tubes as they are given."""
        x = self._begin(start, np.zeros(self.size))
        x[self.places["curvature"]] = 0.0
        x[self.places["yaw"]] = self._yaw_errors(start)
        found = least_squares(
            self.residuals, x, self.jacobian, x_scale="jac", ftol=1e-14, xtol=1e-14, gtol=1e-12, max_nfev=200
        )
        return DenseSolution(self, found.x, self.covariance(found.x), found.fun, self.directions(found.x[None])[0])

    def covariance(self, x: Array) -> Array:
        """Inverse of the information (u, u) where the unknowns stand."""
        slope = self.jacobian(x)
        scale = 1.0 / np.linalg.norm(slope, axis=0)
        information = (slope * scale).T @ (slope * scale)
        return cho_solve(cho_factor(information), np.eye(self.size)) * np.outer(scale, scale)

    def at(self, solution: DenseSolution, start: StartingPoint) -> DenseSolution:
        """What a solution says of looks, where all else stands as given and directions where they are counted from."""
        x = self._begin(start, solution.x.copy())
        return DenseSolution(self, x, self.covariance(x), self.residuals(x), self.directions(x[None])[0])

    def _begin(self, start: StartingPoint, x: Array) -> Array:
        x[self.places["direction"]] = 0.0
        x[self.places["curvature"]] = start.curvatures.ravel()
        x[self.places["tube"]], x[self.places["gravity"]] = start.tubes.ravel(), start.gravity
        x[self.places["make_up"]] = start.make_ups
        return x

    def _yaw_errors(self, start: StartingPoint) -> Array:
        """Yaw errors (n,) that turn the leans to where they were measured, as far as each may be wrong."""
        looks, tubes, d = self.looks, start.tubes, self.about[self.looks.station]
        psi = looks.yaw - tubes[looks.tube, 5] - start.make_ups[looks.make_up]
        lean = (looks.force[:, 0] - tubes[looks.tube, 0]) + 1j * (looks.force[:, 1] - tubes[looks.tube, 1])
        turned = np.angle(lean * np.exp(1j * psi) * (d[:, 0] - 1j * d[:, 1]))
        stiff = looks.yaw_var * np.abs(lean) ** 2 / (looks.force_var + self.string.gravity**2 * self.play_var)
        return turned * stiff / (1.0 + stiff)


@dataclass(frozen=True)
class DenseSolution:
    """Unknowns (u,), covariance (u, u), all residuals in their standard deviations and directions (s + 1, 3)."""

    problem: DenseHole
    x: Array
    cov: Array
    left: Array
    tangents: Array

    def part(self, name: str) -> Array:
        return self.x[self.problem.places[name]]

    def cov_of(self, name: str, other: str | None = None) -> Array:
        return self.cov[self.problem.places[name], self.problem.places[other or name]]

    @cached_property
    def across(self) -> Array:
        """Change (s + 1, 3, 2) of directions with their unknowns."""
        base, out = self.problem.directions(self.x[None])[0], []
        for place in range(2):
            moved = self.x.copy()
            moved[self.problem.places["direction"]][place::2] += STEP
            out.append((self.problem.directions(moved[None])[0] - base) / STEP)
        return np.stack(out, axis=2)


def rotation_between(first: Array, second: Array) -> Rotation:
    """Rotations along great circles from directions (b, 3) to others."""
    axis = np.cross(first, second)
    size = np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.arctan2(size[:, 0], np.einsum("bi,bi->b", first, second))
    return Rotation.from_rotvec(np.where(size > 1e-14, axis / np.maximum(size, 1e-14), 0.0) * angle[:, None])
