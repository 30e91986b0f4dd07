"""The correction of `rate-correction`: 40 deg at 0.039 Hz on all three Euler angles for 300 s."""

import numpy as np
import pytest

from northfinder.attitude import integrate
from tests.attitude.motions import ARCSEC, Array, Swinging, rotation
from tests.evidence import Record


def largest_errors_arcsec(rate_hz: float, beta: float) -> Array:
    """Largest errors of yaw, pitch and roll, with true body rates."""
    motion, dt = Swinging(), 1.0 / rate_hz
    time_s: Array = dt * np.arange(round(300.0 * rate_hz) + 1.0)
    q = integrate(motion.rate(time_s), dt, "picard", alpha=1.0, beta=beta)
    angle = motion.amplitude_rad * np.sin(2.0 * np.pi * motion.frequency_hz * time_s[1:])
    truth = np.stack([-angle, angle, angle], axis=-1)
    errors: Array = np.abs(rotation(q).as_euler("ZXY") - truth).max(axis=0) / ARCSEC
    return errors


@pytest.mark.parametrize(
    ("rate_hz", "expected_arcsec"),
    [(200.0, [217.4, 190.0, 198.0]), (1000.0, [43.5, 38.0, 39.7])],
)
def test_without_correction_the_rate_held_over_the_interval_errs(
    rate_hz: float, expected_arcsec: list[float], record_property: Record
) -> None:
    errors = largest_errors_arcsec(rate_hz, beta=0.0)
    record_property("measured", f'uncorrected at {rate_hz:g} Hz: {errors.max():.1f}"')
    assert errors == pytest.approx(expected_arcsec, rel=0.02)


@pytest.mark.parametrize(
    ("rate_hz", "expected_arcsec", "limit_arcsec"),
    [(200.0, [0.054, 0.044, 0.012], 0.06), (1000.0, [0.0022, 0.0018, 0.0005], 0.0025)],
)
def test_half_the_last_change_corrects_it(
    rate_hz: float, expected_arcsec: list[float], limit_arcsec: float, record_property: Record
) -> None:
    errors = largest_errors_arcsec(rate_hz, beta=-0.5)
    record_property("measured", f'corrected at {rate_hz:g} Hz: {errors.max():.2g}"')
    assert errors.max() <= limit_arcsec
    assert errors == pytest.approx(expected_arcsec, rel=0.1)
