"""What is counted of a campaign: sums that add up, chunk by chunk."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import betaincinv, ndtr, stdtr

from northfinder.campaign.chunks import Columns, run_chunk
from northfinder.campaign.settings import Campaign
from northfinder.estimators.arrays import FloatArray
from northfinder.units import DEG

WRONG_SIGMAS = 4.0  # a result is wrong when it misses the truth by more than so many stated sigma
BAND = 0.99  # confidence of a row's band: ten rows shall not cry wolf in every other campaign
_TILT_CLASSES, _QUADRANTS = 4, 4
#: Of the histogram of error over sigma; what is beyond counts in the outermost.
EDGES: FloatArray = np.linspace(-5.0, 5.0, 41)

Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Share:
    """Seeks of one class.

    Attributes:
        name: Which class: all of them, or those of a range of tilt or azimuth.
        seeks: Of them.
        covered: Of these, those whose stated 95 % interval holds the truth.
        wrong: Those that miss it by more than four stated sigma.
        by_chance: How many of them a true sigma would give, by Student's t.
        scatter_deg: Root of the mean squared error.
        over_sigma: That over the root of the mean squared stated sigma.
        over_bound: That over the root of the mean squared Cramer-Rao bound.
    """

    name: str
    seeks: int
    covered: int
    wrong: int
    by_chance: float
    scatter_deg: float
    over_sigma: float
    over_bound: float

    @property
    def coverage(self) -> float:
        """Return the share that is covered."""
        return self.covered / self.seeks

    @property
    def band(self) -> tuple[float, float]:
        """Return the 99 % interval of the true coverage (Clopper and Pearson 1934)."""
        missed, tail = self.seeks - self.covered, (1.0 - BAND) / 2.0
        low = betaincinv(self.covered, missed + 1, tail) if self.covered else 0.0
        high = betaincinv(self.covered + 1, missed, 1.0 - tail) if missed else 1.0
        return float(low), float(high)


@dataclass(frozen=True, eq=False)
class Tally:
    """Counts and sums by class; equal campaigns' tallies add up.

    Attributes:
        names: Of the classes; the first is all of them.
        counts: Seeks, covered ones, wrong ones, ``(classes, 3)``.
        sums: Of the squared error, stated sigma and bound, deg^2, and of one over the degrees of
            freedom, ``(classes, 4)``.
        histogram: Of error over sigma between :data:`EDGES`.
    """

    names: tuple[str, ...]
    counts: Counts
    sums: FloatArray
    histogram: Counts

    @classmethod
    def none(cls, campaign: Campaign) -> Self:
        """Return the tally of no seek."""
        names = ("all", *_tilt_names(campaign), *_azimuth_names(campaign))
        counts = np.zeros((len(names), 3), dtype=np.int64)
        histogram = np.zeros(len(EDGES) - 1, dtype=np.int64)
        return cls(names, counts, np.zeros((len(names), 4)), histogram)

    @classmethod
    def of(cls, campaign: Campaign, columns: Columns) -> Self:
        """Count some seeks of a campaign."""
        z = columns["error_deg"] / columns["azimuth_sigma_deg"]
        counted = np.stack([np.ones_like(z), covered(columns), np.abs(z) > WRONG_SIGMAS])
        squared = [columns[name] ** 2 for name in ("error_deg", "azimuth_sigma_deg", "bound_deg")]
        summed = np.stack([*squared, 1.0 / columns["dof"]])
        empty = cls.none(campaign)
        counts, sums = (_by_class(campaign, columns, values) for values in (counted, summed))
        histogram, _ = np.histogram(np.clip(z, EDGES[0], EDGES[-1]), EDGES)
        return cls(empty.names, counts.astype(np.int64), sums, histogram.astype(np.int64))

    def __add__(self, other: Self) -> Self:
        return type(self)(
            self.names,
            self.counts + other.counts,
            self.sums + other.sums,
            self.histogram + other.histogram,
        )

    @cached_property
    def shares(self) -> tuple[Share, ...]:
        """Return each class that has seeks."""
        return tuple(
            _share(name, counts, sums)
            for name, counts, sums in zip(self.names, self.counts, self.sums, strict=True)
            if counts[0]
        )


def count_chunk(campaign: Campaign, chunk: int) -> Tally:
    """Compute a chunk and keep only the counts: what a campaign that is not kept sends around."""
    return Tally.of(campaign, run_chunk(campaign, chunk))


def _share(name: str, counts: Counts, sums: FloatArray) -> Share:
    seeks, inside, wrong = (int(count) for count in counts)
    scatter_deg, sigma_deg, bound_deg = (float(root) for root in np.sqrt(sums[:3] / seeks))
    ratios = scatter_deg / sigma_deg, scatter_deg / bound_deg
    return Share(name, seeks, inside, wrong, seeks * _beyond(sums[3] / seeks), scatter_deg, *ratios)


def _beyond(one_over_dof: float) -> float:
    """Return how likely Student's t lies beyond four sigma on either side; normal at 0."""
    tail = ndtr(-WRONG_SIGMAS) if one_over_dof == 0.0 else stdtr(1.0 / one_over_dof, -WRONG_SIGMAS)
    return 2.0 * float(tail)


def covered(columns: Columns) -> NDArray[np.bool_]:
    """Say of each seek whether the stated interval holds the true azimuth."""
    inside: NDArray[np.bool_] = np.abs(columns["error_deg"]) <= columns["interval95_half_width_deg"]
    return inside


def _by_class(campaign: Campaign, columns: Columns, values: FloatArray) -> FloatArray:
    """Sum values ``(m, k)`` over all seeks and over each class, ``(classes, m)``."""
    rows = [values.sum(axis=1, keepdims=True)]
    for number, classes in _memberships(campaign, columns):
        rows.append(np.stack([np.bincount(number, row, classes) for row in values]))
    return np.concatenate(rows, axis=1).T


def _memberships(campaign: Campaign, columns: Columns) -> list[tuple[NDArray[np.intp], int]]:
    """Number the classes of each seek: of its tilt, of its azimuth."""
    found = []
    if campaign.tilt_deg:
        pitch_rad, roll_rad = columns["true_pitch_deg"] * DEG, columns["true_roll_deg"] * DEG
        tilt_deg = np.arccos(np.cos(pitch_rad) * np.cos(roll_rad)) / DEG
        found.append((_class_of(tilt_deg, campaign.tilt_deg, _TILT_CLASSES), _TILT_CLASSES))
    if campaign.azimuth_deg == "uniform":
        found.append((_class_of(columns["true_azimuth_deg"], 360.0, _QUADRANTS), _QUADRANTS))
    return found


def _class_of(value: FloatArray, whole: float, classes: int) -> NDArray[np.intp]:
    return np.minimum((value / whole * classes).astype(np.intp), classes - 1)


def _tilt_names(campaign: Campaign) -> list[str]:
    return _ranges("tilt", campaign.tilt_deg, _TILT_CLASSES) if campaign.tilt_deg else []


def _azimuth_names(campaign: Campaign) -> list[str]:
    return _ranges("azimuth", 360.0, _QUADRANTS) if campaign.azimuth_deg == "uniform" else []


def _ranges(what: str, whole: float, classes: int) -> list[str]:
    ends = [f"{whole * index / classes:g}" for index in range(classes + 1)]
    return [f"{what} {low}-{high} deg" for low, high in pairwise(ends)]
