"""Visits that do not belong: found by what leaving them out does to the rest.

A visit that somebody disturbed is a shift of its reading alone. Leaving it out is the same as
fitting that shift (Cook and Weisberg 1982, 2.2.2), whatever the noise's covariance; whether it
belongs is Fisher's F of that parameter. An angle at which something touches the table shifts all
of its visits, and is tried as one.

Several outliers hide one another in a least-squares fit. So the search begins from a fit that
does not feel them (Tukey's bisquare) and then takes back, one by one, what belongs after all.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtri

from northfinder.estimators.arrays import BoolArray, FloatArray, IntArray
from northfinder.estimators.design import HarmonicDesign, distinct_angles
from northfinder.estimators.mean_shifts import MeanShifts

#: Of a run without outliers: that it loses a visit by chance.
FALSE_ALARM = 1e-3
_MOST_SHARE = 0.1  # more do not belong only where something is wrong with the whole
_LEAST_DOF = 3  # fewer readings to spare cannot tell which of them is wrong
_WORTH_A_LOOK = 2.0  # times the false alarm: no single outlier escapes it
_FAR = 4.5  # robust sigmas: several may hide one another, but not from the median
_STRANGE = 3.0  # robust sigmas from the bisquare fit: may not belong
_BISQUARE = 4.685  # 95 % efficient under normal noise (Holland and Welsch 1977)
_TO_SIGMA = 1.4826  # median absolute deviation of normal noise
_TURNS = 50  # of the reweighting at most; it takes about ten
_CONVERGED = 1e-3  # of a weight


@dataclass(frozen=True, slots=True, eq=False)
class Outliers:
    """What does not belong.

    Attributes:
        index: The readings to leave out, ascending.
        times: By how much each is off, over the scatter of the others.
        limit: What the largest ``times`` of readings that belong may be.
        strange: How many did not seem to belong; more than are left out where those would be
            more than a tenth of all: then none is.
    """

    index: tuple[int, ...]
    times: FloatArray
    limit: float
    strange: int


class OutlierSearch:
    """Searches any number of rows of readings at the same angles and times.

    Args:
        design: Of the fit with all readings.
    """

    def __init__(self, design: HarmonicDesign) -> None:
        self._design = design
        self._most = max(1, int(_MOST_SHARE * len(design.angle_rad)))
        self._groups = _candidates(distinct_angles(design.angle_rad))
        self._count = sum(map(len, self._groups))

    @property
    def possible(self) -> bool:
        """Whether there are readings to spare."""
        return self._design.dof >= _LEAST_DOF

    @property
    def limit(self) -> float:
        """How many times the scatter of the others a reading that belongs may be off."""
        return float(np.sqrt(self._limit(FALSE_ALARM, 1, 0))) if self.possible else np.inf

    def suspicious(self, readings: ArrayLike) -> BoolArray:
        """Return which rows ``(..., n)`` are worth a search: cheap, one in six by chance."""
        rows = np.asarray(readings, dtype=np.float64)
        shifts = MeanShifts.beside(self._design, rows)
        left = np.abs(rows - rows @ self._design.gain.T @ self._design.matrix.T)
        left /= np.sqrt(self._design.variance)
        beyond = np.asarray(left.max(axis=-1) > _FAR * _TO_SIGMA * np.median(left, axis=-1))
        for groups in self._groups:
            size = groups.shape[1]
            f = self._f(shifts.gain(groups).max(axis=-1), shifts.chi2, size, 0)
            beyond = beyond | (f > self._limit(_WORTH_A_LOOK * FALSE_ALARM, size, 0))
        return beyond

    def find(self, reading: ArrayLike) -> Outliers:
        """Return what does not belong to one row, ``(n,)``."""
        row = np.asarray(reading, dtype=np.float64)
        if not (self.possible and self.suspicious(row)):
            return self._none(strange=0)
        shifts = MeanShifts.beside(self._design, row)
        out = self._reduced(shifts, _strange(self._design, row)[: self._design.dof - 2])
        out = self._extended(shifts, out)
        if len(out) > self._most:
            return self._none(strange=len(out))
        return Outliers(tuple(out), self._times(shifts, out), self.limit, len(out))

    def _none(self, strange: int) -> Outliers:
        return Outliers((), np.empty(0), self.limit, strange)

    def _times(self, shifts: MeanShifts, out: list[int]) -> FloatArray:
        """Return how many times the scatter of the others each is off."""
        shift, variance, rest = shifts.fitted(out)
        times: FloatArray = shift / np.sqrt(variance * rest / (self._design.dof - len(out)))
        return times

    def _reduced(self, shifts: MeanShifts, out: list[int]) -> list[int]:
        """Take back, the least strange first, what belongs."""
        while out:
            times = np.abs(self._times(shifts, out))
            least = int(np.argmin(times))
            if times[least] ** 2 > self._limit(FALSE_ALARM, 1, len(out) - 1):
                break
            out = out[:least] + out[least + 1 :]
        return sorted(out)

    def _extended(self, shifts: MeanShifts, out: list[int]) -> list[int]:
        """Leave out further readings, or all at one angle, until the rest belongs together."""
        while len(out) <= self._most and self._design.dof - len(out) >= _LEAST_DOF:
            rest = shifts.swept(out)
            found = [self._worst(rest, groups, len(out)) for groups in self._groups]
            excess, members = max(found, key=lambda each: each[0])
            if excess <= 1.0:
                break
            out = sorted({*out, *members})
        return out

    def _worst(self, shifts: MeanShifts, groups: IntArray, out: int) -> tuple[float, list[int]]:
        """Return the F of the group that belongs least over its limit, and the group."""
        gain, size = shifts.gain(groups), groups.shape[1]
        worst = int(np.argmax(gain))
        f = float(self._f(gain[worst], shifts.chi2, size, out))
        return f / self._limit(FALSE_ALARM, size, out), groups[worst].tolist()

    def _f(self, gain: FloatArray, chi2: FloatArray, size: int, out: int) -> FloatArray:
        """Return Fisher's F of a group: what it explains over what is left."""
        left = np.maximum(chi2 - gain, 0.0) / max(self._design.dof - out - size, 1)
        f: FloatArray = np.divide(gain / size, left, out=np.zeros_like(gain), where=left > 0.0)
        return f

    def _limit(self, probability: float, size: int, out: int) -> float:
        """Return the F that the largest of all candidates exceeds so rarely by chance."""
        dof = self._design.dof - out - size
        return float(fdtri(size, dof, 1.0 - probability / self._count)) if dof > 0 else np.inf


