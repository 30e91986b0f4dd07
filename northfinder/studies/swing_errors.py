"""What `rate-correction` does to the swing: errors of its angles, and of its equations in print."""

from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation

from northfinder.attitude import integrate
from northfinder.attitude.arrays import FloatArray
from northfinder.attitude.quaternion import conjugate
from northfinder.studies.swinging import Swinging
from northfinder.units import ARCSEC, DEG

_DURATION_S: Final = 300.0
_SWING: Final = Swinging()


def euler_errors(
    rate_hz: float, beta: float, *, at_start: bool = False, by_eq_10: bool = False
) -> FloatArray:
    """Return errors of yaw, pitch and roll at every sample, rad, ``(k, 3)``.

    Args:
        rate_hz: Of sampling.
        beta: Of eq 12.
        at_start: Each interval takes the rate at its start, not the one at its end.
        by_eq_10: Take the angles' rates for body rates, as eq 10 does.
    """
    time_s = np.arange(round(_DURATION_S * rate_hz) + 1.0) / rate_hz
    sampled_s = time_s - (1.0 / rate_hz if at_start else 0.0)
    rates = _SWING.euler_rates(sampled_s) if by_eq_10 else _SWING.rate(sampled_s)
    q = integrate(rates, 1.0 / rate_hz, "picard", alpha=1.0, beta=beta)
    return _euler(q) - _SWING.euler_rad(time_s[1:])


def _euler(q: FloatArray) -> FloatArray:
    return np.asarray(Rotation.from_quat(q, scalar_first=True).as_euler("ZXY"))


def largest_arcsec(error_rad: FloatArray) -> float:
    """Return the largest magnitude in arc seconds."""
    return float(np.abs(error_rad).max()) / ARCSEC


def best_beta(around: float, *, at_start: bool) -> float:
    """Return the beta with the least error, of those at steps of 0.02 around one."""
    betas = around + 0.02 * np.arange(-5.0, 6.0)
    errors = [largest_arcsec(euler_errors(200.0, beta, at_start=at_start)) for beta in betas]
    return float(betas[np.argmin(errors)])


def eq_5_apart(sign: float) -> float:
    """Largest difference of eq 5's elements from the product with ``R_z(sign * psi)``."""
    cos, sin = np.cos(40.0 * DEG), np.sin(40.0 * DEG)
    printed = np.array(
        [
            [cos * cos - sin**3, sin * cos + cos * sin**2, -cos * sin],
            [-sin * cos, cos * cos, sin],
            [cos * sin + sin**2 * cos, sin * sin - cos * sin * cos, cos * cos],
        ]
    )
    about_z = np.array([[cos, sign * sin, 0.0], [-sign * sin, cos, 0.0], [0.0, 0.0, 1.0]])
    about_x = np.array([[1.0, 0.0, 0.0], [0.0, cos, sin], [0.0, -sin, cos]])
    about_y = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
    return float(np.abs(about_y @ about_x @ about_z - printed).max())


def reversed_order_deg() -> float:
    """Largest error with every step on the wrong side: the conjugate of the backward turn."""
    time_s = np.arange(round(_DURATION_S * 200.0) + 1.0) / 200.0
    q = conjugate(integrate(-_SWING.rate(time_s), 0.005, "picard", beta=-0.5))
    found = Rotation.from_quat(q, scalar_first=True)
    return float((_SWING.attitude(time_s[1:]).inv() * found).magnitude().max()) / DEG
