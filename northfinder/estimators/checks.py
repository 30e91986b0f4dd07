"""What a finished revolution tells of itself: each check is one value against one limit.

False alarms of the statistical checks by noise alone: a warning in about 1000 runs (0.27 % for
the 3-sigma ones), a failure in about a million; of ``turned``, in about 1000. What none of them
can see is in docs/theory.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtr, chdtrc

from northfinder.estimators.arrays import FloatArray
from northfinder.estimators.azimuth import AzimuthSolution, EarthRate
from northfinder.estimators.drift import HIGHEST_ORDER, SIGNIFICANT_SIGMAS, unmodelled_drift
from northfinder.estimators.harmonic import HarmonicFit
from northfinder.estimators.student import sigma_limit
from northfinder.estimators.tilt import TiltEstimate
from northfinder.units import ARCMIN, DEG, DEG_PER_HOUR, HOUR

Status = Literal["pass", "warn", "fail"]
Sensor = Literal["gyro", "accelerometer"]
NoiseSource = Literal["given", "seen within the visits"]

WARN_PROBABILITY = 1e-3
FAIL_PROBABILITY = 1e-6
WARN_TILT_RAD = 10.0 * DEG
FAIL_TILT_RAD = 30.0 * DEG
WARN_LATITUDE_RAD = 80.0 * DEG
WARN_EARTH_RATE_Z = 3.0
FAIL_EARTH_RATE_Z = 5.0
FAIL_DRIFT_SIGMAS = 4.0  # a result that is off by more than 4 stated sigma is wrong
WARN_LOST_FRACTION = 1e-3
FAIL_LOST_FRACTION = 0.1
WARN_INVALID_FRACTION = 0.0
FAIL_INVALID_FRACTION = 0.01
WARN_SPIKE_FRACTION = 0.0
FAIL_SPIKE_FRACTION = 0.05


@dataclass(frozen=True, slots=True)
class Check:
    """A verdict in words: the value, its limit and what to do."""

    name: str
    status: Status
    detail: str


def check_residuals(
    fit: HarmonicFit,
    sigma: ArrayLike,
    source: NoiseSource,
    sensor: Sensor,
) -> Check:
    """Compare the scatter between visits with the sigma given, or with that within the visits.

    A sensor whose samples are correlated (a low-pass narrower than its rate) shows less scatter
    within a visit than it should, and warns here.

    Args:
        fit: One revolution's fit.
        sigma: Of each visit's mean, scalar or ``(n,)``; of a fit with correlated readings its
            own covariance counts, which holds that sigma.
        source: Where that sigma comes from.
        sensor: Whose fit it is.
    """
    name = "residuals" if sensor == "gyro" else "accelerometer residuals"
    sigma = np.asarray(sigma, dtype=np.float64)
    correlated = fit.design.covariance is not None
    if fit.dof == 0 or not np.all(sigma > 0.0):
        why = "no degrees of freedom" if fit.dof == 0 else "a visit whose samples do not scatter"
        return Check(
            name, "warn", f"The {sensor}'s noise could not be judged: {why}; measure more visits."
        )
    chi2 = float(fit.chi2) if correlated else float(np.sum((fit.residuals / sigma) ** 2))
    ratio = f"{np.sqrt(chi2 / fit.dof):.2f} times the sigma {source}"
    if correlated:
        ratio += " and the slow noise"
    text = f"The {sensor}'s visits scatter {ratio} (chi-square {chi2:.1f}, {fit.dof} dof)"
    excess, lack = float(chdtrc(fit.dof, chi2)), float(chdtr(fit.dof, chi2))
    if excess < WARN_PROBABILITY:
        status: Status = "fail" if excess < FAIL_PROBABILITY else "warn"
        advice = "something besides noise moves the readings; look for vibration, drift or touch."
        return Check(
            name, status, f"{text}, which noise does with probability {excess:.1g}: {advice}"
        )
    if lack < WARN_PROBABILITY:
        return Check(name, "warn", f"{text}: too little; the sigma {source} is too large.")
    return Check(name, "pass", f"{text}, as noise does.")


@dataclass(frozen=True, slots=True)
class Disturbed:
    """A visit that was left out: which one, of which sensor, and how many sigma it is off."""

    visit: int
    angle_rad: float
    sensor: Sensor
    times: float

    def __str__(self) -> str:
        angle_deg = self.angle_rad / DEG
        return f"visit {self.visit + 1} at {angle_deg:g} deg ({self.sensor}, {abs(self.times):.1f})"


def check_outliers(
    visits: int, limit: float, strange: int, disturbed: Sequence[Disturbed]
) -> Check:
    """Say which visits were left out because they do not belong to the rest.

    Args:
        visits: How many there are.
        limit: How many times the scatter of the others a visit that belongs may be off.
        strange: How many do not seem to belong.
        disturbed: Those that were left out.
    """
    if not np.isfinite(limit):
        return Check("outliers", "pass", f"{visits} visits are too few to tell an outlier.")
    if disturbed and _follow_one_another(sorted({each.visit for each in disturbed}), visits):
        text = (
            f"{', '.join(map(str, disturbed))} do not belong to the rest, and follow one another: "
            "something moved, and stayed where it is; measure again."
        )
        return Check("outliers", "fail", text)
    if disturbed:
        text = (
            f"Left out, being off by so many times the scatter of the others (limit {limit:.1f}): "
            f"{', '.join(map(str, disturbed))}. Something disturbed them; the rest stands."
        )
        return Check("outliers", "warn", text)
    if strange:
        text = (
            f"{strange} of {visits} visits do not belong to the rest, too many to leave out: "
            f"something moved or disturbed the bench; measure again."
        )
        return Check("outliers", "fail", text)
    text = f"All {visits} visits belong together (limit {limit:.1f} times the others' scatter)."
    return Check("outliers", "pass", text)


def check_frozen(
    mean: ArrayLike, sigma: ArrayLike, visit: Sequence[int], sensor: Sensor
) -> Check | None:
    """Look for visits whose samples are all alike while those of others are not; none: no check.

    Args:
        mean: Of each visit's samples, ``(n,)``.
        sigma: Of that mean by their scatter, ``(n,)``.
        visit: Which visit each is, counted from 0.
        sensor: Whose samples.
    """
    frozen = np.flatnonzero(np.asarray(sigma) == 0.0)
    throughout = len(frozen) == len(visit)
    # A simulated sensor without noise is alike throughout, but feels the table turn.
    if not len(frozen) or (throughout and np.ptp(np.asarray(mean)) > 0.0):
        return None
    text = (
        f"The {sensor}'s samples are all alike in {len(frozen)} of {len(visit)} visits, first in "
        f"visit {visit[frozen[0]] + 1}: it repeats itself instead of measuring; restart it."
    )
    return Check("frozen", "fail", text)


def check_earth_rate(rate: EarthRate) -> Check:
    """Compare the horizontal Earth rate with the latitude's."""
    z = abs(float(rate.z))
    warn, fail = (float(sigma_limit(s, rate.dof)) for s in (WARN_EARTH_RATE_Z, FAIL_EARTH_RATE_Z))
    text = (
        f"The horizontal Earth rate is {float(rate.measured_rad_s) / DEG_PER_HOUR:.4f} deg/h, "
        f"expected {float(rate.expected_rad_s) / DEG_PER_HOUR:.4f}: {z:.1f} sigma apart "
        f"(limit {warn:.1f})"
    )
    if z <= warn:
        return Check("earth rate", "pass", f"{text}.")
    status: Status = "fail" if z > fail else "warn"
    return Check("earth rate", status, f"{text}; check the latitude and the gyro's scale factor.")


