"""The solution of the normal equations of a hole: the factorised chain of its path, and what its stations share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.kernels.observations import mirror_upper
from groundstation.survey.adjustment.kernels.path_elimination import reduce_right, substitute_path
from groundstation.survey.adjustment.kernels.sparse_products import add_rooted

Array = npt.NDArray[np.float64]
KEPT = ("factor", "cov", "root", "variances")  # of equations, whatever stands on their right side


@dataclass(frozen=True)  # with a dictionary, for what is worked out once
class InCommon:
    """Normal equations of what stations have in common, the path taken out.

    Parameters
    ----------
    information : (p, p)
    right : (p,)
    """

    information: Array
    right: Array

    @cached_property
    def factor(self) -> Array:
        """Lower Cholesky factor (p, p) of the information.

        Raises
        ------
        numpy.linalg.LinAlgError
            When the information is none.
        """
        from scipy.linalg import lapack

        # symmetric, so transposed it lies as the library lays out its matrices
        factor, failed = lapack.dpotrf(self.information.T, lower=1, clean=1)
        if failed:
            raise np.linalg.LinAlgError("expected information that is positive definite")
        return np.asarray(factor)

    @cached_property
    def cov(self) -> Array:
        """Covariance (p, p)."""
        from scipy.linalg import lapack

        found = np.asarray(lapack.dpotri(self.factor, lower=1)[0]).T
        mirror_upper(found, len(found))
        return found

    @cached_property
    def root(self) -> Array:
        """Root R (p, p) of the covariance R R^T, upper triangular: of the factor, and not of the covariance."""
        from scipy.linalg import lapack

        return np.asarray(lapack.dtrtri(self.factor, lower=1)[0].T)

    @cached_property
    def variances(self) -> Array:
        """Diagonal (p,) of the covariance, which need not be worked out for it."""
        return np.asarray(np.einsum("pk,pk->p", self.root, self.root))

    @property
    def log_size(self) -> float:
        """Logarithm of the determinant of the covariance."""
        return -2.0 * float(np.sum(np.log(np.diag(self.factor))))

    def times_cov(self, columns: Array) -> Array:
        """Covariance times columns (p, r)."""
        return np.asarray(self.root @ (self.root.T @ columns))

    def times_root(self, rows: Array) -> Array:
        """Rows (r, p) times the root."""
        from scipy.linalg import blas

        return np.asarray(blas.dtrmm(1.0, self.root, rows.T, trans_a=1).T)

    def times_root_transposed(self, rows: Array) -> Array:
        """Rows (r, p) times the transposed root: of rows times the root it is rows times the covariance."""
        from scipy.linalg import blas

        return np.asarray(blas.dtrmm(1.0, self.root, rows.T).T)

    def with_right(self, right: Array) -> InCommon:
        """The same equations with another right side; what was worked out of them is known."""
        made = InCommon(self.information, right)
        made.__dict__.update({name: self.__dict__[name] for name in KEPT if name in self.__dict__})
        return made

    @cached_property
    def step(self) -> Array:
        """Solution (p,)."""
        from scipy.linalg import lapack

        return np.asarray(lapack.dpotrs(self.factor, self.right, lower=1)[0])


@dataclass(frozen=True, slots=True)
class LinearSolution:
    """The factorised chain, what stations have in common, and the step.

    Parameters
    ----------
    diagonal, tied : (s + 1, 4, 4), as ``eliminate_path`` leaves them
    coupled : (s + 1, 4, p), likewise
    in_common : of what stations have in common
    states : (s + 1, 4), step of directions and curvatures
    of_path : by how much the sum of squares is less for a step of these alone
    at_station, whole : (s + 1, 2, 2) and (p, p), information of the looks on each direction, and of looks and what was
        known before on what stations have in common, before the path was taken out
    sparse : (s + 1, 2, p), what couples directions and what is in common, where most of it is zero
    by_common : (s + 1, 4, p), change of every state for one unit of what is in common, where it is known already
    """

    diagonal: Array
    tied: Array
    coupled: Array
    in_common: InCommon
    states: Array
    of_path: float
    at_station: Array
    whole: Array
    sparse: Array | None = None
    by_common: Array | None = None

    @property
    def cov(self) -> Array:
        """Covariance (p, p) of what stations have in common."""
        return self.in_common.cov

    @property
    def common(self) -> Array:
        """Step (p,) of what stations have in common."""
        return self.in_common.step

    def rooted_columns(self, sparse: Array) -> Array:
        """Change of every state (s + 1, 4, p) for one standard deviation of independent errors in common.

        It is -S^-1 (C R) in this order: C R costs what stands in C, and -S^-1 C times R a product of full matrices.

        Parameters
        ----------
        sparse : C
        """
        root = self.in_common.root
        found = np.zeros((len(sparse), self.diagonal.shape[1], len(root)))
        add_rooted(sparse, root, -1.0, found)
        reduce_right(self.diagonal, self.tied, found)
        substitute_path(self.diagonal, self.tied, found)
        return found

    @property
    def step(self) -> float:
        """Largest step of an unknown in its standard deviations, at most as the equations know them; NaN if one is."""
        of_common = np.max(np.abs(self.common) / np.sqrt(self.in_common.variances), initial=0.0)
        rigid = np.einsum("kab,kab->ka", self.diagonal, self.diagonal)  # of what is left of each block
        return float(np.maximum(of_common, np.max(np.abs(self.states) * np.sqrt(rigid))))

    def told_by(self, own_covs: Array, columns: Array, known: Array) -> float:
        """How many numbers the looks tell: the trace of their information times the covariance of all unknowns.

        Of directions and what is in common that is summed station by station; what they have with each other is
        tr(B^T Q) with Q = S^-1 B C, which is what taking out the path has taken from the information in common.

        Parameters
        ----------
        own_covs, columns : (s + 1, 2, 2) and (s + 1, 2, p), covariances of the directions were all else known, and
            their change for one standard deviation of independent errors in common
        known : (p, p), information on what is in common before any look
        """
        of_directions = float(np.sum(self.at_station * (own_covs + columns @ np.swapaxes(columns, 1, 2))))
        return of_directions + 2.0 * len(known) - float(np.sum((self.whole + known) * self.cov))

    @property
    def decrement(self) -> float:
        """Newton's decrement: nothing linear in the unknowns goes by more of its standard deviations in the step.

        It is the root of the decrease of the sum of squares. NaN where the step is. Source: Boyd and Vandenberghe,
        "Convex Optimization", Cambridge (2004), 9.5.1; the bound by Cauchy and Schwarz.
        """
        return math.sqrt(max(self.of_path + float(self.common @ self.in_common.right), 0.0))
