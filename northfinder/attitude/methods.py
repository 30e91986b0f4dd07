"""What each method is called, what it feeds on, and the steps that it makes of its samples."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from northfinder.attitude.arrays import FloatArray, check_name
from northfinder.attitude.extraction import DEGREES, Extraction, extract_increments
from northfinder.attitude.functional import functional_rotation_vectors
from northfinder.attitude.rk4 import rk4_steps
from northfinder.attitude.rotation_vectors import (
    SCHEMES,
    Kind,
    Scheme,
    picard_scheme,
    reversed_in_time,
    rotation_vectors,
    window_columns,
)
from northfinder.attitude.scan import Pair, pair_from_rotation_vectors

#: Every method by name.
METHODS: Final = (*SCHEMES, "rk4", "picard", "functional")
KINDS: Final = ("rates", "increments")
_DEFAULT_BLOCK = 8
_LARGEST_BLOCK = 32  # a polynomial through more equidistant samples would amplify their noise


@dataclass(frozen=True, slots=True)
class Options:
    """What some methods need besides their samples; None where it was not given.

    Attributes:
        extraction: How increments come from rates, for the methods that feed on increments.
        alpha: Of ``picard``, 1 if not given.
        beta: Of ``picard``, -0.5 if not given.
        n: Samples in a block of ``functional``, 8 if not given.
    """

    extraction: Extraction | None = None
    alpha: float | None = None
    beta: float | None = None
    n: int | None = None


@dataclass(frozen=True, slots=True)
class Stepper:
    """A method made ready.

    Attributes:
        stride: Sampling periods in an update.
        window: Samples that the first update looks at.
        steps: Makes the quaternions of updates ``first`` to ``last - 1`` out of all samples.
        scheme: The method's coefficients, where it is linear and bilinear.
        behind: How many of the first updates lack what the scheme looks back at.
        unit: What makes angles of the samples: the sampling period for rates, 1 for increments.
    """

    stride: int
    window: int
    steps: Callable[[FloatArray, int, int], Pair]
    scheme: Scheme | None = None
    behind: int = 0
    unit: float = 1.0

    def updates(self, samples: int) -> int:
        """Whole updates in so many samples."""
        return max(0, (samples - self.window) // self.stride + 1)


def check_method(method: str, kind: str, options: Options) -> None:
    """Refuse what does not go together.

    Raises:
        ValueError: An unknown name, or an option that is missing or that nothing reads.
    """
    check_name("method", method, METHODS)
    check_name("kind", kind, KINDS)
    if options.extraction is not None:
        check_name("extraction", options.extraction, DEGREES)
    for name in ("alpha", "beta"):
        _check_read_by("picard", method, name, getattr(options, name))
    _check_read_by("functional", method, "n", options.n)
    feeds_on = _feeds_on(method)
    if feeds_on == "rates" and kind == "increments":
        msg = f"{method} feeds on rates; for increments choose two-sample, trailing-2 or functional"
        raise ValueError(msg)
    extracts = feeds_on == "increments" and kind == "rates"
    if extracts and options.extraction is None:
        msg = f"{method} feeds on increments: with rates say extraction= {', '.join(DEGREES)}"
        raise ValueError(msg)
    if not extracts and options.extraction is not None:
        msg = f"{method} takes these {kind} as they are; leave extraction out"
        raise ValueError(msg)


def prepare(
    method: str, kind: Kind, samples: FloatArray, dt: float, options: Options
) -> tuple[Stepper, FloatArray]:
    """Return the method made ready, and what it feeds on: the samples, or increments from them.

    Raises:
        ValueError: Too few rates to extract increments from, or a block of a bad size.
    """
    if options.extraction is None:
        return _stepper(method, kind, dt if kind == "rates" else 1.0, options), samples
    increments = extract_increments(samples, dt, options.extraction, SCHEMES[method].stride)
    return _stepper(method, "increments", 1.0, options), increments


def update_periods(method: str, n: int | None = None) -> int:
    """Return how many sampling periods an update of a known method lasts."""
    if method == "functional":
        return _DEFAULT_BLOCK if n is None else n
    return {"rk4": 2, "picard": 1}.get(method) or SCHEMES[method].stride


def _feeds_on(method: str) -> Kind | None:
    """What the method needs; None where it takes either."""
    if method == "functional":
        return None
    return SCHEMES[method].kind if method in SCHEMES else "rates"


def _check_read_by(reader: str, method: str, name: str, value: float | None) -> None:
    if value is not None and method != reader:
        msg = f"{name} is {value!r}, but {method} does not read it; only {reader} does"
        raise ValueError(msg)


def _stepper(method: str, kind: Kind, unit: float, options: Options) -> Stepper:
    if method == "rk4":
        return _rk4(unit)
    if method == "functional":
        return _functional(update_periods(method, options.n), kind, unit)
    if method == "picard":
        return _of_scheme(_picard(options), unit)
    if method.startswith("trailing"):
        return _trailing(int(method.removeprefix("trailing-")))
    return _of_scheme(SCHEMES[method], unit)


def _of_scheme(scheme: Scheme, unit: float) -> Stepper:
    def steps(samples: FloatArray, first: int, last: int) -> Pair:
        columns = window_columns(scheme, samples, unit, first, last)
        return pair_from_rotation_vectors(rotation_vectors(scheme, columns))

    return Stepper(scheme.stride, scheme.window, steps, scheme, unit=unit)


def _picard(options: Options) -> Scheme:
    alpha = 1.0 if options.alpha is None else float(options.alpha)
    beta = -0.5 if options.beta is None else float(options.beta)
    for name, value in (("alpha", alpha), ("beta", beta)):
        if not math.isfinite(value):
            msg = f"{name} is {value:g}; it must be finite"
            raise ValueError(msg)
    return picard_scheme(alpha, beta)


def _rk4(unit: float) -> Stepper:
    reads_like = SCHEMES["rate-vector"]

    def steps(samples: FloatArray, first: int, last: int) -> Pair:
        return rk4_steps(*window_columns(reads_like, samples, unit, first, last))

    return Stepper(reads_like.stride, reads_like.window, steps, unit=unit)


def _functional(n: int, kind: Kind, unit: float) -> Stepper:
    if not (isinstance(n, int) and 1 <= n <= _LARGEST_BLOCK):
        msg = f"n is {n!r}; functional takes 1 to {_LARGEST_BLOCK} samples a block"
        raise ValueError(msg)
    common = int(kind == "rates")  # the rate between two blocks belongs to both

    def steps(samples: FloatArray, first: int, last: int) -> Pair:
        blocks = unit * samples[first * n : last * n + common]
        return pair_from_rotation_vectors(functional_rotation_vectors(blocks, n, kind))

    return Stepper(n, n + common, steps, unit=unit)


def _trailing(terms: int) -> Stepper:
    """Return the method that corrects each increment by those before it.

    The first ones have none, or too few, behind them: they look ahead instead.
    """
    scheme = SCHEMES[f"trailing-{terms}"]

    def steps(samples: FloatArray, first: int, last: int) -> Pair:
        parts = [_early(samples, k, terms) for k in range(first, min(terms, last))]
        begin = max(first, terms)
        if begin < last:
            columns = window_columns(scheme, samples, 1.0, begin - terms, last - terms)
            parts.append(rotation_vectors(scheme, columns))
        return pair_from_rotation_vectors(np.concatenate(parts, axis=1))

    return Stepper(1, 1, steps, scheme, behind=terms)


def _early(samples: FloatArray, k: int, terms: int) -> FloatArray:
    """Return the rotation vector of update k, ``(3, 1)``, from the longer of its two sides."""
    ahead = min(terms, len(samples) - 1 - k)
    if ahead == 0 and k == 0:
        return samples[:1].T.copy()
    scheme = SCHEMES[f"trailing-{max(ahead, k)}"]
    if ahead > k:
        scheme, samples = reversed_in_time(scheme), samples[k:]
    return rotation_vectors(scheme, window_columns(scheme, samples, 1.0, 0, 1))
