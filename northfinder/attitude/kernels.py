"""The streaming methods compiled by Numba: one pass, nothing stored but the attitude.

Numba comes with the extra ``fast`` and is imported when the first method is compiled, which takes
a second or two. ``functional`` works in blocks and gains nothing here.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from northfinder.attitude.arrays import (
    FloatArray,
    as_period,
    as_samples,
    as_unit_quaternion,
    check_name,
)
from northfinder.attitude.extraction import Extraction
from northfinder.attitude.integrate import count_updates, integrate_updates
from northfinder.attitude.kernel_sources import rk4_kernel, scheme_kernel
from northfinder.attitude.methods import METHODS, Options, check_method, prepare
from northfinder.attitude.rotation_vectors import Kind, Scheme

#: The methods that can be compiled.
COMPILED: Final = tuple(name for name in METHODS if name != "functional")

Kernel = Callable[[FloatArray, float, FloatArray, FloatArray, int], None]


def integrate_compiled(  # noqa: PLR0913 (that of ``integrate``)
    samples: ArrayLike,
    dt: float,
    method: str = "rate-vector-optimal",
    q0: ArrayLike = (1.0, 0.0, 0.0, 0.0),
    kind: Kind = "rates",
    *,
    extraction: Extraction | None = None,
    alpha: float | None = None,
    beta: float | None = None,
) -> FloatArray:
    """Integrate as ``integrate`` does, to 1e-14, several times as fast.

    Args:
        samples: As for ``integrate``, ``(k, 3)``.
        dt: Sampling period, s.
        method: Any but ``functional``.
        q0: As for ``integrate``.
        kind: As for ``integrate``.
        extraction: As for ``integrate``.
        alpha: As for ``integrate``.
        beta: As for ``integrate``.

    Returns:
        Attitude at the end of each whole update, ``(m, 4)``.

    Raises:
        ModuleNotFoundError: Numba is not installed.
        ValueError: As ``integrate`` raises, and for ``functional``.
    """
    check_name("compiled method", method, COMPILED)
    options = Options(extraction, alpha, beta)
    check_method(method, kind, options)
    array, now = as_samples(samples), as_unit_quaternion(q0)
    stepper, fed = prepare(method, kind, array, as_period(dt), options)
    updates = count_updates(stepper, method, kind, len(array), len(fed))
    kernel = _kernel(stepper.scheme, stepper.behind)
    attitude = np.empty((updates, 4))
    early = min(updates, stepper.behind)
    if early:
        attitude[:early] = integrate_updates(stepper, fed, early, now)
        now = attitude[early - 1]
    kernel(np.ascontiguousarray(fed), stepper.unit, now, attitude, early)
    return attitude


@cache
def _kernel(scheme: Scheme | None, behind: int) -> Kernel:
    """Compile the kernel of a scheme; of Runge-Kutta where there is none."""
    jit = _numba().njit(fastmath={"contract", "nsz", "nnan", "ninf"}, nogil=True)
    compiled: Kernel = rk4_kernel(jit) if scheme is None else scheme_kernel(jit, scheme, behind)
    return compiled


def _numba() -> Any:  # noqa: ANN401 (Numba is optional, and so are its types)
    try:
        return import_module("numba")
    except ImportError as error:
        msg = "compiled integration needs Numba: pip install 'northfinder[fast]', or use integrate"
        raise ModuleNotFoundError(msg, name="numba") from error
