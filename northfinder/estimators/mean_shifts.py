"""Shifts of single readings beside a harmonic fit: how they would pull, and what each explains.

Everything follows from three things: the product of any two readings' shifts (``gram`` less what
the model imitates), how the residuals pull at each, and their square. Independent readings make
the gram matrix a unit one, so that nothing of size n x n is formed for them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from northfinder.estimators.arrays import FloatArray, IntArray
from northfinder.estimators.design import HarmonicDesign

_NOTHING = 1e-9  # of a reading's own variance is free: it determines a parameter alone
_ROUNDING = 1e-7  # of readings that are perfect: what is left of them is no noise


@dataclass(frozen=True, slots=True, eq=False)
class MeanShifts:
    """The shift of each of n readings by its own sigma, beside a model and shifts fitted already.

    Attributes:
        gram: Products of the shifts, whitened and of unit length, ``(n, n)``; None: unit matrix.
        along: The shifts along what is fitted, ``(n, m)``.
        pull: Product of each shift with the residuals, ``(..., n)``.
        chi2: Square of the residuals, ``(...)``.
    """

    gram: FloatArray | None
    along: FloatArray
    pull: FloatArray
    chi2: FloatArray

    @classmethod
    def beside(cls, design: HarmonicDesign, readings: FloatArray) -> "MeanShifts":
        """Prepare for readings ``(..., n)`` beside the design's own model."""
        whitened = design.whiten(readings)
        free = design.free(whitened)
        rounding = (_ROUNDING * np.linalg.norm(whitened, axis=-1)) ** 2
        chi2 = np.sum(free**2, axis=-1) + rounding
        if design.covariance is None:
            return cls(None, design.basis, free, chi2)
        shifts = design.whiten(np.eye(len(design.angle_rad)))
        shifts /= np.linalg.norm(shifts, axis=1)[:, np.newaxis]
        return cls(shifts @ shifts.T, shifts @ design.basis, free @ shifts.T, chi2)

    def gain(self, groups: IntArray) -> FloatArray:
        """Return by how much each group ``(m, g)`` of shifts lowers chi-square, ``(..., m)``."""
        inverse = self._inverse(groups)
        pulls = self.pull[..., groups]
        gain: FloatArray = np.einsum("...mi,mij,...mj->...m", pulls, inverse, pulls)
        return gain

    def fitted(self, shifts: Sequence[int]) -> tuple[FloatArray, FloatArray, float]:
        """Return some shifts of one row as fitted, their unit variances, and what is left."""
        index = np.array(shifts, dtype=np.int64)
        inverse, pull = self._inverse(index), self.pull[index]
        return inverse @ pull, np.diag(inverse), max(float(self.chi2 - pull @ inverse @ pull), 0.0)

    def swept(self, shifts: Sequence[int]) -> "MeanShifts":
        """Fit some shifts of one row, and return the others beside them."""
        if not shifts:
            return self
        index = np.array(shifts, dtype=np.int64)
        value, vector = np.linalg.eigh(self._products(index))
        root = np.divide(
            1.0, np.sqrt(np.abs(value)), out=np.zeros_like(value), where=value > _NOTHING
        )
        across = -self.along @ self.along[index].T
        across += np.eye(len(across))[:, index] if self.gram is None else self.gram[:, index]
        columns = across @ vector * root
        explained = self.pull[index] @ vector * root
        rest = np.maximum(self.chi2 - explained @ explained, 0.0)
        along = np.concatenate([self.along, columns], axis=1)
        return MeanShifts(self.gram, along, self.pull - columns @ explained, rest)

    def _products(self, groups: IntArray) -> FloatArray:
        """Return the products within each group ``(..., g)``, ``(..., g, g)``."""
        along = self.along[groups]
        size = groups.shape[-1]
        if self.gram is None:
            whole = np.eye(size)
        else:
            whole = self.gram[groups[..., :, np.newaxis], groups[..., np.newaxis, :]]
        products: FloatArray = whole - along @ along.swapaxes(-1, -2)
        return products

    def _inverse(self, groups: IntArray) -> FloatArray:
        """Invert them; a reading that determines a parameter alone has no shift."""
        value, vector = np.linalg.eigh(self._products(groups))
        inverted = np.divide(1.0, value, out=np.zeros_like(value), where=value > _NOTHING)
        inverse: FloatArray = vector * inverted[..., np.newaxis, :] @ vector.swapaxes(-1, -2)
        return inverse