def check_drift(fit: HarmonicFit, solution: AzimuthSolution) -> Check:
    """Look for a linear and a quadratic drift that the fit leaves out, and what they would do.

    Raises:
        ValueError: The fit's readings carry no time.
    """
    terms = unmodelled_drift(fit)
    if not terms:
        highest = max(fit.design.drift_orders)
        return Check("drift", "pass", f"Drift up to order {highest} is fitted.")
    seen = ", ".join(
        f"{('linear', 'quadratic')[term.order - 1]} {abs(float(term.z)):.1f} sigma"
        for term in terms
    )
    found = [term for term in terms if bool(term.significant)]
    text = f"{_fitted_drift(fit)}Drift across the revolution: {seen} (limit {SIGNIFICANT_SIGMAS:g})"
    if not found:
        return Check("drift", "pass", f"{text}.")
    shift = sum(float(solution.jacobian[:2] @ term.response * term.coefficient) for term in found)
    status: Status = (
        "fail" if abs(shift) > FAIL_DRIFT_SIGMAS * float(solution.sigma_rad) else "warn"
    )
    sizes = " and ".join(
        f"{float(term.coefficient) * HOUR**term.order / DEG_PER_HOUR:.3g} deg/h per "
        f"{'h' if term.order < HIGHEST_ORDER else 'h^2'}"
        for term in found
    )
    advice = "let the gyro warm up, or measure out and back, twice where it curves."
    return Check(
        "drift", status, f"{text}; {sizes} moves the azimuth by {shift / ARCMIN:.2f}': {advice}"
    )