def _candidates(angle: IntArray) -> list[IntArray]:
    """Return what may be shifted together, by size: each reading, and each angle's, ``(m, g)``."""
    members = [np.flatnonzero(angle == number) for number in range(int(angle.max()) + 1)]
    by_size: dict[int, list[IntArray]] = {1: [np.array([i]) for i in range(len(angle))]}
    for group in members:
        if len(group) > 1:
            by_size.setdefault(len(group), []).append(group)
    return [np.stack(groups) for groups in by_size.values()]


def _strange(design: HarmonicDesign, row: FloatArray) -> list[int]:
    """Return the readings far from a fit that does not feel them, the farthest first."""
    sigma = np.sqrt(design.variance)
    length = np.linalg.norm(design.matrix, axis=0)
    model, target = design.matrix / length / sigma[:, np.newaxis], row / sigma
    weight = np.ones_like(target)
    left = _left(model, target, weight)
    for _ in range(_TURNS):
        reach = _BISQUARE * _TO_SIGMA * float(np.median(left)) or 1.0
        before, weight = weight, np.maximum(1.0 - (left / reach) ** 2, 0.0) ** 2
        left = _left(model, target, weight)
        if float(np.abs(weight - before).max()) < _CONVERGED:
            break
    limit = _STRANGE * _TO_SIGMA * float(np.median(left))
    return [int(i) for i in np.argsort(-left) if left[i] > limit]


def _left(model: FloatArray, target: FloatArray, weight: FloatArray) -> FloatArray:
    root = np.sqrt(weight)[:, np.newaxis]
    solution = np.linalg.lstsq(model * root, target * root[:, 0], rcond=None)[0]
    left: FloatArray = np.abs(target - model @ solution)
    return left
