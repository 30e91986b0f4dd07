"""Attitude from gyro samples, by any of the methods."""

import numpy as np
from numpy.typing import ArrayLike

from northfinder.attitude.arrays import FloatArray, as_period, as_samples, as_unit_quaternion
from northfinder.attitude.extraction import Extraction
from northfinder.attitude.methods import Options, Stepper, check_method, prepare
from northfinder.attitude.rotation_vectors import Kind
from northfinder.attitude.scan import cumulative_product

_CHUNK_SAMPLES = 1 << 15  # a chunk and all that is made of it stay in cache


def integrate(  # noqa: PLR0913 (the published signature)
    samples: ArrayLike,
    dt: float,
    method: str = "rate-vector-optimal",
    q0: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    kind: Kind = "rates",
    *,
    extraction: Extraction | None = None,
    alpha: float | None = None,
    beta: float | None = None,
    n: int | None = None,
) -> FloatArray:
    """Integrate ``qdot = 1/2 q (x) [0, omega_b]``: ``q_(k+1) = q_k (x) exp(Phi / 2)``.

    Feeding on rates: ``rate-vector-taylor``, ``rate-vector`` and ``rate-vector-optimal``
    (`coning-rate-vector` eqs 16 and 17, and (1/120, 3/40)), ``rk4`` (`coning-rk4` eq 4), over two
    sampling periods each; ``picard`` over one, `rate-correction` eq 12: the rate
    ``alpha w(t) + beta (w(t) - w(t-1))`` at the end of each period.

    Feeding on increments: ``one-sample`` to ``four-sample``, the last two also as ``-taylor``
    (`coning-rate-vector` eqs 5 and 6), over as many periods as samples; ``trailing-1`` to
    ``trailing-4`` over one, corrected by the increments before it (the first few by those after).

    Feeding on either: ``functional``, over n periods, by the polynomial through their samples.

    Args:
        samples: Body rates in rad/s at 0, dt, 2 dt, ..., or angle increments in rad over
            (0, dt), (dt, 2 dt), ...; ``(k, 3)``. Those that fill no update are left over.
        dt: Sampling period, s.
        method: One of the above.
        q0: Attitude at the beginning, a unit quaternion.
        kind: What the samples are.
        extraction: How increments come from rates, where the method feeds on increments.
        alpha: Of ``picard``, 1 by default.
        beta: Of ``picard``, -0.5 by default: the trapezoid, right for rates taken at the end.
        n: Of ``functional``, 8 by default.

    Returns:
        Attitude at the end of each whole update, ``(m, 4)``, scalar first, body to reference.

    Raises:
        ValueError: Samples of another shape, not finite or too few for one update; a q0 that is
            no unit quaternion; an unknown name; an option missing or not read by the method.
    """
    options = Options(extraction, alpha, beta, n)
    check_method(method, kind, options)
    array, first = as_samples(samples), as_unit_quaternion(q0)
    stepper, fed = prepare(method, kind, array, as_period(dt), options)
    updates = count_updates(stepper, method, kind, len(array), len(fed))
    return integrate_updates(stepper, fed, updates, first)


def count_updates(stepper: Stepper, method: str, kind: Kind, given: int, prepared: int) -> int:
    """Return the number of whole updates.

    Raises:
        ValueError: There is none.
    """
    updates = stepper.updates(prepared)
    if updates == 0:
        needed = stepper.window + given - prepared
        msg = f"{method} needs at least {needed} {kind} for one update; got {given}"
        raise ValueError(msg)
    return updates


def integrate_updates(
    stepper: Stepper, fed: FloatArray, updates: int, first: FloatArray
) -> FloatArray:
    """Return the attitude after each of the first ``updates``, ``(updates, 4)``."""
    attitude = np.empty((updates, 4))
    pairs = attitude.view(np.complex128)
    now = first.view(np.complex128)
    chunk = max(1, _CHUNK_SAMPLES // stepper.stride)
    for begin in range(0, updates, chunk):
        end = min(begin + chunk, updates)
        a, b = cumulative_product((now[0], now[1]), stepper.steps(fed, begin, end))
        square = a.real**2 + a.imag**2 + b.real**2 + b.imag**2
        factor = 1.5 - 0.5 * square  # one Newton step to length 1: rounding leaves 1e-12
        np.multiply(a, factor, out=pairs[begin:end, 0])
        np.multiply(b, factor, out=pairs[begin:end, 1])
        now = pairs[end - 1]
    return attitude