def _fitted_drift(fit: HarmonicFit) -> str:
    slopes_deg_h2 = [
        float(terms.drift[0]) * HOUR / DEG_PER_HOUR for terms in fit.segments if len(terms.drift)
    ]
    if not slopes_deg_h2:
        return ""
    slopes = " and ".join(f"{slope:.3g}" for slope in slopes_deg_h2)
    return f"A linear drift of {slopes} deg/h per h is fitted. "


def check_tilt(tilt: TiltEstimate) -> Check:
    """Compare the tilt with what the table and the accelerometer are good for."""
    epsilon_deg = float(tilt.epsilon_rad) / DEG
    text = f"The table is tilted by {epsilon_deg:.2f} deg (limit {WARN_TILT_RAD / DEG:g})"
    if tilt.epsilon_rad <= WARN_TILT_RAD:
        return Check("tilt", "pass", f"{text}.")
    status: Status = "fail" if tilt.epsilon_rad > FAIL_TILT_RAD else "warn"
    return Check("tilt", status, f"{text}; level it: scale factor and mounting errors grow.")


def check_latitude(latitude_rad: float) -> Check:
    """Warn where little of the Earth's rate is horizontal."""
    text = (
        f"Latitude {latitude_rad / DEG:.4f} deg leaves {np.cos(latitude_rad):.0%} of the Earth's "
        f"rate to find north by (limit {WARN_LATITUDE_RAD / DEG:g} deg)"
    )
    if abs(latitude_rad) <= WARN_LATITUDE_RAD:
        return Check("latitude", "pass", f"{text}.")
    return Check("latitude", "warn", f"{text}; dwell longer.")


def check_lost_samples(samples: ArrayLike, lost: ArrayLike) -> Check:
    """Compare the samples that never arrived with those that should have, visit by visit.

    Args:
        samples: Samples that arrived in each visit.
        lost: Samples that did not.
    """
    missing = np.asarray(lost, dtype=np.float64)
    expected = np.asarray(samples, dtype=np.float64) + missing
    limits = (WARN_LOST_FRACTION, FAIL_LOST_FRACTION)
    advice = "check the cable, the baud rate and the load of this computer."
    return _fraction_check("lost samples", "were lost", missing, expected, limits, advice)


def check_invalid_samples(samples: ArrayLike, invalid: ArrayLike) -> Check:
    """Compare the gyro samples that the gyro itself marked invalid with all that arrived."""
    limits = (WARN_INVALID_FRACTION, FAIL_INVALID_FRACTION)
    return _fraction_check(
        "invalid samples",
        "were marked invalid by the gyro",
        np.asarray(invalid, dtype=np.float64),
        np.asarray(samples, dtype=np.float64),
        limits,
        "read the gyro's self-test.",
    )


def _follow_one_another(visit: Sequence[int], visits: int) -> bool:
    """Say whether there are three in a row, or two at the end."""
    three = any(later - first == 2 for first, later in zip(visit, visit[2:], strict=False))
    return three or list(visit[-2:]) == [visits - 2, visits - 1]


def check_spikes(samples: ArrayLike, spikes: ArrayLike, limit: float) -> Check:
    """Compare the samples that stand out, and are left out, with all.

    Args:
        samples: Samples that arrived in each visit.
        spikes: Those of them that stand out.
        limit: From how many times the scatter on they do.
    """
    return _fraction_check(
        "spikes",
        f"stand out by more than {limit:g} times the scatter",
        np.asarray(spikes, dtype=np.float64),
        np.asarray(samples, dtype=np.float64),
        (WARN_SPIKE_FRACTION, FAIL_SPIKE_FRACTION),
        "they are left out; look for electrical noise, shocks and loose contacts.",
    )


def _fraction_check(  # noqa: PLR0913, PLR0917 (the two sentences differ in each of these)
    name: str,
    verb: str,
    part: FloatArray,
    whole: FloatArray,
    limits: tuple[float, float],
    advice: str,
) -> Check:
    share = np.divide(part, whole, out=np.ones_like(part), where=whole > 0.0)
    worst = int(np.argmax(share))
    if share[worst] == 0.0:
        return Check(name, "pass", f"None of {whole.sum():.0f} samples {verb}.")
    text = (
        f"{part.sum():.0f} of {whole.sum():.0f} samples {verb}, at most {share[worst]:.2%} in one "
        f"visit (visit {worst + 1}; limit {limits[0]:.1%})"
    )
    if share[worst] <= limits[0]:
        return Check(name, "pass", f"{text}.")
    status: Status = "fail" if share[worst] > limits[1] else "warn"
    return Check(name, status, f"{text}; {advice}")
